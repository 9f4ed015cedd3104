//! Lists the reasons why a model file is refused.

use core::fmt;

/// A fault of a model file, and its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ModelError {
    /// The file does not begin with `HVTM`.
    NotAModel,
    /// The file's layout is unknown to this program.
    Version {
        /// The file's version.
        found: u16,
    },
    /// The order of the file's weights is unknown to this program.
    Packing {
        /// The file's packing.
        found: u8,
    },
    /// The file ends before its announced content.
    TooShort {
        /// The byte at which more was needed.
        offset: usize,
        /// The length of the file.
        length: usize,
    },
    /// The file is longer or shorter than it says.
    Length {
        /// The length that its header announces.
        announced: u32,
        /// The length of the file.
        actual: usize,
    },
    /// The file was damaged.
    Crc {
        /// The checksum at its end.
        stored: u32,
        /// The checksum of its bytes.
        computed: u32,
    },
    /// A field holds a value outside its range.
    Field {
        /// Its name in `docs/model-file.md`.
        name: &'static str,
        /// Its offset, bytes.
        offset: usize,
        /// Its allowed values.
        allowed: &'static str,
    },
    /// A layer's number of inputs differs from the number of outputs that feed it.
    Chain {
        /// The layer, from 0.
        layer: usize,
        /// Its inputs.
        inputs: usize,
        /// The number of outputs that feed it.
        fed: usize,
    },
    /// A layer with int8 weights has inputs of more than seven bits.
    WideInputs {
        /// The layer, from 0.
        layer: usize,
        /// The largest magnitude of its inputs.
        largest: u16,
    },
    /// A value of one row of a layer is outside its range.
    Row {
        /// The layer, from 0.
        layer: usize,
        /// The row, from 0.
        row: usize,
        /// The name of the value.
        name: &'static str,
        /// Its allowed values.
        allowed: &'static str,
    },
    /// A row whose sum could leave 32 bits.
    Accumulator {
        /// The layer, from 0.
        layer: usize,
        /// The row, from 0.
        row: usize,
        /// Σ|w|·max|x| + |bias|.
        bound: u64,
    },
    /// A list of a specification does not have the length that its layer's widths require (writing
    /// only).
    SpecLength {
        /// The layer, from 0.
        layer: usize,
        /// The name of the list.
        name: &'static str,
        /// The length it should have.
        expected: usize,
        /// The length it has.
        actual: usize,
    },
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotAModel => write!(f, "not a model file: it does not begin with HVTM"),
            Self::Version { found } => write!(
                f,
                "model file version {found}, this program reads versions {} and {}: export its \
                 weights again (`hivtac-calibrate export`)",
                super::layout::FORCE_VERSION,
                super::layout::PLACE_VERSION
            ),
            Self::Packing { found } => write!(
                f,
                "model file with weights packed as {found}, this program reads {}: export the \
                 model again",
                super::layout::PACKING
            ),
            Self::TooShort { offset, length } => {
                write!(
                    f,
                    "model file cut short: {length} bytes, more needed at byte {offset}"
                )
            }
            Self::Length { announced, actual } => {
                write!(f, "model file has {actual} bytes but announces {announced}")
            }
            Self::Crc { stored, computed } => write!(
                f,
                "model file damaged: CRC-32 {computed:#010x}, its end says {stored:#010x}"
            ),
            Self::Field {
                name,
                offset,
                allowed,
            } => {
                write!(f, "model file: {name} at byte {offset} must be {allowed}")
            }
            Self::Chain { layer, inputs, fed } => {
                write!(
                    f,
                    "model file: layer {layer} has {inputs} inputs but is fed {fed}"
                )
            }
            Self::WideInputs { layer, largest } => write!(
                f,
                "model file: layer {layer} has int8 weights, which take inputs of 0 to 127, but is \
                 fed up to {largest}"
            ),
            Self::Row {
                layer,
                row,
                name,
                allowed,
            } => {
                write!(
                    f,
                    "model file: {name} of layer {layer}, row {row} must be {allowed}"
                )
            }
            Self::Accumulator { layer, row, bound } => write!(
                f,
                "model file: the sum of layer {layer}, row {row} can reach {bound}, beyond \
                 2147483647"
            ),
            Self::SpecLength {
                layer,
                name,
                expected,
                actual,
            } => {
                write!(
                    f,
                    "model: layer {layer} has {actual} {name}, its widths ask for {expected}"
                )
            }
        }
    }
}

impl core::error::Error for ModelError {}
