//! The model.

use hivtac_sensing::model::{AlignedFile, Model};

/// The model file, the default one or that of `HIVTAC_MODEL` (`build.rs`); aligned, so that kernels
/// run it.
static FILE: &AlignedFile<[u8]> = &AlignedFile(*include_bytes!(env!("HIVTAC_MODEL_FILE")));

/// A file of at most so many bytes is copied to DTCM at the start, where its weights are read
/// without waiting; a larger one is read in flash.
const NEAR_LIMIT: usize = 12 * 1024;
/// Bytes of the copy.
const NEAR: usize = if FILE.0.len() <= NEAR_LIMIT {
    FILE.0.len()
} else {
    0
};

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

/// The model; `None`, with a log line, when the file is not usable. Samples then say so and have no
/// force.
pub fn embedded() -> Option<Model<'static>> {
    let file = if NEAR != 0 { &COPY.0[..] } else { &FILE.0 };
    match Model::parse(file) {
        Ok(model) => Some(model),
        Err(error) => {
            defmt::error!("the built-in model: {}", defmt::Display2Format(&error));
            None
        }
    }
}
