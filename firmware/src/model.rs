//! The model in flash.

use hivtac_sensing::model::Model;

/// The model file, read in place.
static FILE: &[u8] = include_bytes!("../../calibration/models/default.hvtm");

/// The model; `None`, with a log line, when the file is not usable. Samples then say so and have no force.
pub fn embedded() -> Option<Model<'static>> {
    match Model::parse(FILE) {
        Ok(model) => Some(model),
        Err(error) => {
            defmt::error!("the built-in model: {}", defmt::Display2Format(&error));
            None
        }
    }
}
