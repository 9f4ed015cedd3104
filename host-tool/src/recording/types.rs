//! Reads messages of another release by the types that its recording carries.
//!
//! The types are those of `postcard-schema` as JSON, which names each field and variant. Fields
//! with the same name in this release are taken, unknown ones are left out, and missing ones get
//! their `Default` (`docs/wire.md`, "Versions").

use hivtac_wire::decoder;
use hivtac_wire::message::{DeviceMessage, PROTOCOL_VERSION};
use hivtac_wire::version::{DEVICE_TYPES, SCHEMA_HASH};
use serde_json::{Map, Value};

/// Most values of a message: a malicious file may nest lists.
const MOST_VALUES: u32 = 10_000;

/// The types of this release.
///
/// # Panics
/// Never: they are a constant.
pub fn ours() -> String {
    serde_json::to_string(DEVICE_TYPES).expect("names and types are JSON")
}

/// The types of a release.
#[derive(Clone)]
pub struct Types(Value);

impl Types {
    /// Reads the text that [`ours`] wrote in any release; `None` for any other.
    pub fn parse(text: &str) -> Option<Types> {
        serde_json::from_str(text).ok().map(Types)
    }

    /// The message in a frame, as this release knows it; `None` if the frame is damaged or this
    /// release has no such message.
    pub fn message(&self, frame: &[u8]) -> Option<DeviceMessage> {
        let mut frame = frame.strip_suffix(&[0])?.to_vec();
        let mut body = Body {
            bytes: decoder::body(&mut frame)?,
            left: MOST_VALUES,
        };
        let value = body.value(&self.0)?;
        if !body.bytes.is_empty() {
            return None;
        }
        let mut message = serde_json::from_value(value).ok()?;
        if let DeviceMessage::Hello(hello) = &mut message {
            (hello.protocol, hello.schema) = (PROTOCOL_VERSION, SCHEMA_HASH);
        }
        Some(message)
    }
}

/// The rest of a body.
struct Body<'a> {
    bytes: &'a [u8],
    /// Values that may still be read.
    left: u32,
}

impl Body<'_> {
    /// The next value, of a named type.
    fn value(&mut self, named: &Value) -> Option<Value> {
        self.left = self.left.checked_sub(1)?;
        match &named["ty"] {
            Value::String(name) => self.number_or_text(name),
            Value::Object(whole) => {
                let (kind, inner) = whole.iter().next()?;
                self.composed(kind, inner)
            }
            _ => None,
        }
    }

    fn composed(&mut self, kind: &str, inner: &Value) -> Option<Value> {
        match kind {
            "Option" => match self.byte()? {
                0 => Some(Value::Null),
                1 => self.value(inner),
                _ => None,
            },
            "NewtypeStruct" | "NewtypeVariant" => self.value(inner),
            "Seq" => {
                let count = usize::try_from(self.varint()?).ok()?;
                (count <= self.bytes.len()).then_some(())?;
                (0..count).map(|_| self.value(inner)).collect()
            }
            "Tuple" | "TupleStruct" | "TupleVariant" => {
                inner.as_array()?.iter().map(|it| self.value(it)).collect()
            }
            "Struct" | "StructVariant" => self.fields(inner.as_array()?).map(Value::Object),
            "Enum" => {
                let variants = inner.as_array()?;
                let variant = variants.get(usize::try_from(self.varint()?).ok()?)?;
                let name = variant["name"].as_str()?.to_owned();
                if variant["ty"] == "UnitVariant" {
                    return Some(Value::String(name));
                }
                let (kind, inner) = variant["ty"].as_object()?.iter().next()?;
                let value = self.composed(kind, inner)?;
                Some(Value::Object(Map::from_iter([(name, value)])))
            }
            _ => None,
        }
    }

    fn fields(&mut self, fields: &[Value]) -> Option<Map<String, Value>> {
        let field = |field: &Value| {
            let name = field["name"].as_str()?.to_owned();
            Some((name, self.value(&field["ty"])?))
        };
        fields.iter().map(field).collect()
    }

    fn number_or_text(&mut self, name: &str) -> Option<Value> {
        Some(match name {
            "Bool" => Value::Bool(self.byte()? == 1),
            "U8" => self.byte()?.into(),
            "I8" => self.byte()?.cast_signed().into(),
            "U16" | "U32" | "U64" => self.varint()?.into(),
            "I16" | "I32" | "I64" => {
                let number = self.varint()?;
                ((number >> 1).cast_signed() ^ -((number & 1).cast_signed())).into()
            }
            "F32" => f32::from_le_bytes(*self.take()?).into(),
            "F64" => f64::from_le_bytes(*self.take()?).into(),
            "String" => {
                let length = usize::try_from(self.varint()?).ok()?;
                let (text, rest) = self.bytes.split_at_checked(length)?;
                self.bytes = rest;
                std::str::from_utf8(text).ok()?.into()
            }
            "Unit" | "UnitStruct" => Value::Null,
            _ => return None,
        })
    }

    fn byte(&mut self) -> Option<u8> {
        self.take().map(|&[byte]| byte)
    }

    fn take<const N: usize>(&mut self) -> Option<&[u8; N]> {
        let (taken, rest) = self.bytes.split_first_chunk()?;
        self.bytes = rest;
        Some(taken)
    }

    /// A number of up to 64 bits: seven in each byte, the lowest first.
    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..u64::BITS).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }
}
