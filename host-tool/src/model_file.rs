//! Model files for devices, and how they are sent.

use crate::failure::Failure;
use crate::files::read_at_most;
use hivtac_sensor::force::model::Model;
use hivtac_wire::message::{MODEL_BYTES, MODEL_PART_BYTES, ModelPart, Request};

/// Reads a model file for a device; returns its bytes and the model's CRC.
///
/// # Errors
/// When the file cannot be read, is too long for a device, or is no model.
pub fn read(path: &str) -> Result<(Vec<u8>, u32), Failure> {
    let file = read_at_most(path, MODEL_BYTES as u64);
    let too_long = format!("a model for a device has at most {MODEL_BYTES} bytes");
    let file = file.map_err(|error| Failure::of_file(path, error))?;
    let file = file.ok_or_else(|| Failure::of_file(path, too_long))?;
    let model = Model::parse(&file).map_err(|error| Failure::of_file(path, error))?;
    let crc = model.crc();
    Ok((file, crc))
}

/// The requests that send a file and have it used, in their order; the last one takes longest.
pub fn requests(file: &[u8]) -> impl Iterator<Item = Request> + '_ {
    let bytes = file.len() as u32;
    let chunks = (0..)
        .step_by(MODEL_PART_BYTES)
        .zip(file.chunks(MODEL_PART_BYTES));
    let parts = chunks.map(|(offset, chunk)| {
        Request::ModelPart(ModelPart {
            offset,
            // A chunk is at most as long as a part.
            bytes: chunk.iter().copied().collect(),
        })
    });
    std::iter::once(Request::BeginModel { bytes })
        .chain(parts)
        .chain([Request::UseModel])
}
