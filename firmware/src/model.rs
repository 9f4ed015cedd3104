//! Selects the model: the built-in one, or one that a host sent.

use crate::camera;
use crate::dtcm_table::Sensor;
use crate::flash::SecondBank;
use crate::model_slots;
use core::ops::Range;
use hivtac_portable::device::model::{Fitting, Refusal};
use hivtac_portable::storage::blob;
use hivtac_portable::storage::flash::{Flash, WORD_BYTES};
use hivtac_sensor::force::model::{AlignedFile, Model};
use hivtac_sensor::known_answer::Answer;
use hivtac_wire::kept::KeptModel;
use hivtac_wire::message::{MODEL_BYTES, ModelSource};

/// The model file, the default one or that of `HIVTAC_MODEL` (`build.rs`); aligned, so that kernels
/// can run it.
static FILE: &AlignedFile<[u8]> = &AlignedFile(*include_bytes!(env!("HIVTAC_MODEL_FILE")));

/// A computer's answer of the model to the known question (`build.rs`).
static ANSWER: Option<Answer> = include!(concat!(env!("OUT_DIR"), "/known_answer.rs"));

/// A file of at most this many bytes is copied to DTCM at the start, where its weights are read
/// without waiting. A larger one is read in flash.
const NEAR_LIMIT: usize = 12 * 1024;
/// Bytes of the copy.
const NEAR: usize = if FILE.0.len() <= NEAR_LIMIT {
    FILE.0.len()
} else {
    0
};

/// Number of flash sectors for a model, enough for [`MODEL_BYTES`].
const SECTORS: u32 = 2;
const _: () = assert!(MODEL_BYTES <= (SECTORS * SecondBank::SECTOR_WORDS) as usize * WORD_BYTES);

#[unsafe(link_section = ".data.model")]
static COPY: AlignedFile<[u8; NEAR]> = AlignedFile(beginning(&FILE.0));

const fn beginning<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut copy = [0; N];
    let mut i = 0;
    while i < N {
        copy[i] = bytes[i];
        i += 1;
    }
    copy
}

/// A model file, and its source. The file is read where it is used: a model that was read is two
/// kilobytes long.
pub struct ModelFile {
    file: &'static [u8],
    /// Its source.
    pub source: ModelSource,
    /// The slot that holds it, which is lent; `None` for a built-in model.
    pub slot: Option<u8>,
}

impl ModelFile {
    /// The built-in model, with the reason as its source.
    pub fn built_in(source: ModelSource) -> Self {
        Self {
            file: built_in_file(),
            source,
            slot: None,
        }
    }

    /// A kept model: a checked file, in a slot that is lent.
    pub fn kept(file: &'static [u8], slot: u8) -> Self {
        Self {
            file,
            source: ModelSource::Kept,
            slot: Some(slot),
        }
    }

    /// Returns the model; `None`, with a log line, if the file is not usable: samples then report
    /// that and have no force.
    pub fn model(&self) -> Option<Model<'static>> {
        match Model::parse(self.file) {
            Ok(model) => Some(model),
            Err(error) => {
                defmt::error!("the model: {}", defmt::Display2Format(&error));
                None
            }
        }
    }
}

fn built_in_file() -> &'static [u8] {
    if NEAR != 0 { &COPY.0[..] } else { &FILE.0 }
}

/// Returns whether the built-in model answers the known question as on a computer; false if it is
/// not usable. The model is not copied, to spare the stack.
pub fn answers_right(sensor: &mut Sensor) -> bool {
    match &Model::parse(built_in_file()) {
        Ok(model) => ANSWER.is_some_and(|answer| sensor.known_answer(model) == answer),
        Err(_) => false,
    }
}

/// The sectors of the flash's second bank that keep the model of a slot, after those of the log.
pub fn sectors(slot: u8) -> Range<u32> {
    let first = 2 + SECTORS * u32::from(slot);
    first..first + SECTORS
}

/// Returns the kept model, read from the flash; the built-in one if the kept one is unreadable, or
/// does not fit this sensor.
pub fn kept(flash: &mut SecondBank, kept: &KeptModel) -> ModelFile {
    match read(flash, kept) {
        Some(file) => ModelFile::kept(file, kept.slot),
        None => {
            defmt::error!("the kept model cannot be used");
            ModelFile::built_in(ModelSource::Fallback)
        }
    }
}

fn read(flash: &mut SecondBank, kept: &KeptModel) -> Option<&'static [u8]> {
    let read = model_slots::fill(kept.slot, |file| {
        let file = file.get_mut(..kept.bytes as usize)?;
        blob::read(flash, sectors(kept.slot), file).ok()
    });
    read??;
    let file = model_slots::lend(kept.slot, kept.bytes)?;
    if checked(file).is_ok_and(|crc| crc == kept.crc) {
        return Some(file);
    }
    model_slots::give_back(kept.slot);
    None
}

/// Returns the checksum of a model file that is sound and fits this sensor. Not inlined: the model
/// is on the stack during the check only.
///
/// # Errors
/// Why it is refused.
#[inline(never)]
pub fn checked(file: &[u8]) -> Result<u32, Refusal> {
    fitting().check(file).map(|model| model.crc())
}

/// The camera and the unit that a model must fit.
pub fn fitting() -> Fitting {
    Fitting {
        preset: camera::PRESET,
        geometry: camera::GEOMETRY,
        pixels: camera::PIXELS,
        device_id: embassy_stm32::uid::uid(),
    }
}
