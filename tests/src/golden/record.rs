//! The records of a script, and the errors of running it.

use core::fmt;

use hivtac_sensor::force::model::ModelError;
use hivtac_sensor::markers::scanner::ScanError;
use hivtac_sensor::markers::settings::SettingsError;
use hivtac_terms::threshold::ThresholdError;

/// The kind of a record, with its fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Offset from a multiple of four at which the model file is stored (u8), length (u32), then
    /// the bytes of the model file that later records use.
    Model = 1,
    /// Flags (u8), then the threshold (6 × u8) for later frames, as in a model file. Flag 1 swaps
    /// the bytes, 2 weighs the pixels of a scan, 4 counts the instructions for the table. The bits
    /// above them are the pixel format's number.
    Threshold = 2,
    /// Width, height (u16), dilations, minimum area (u8), then the pixels (u16 each, or for two of
    /// mono). Result: blobs.
    Scan = 3,
    /// Width, height, number of frames (u16), then their pixels. Result: the whole pipeline, blobs
    /// included.
    Sense = 4,
    /// Eleven features, then eleven of the rest position (i64). Result: network outputs.
    Network = 5,
    /// Three numbers (i32). Result: them as a force vector in µN, and as α, β in m° and |F| in µN.
    Force = 6,
    /// x, y (i32) and area (u32) of markers 0–3, then eleven features (i64) and four areas (u32) of
    /// the rest position. Result: the network and the steps from its answer,
    /// and the steps without each of the markers.
    Press = 7,
}

impl Kind {
    pub(super) const ALL: [Kind; 7] = [
        Kind::Model,
        Kind::Threshold,
        Kind::Scan,
        Kind::Sense,
        Kind::Network,
        Kind::Force,
        Kind::Press,
    ];
}

/// The source of a script.
pub trait Source {
    /// Fills as much of the buffer as possible, and returns the number of bytes. It is less than
    /// the buffer's length only at the end of the script.
    fn read(&mut self, buffer: &mut [u8]) -> usize;
}

impl Source for &[u8] {
    fn read(&mut self, buffer: &mut [u8]) -> usize {
        let length = buffer.len().min(self.len());
        let (head, tail) = self.split_at(length);
        buffer[..length].copy_from_slice(head);
        *self = tail;
        length
    }
}

/// The reasons why a script cannot be run.
#[derive(Debug)]
pub enum ScriptError {
    /// The script ends inside a record.
    Cut,
    /// No record begins with this byte.
    UnknownKind(u8),
    /// Rows of this many words are longer than the longest possible.
    TooWide(usize),
    /// This number of rows with this many words does not fit into memory.
    TooLarge([usize; 2]),
    /// The model is larger than its buffer.
    ModelTooLarge(usize),
    /// A record needs a model, but there was none before.
    NoModel,
    /// A record needs a model that takes steps.
    NoSteps,
    /// The model is invalid.
    Model(ModelError),
    /// No pixel format has this number.
    Format(u8),
    /// The threshold is invalid.
    Threshold(ThresholdError),
    /// The frame cannot be scanned.
    Scan(ScanError),
    /// The sensor does not accept these settings.
    Settings(SettingsError),
    /// The results could not be written.
    Output(fmt::Error),
}

pub(super) fn number(source: &mut impl Source) -> Result<u16, ScriptError> {
    Ok(u16::from_le_bytes(bytes(source)?))
}

pub(super) fn bytes<const N: usize>(source: &mut impl Source) -> Result<[u8; N], ScriptError> {
    let mut bytes = [0; N];
    fill(source, &mut bytes)?;
    Ok(bytes)
}

pub(super) fn fill(source: &mut impl Source, buffer: &mut [u8]) -> Result<(), ScriptError> {
    if source.read(buffer) == buffer.len() {
        Ok(())
    } else {
        Err(ScriptError::Cut)
    }
}
