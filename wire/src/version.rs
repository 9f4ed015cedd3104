//! Identifies a peer's protocol: version number, schema hash, and the part of a hello that never
//! changes.

use crate::message::{DeviceMessage, HostHello, HostMessage, PROTOCOL_VERSION};
use postcard_schema::Schema;
use postcard_schema::key::hash::fnv1a64::hash_ty_path;
use postcard_schema::schema::NamedType;
use serde::Deserialize;

/// Changes with every message: FNV-1a over names and types of all fields and variants of both
/// message enums, in order (`postcard-schema`). It does not cover the capacity of strings and the
/// meaning of status bits: their changes must raise [`PROTOCOL_VERSION`].
pub const SCHEMA_HASH: u64 =
    u64::from_le_bytes(hash_ty_path::<(DeviceMessage, HostMessage)>("hivtac"));

/// Names and types of a device's messages, as recordings carry them, so that later releases can
/// read these recordings.
pub const DEVICE_TYPES: &NamedType = DeviceMessage::SCHEMA;

/// The frozen start of both hellos: variant 0, then these two fields, in every protocol version.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[cfg_attr(test, derive(serde::Serialize))]
pub struct HelloPrefix {
    /// The sender's [`PROTOCOL_VERSION`].
    pub protocol: u16,
    /// The sender's [`SCHEMA_HASH`].
    pub schema: u64,
}

impl HelloPrefix {
    /// The prefix of this crate's hellos.
    pub const OURS: HelloPrefix = HelloPrefix {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
    };

    /// A host's hello at which a device of any version starts its own loader, for new firmware: a
    /// device of another version ignores commands.
    pub const START_LOADER: HelloPrefix = HelloPrefix {
        protocol: u16::MAX,
        schema: u64::from_le_bytes(*b"firmware"),
    };

    /// Reads the prefix of a message body (without COBS and checksum), whatever follows it. Returns
    /// `None` if it is not a hello.
    pub fn of(body: &[u8]) -> Option<HelloPrefix> {
        match postcard::take_from_bytes::<(u32, HelloPrefix)>(body) {
            Ok(((0, prefix), _)) => Some(prefix),
            _ => None,
        }
    }

    /// Returns whether the sender uses exactly this crate's messages.
    pub fn is_ours(&self) -> bool {
        *self == Self::OURS
    }
}

impl From<HelloPrefix> for HostHello {
    fn from(prefix: HelloPrefix) -> HostHello {
        HostHello {
            protocol: prefix.protocol,
            schema: prefix.schema,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::examples;

    /// Shows a change of any message, which must also be made in `docs/wire.md` and the golden
    /// vectors.
    #[test]
    fn the_schema_hash_is_that_of_docs_wire_md() {
        assert_eq!(SCHEMA_HASH, 0x9bed_6df6_848f_805d, "{SCHEMA_HASH:#018x}");
    }

    #[test]
    fn both_hellos_begin_with_the_prefix() {
        let mut buffer = [0; 256];
        let device = DeviceMessage::Hello(examples::device_hello());
        let body = postcard::to_slice(&device, &mut buffer).unwrap();
        assert_eq!(HelloPrefix::of(body), Some(HelloPrefix::OURS));
        let host = HostMessage::Hello(HelloPrefix::OURS.into());
        let body = postcard::to_slice(&host, &mut buffer).unwrap();
        assert_eq!(HelloPrefix::of(body), Some(HelloPrefix::OURS));
    }

    /// A host's hello of version 1, and the start of a device's.
    #[test]
    fn a_hello_of_version_1_is_named() {
        let body = [
            0, 1, 0xbb, 0xa4, 0xc4, 0x87, 0xc1, 0x80, 0xb0, 0xbf, 0xe6, 1,
        ];
        let prefix = HelloPrefix::of(&body).unwrap();
        assert_eq!((prefix.protocol, prefix.schema), (1, 0xe67e_c004_10f1_123b));
        assert!(!prefix.is_ours());
    }

    #[test]
    fn other_variants_and_short_bodies_have_no_prefix() {
        assert_eq!(HelloPrefix::of(&[1, 1, 1]), None);
        assert_eq!(HelloPrefix::of(&[0, 1]), None);
        assert_eq!(HelloPrefix::of(&[]), None);
    }
}
