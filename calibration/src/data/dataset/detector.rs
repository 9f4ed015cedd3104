//! Finds markers in rendered frames by the sensing.

use std::sync::Mutex;

use anyhow::{Result, anyhow};
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, Threshold};
use hivtac_twin::Frame;

use super::{Observation, Recipe};
use crate::data::rest::features_to_q16;

/// The sensing without a model, which refuses only what cannot be markers. One for each running
/// thread, opened when needed.
pub(super) struct Detectors<'r> {
    recipe: &'r Recipe,
    idle: Mutex<Vec<Box<Sensor<'static>>>>,
}

impl<'r> Detectors<'r> {
    pub fn new(recipe: &'r Recipe) -> Self {
        Self {
            recipe,
            idle: Mutex::default(),
        }
    }

    /// Finds the markers of a frame; an inner `Err` with the reason when it has none.
    ///
    /// # Errors
    /// When the recipe's frames do not exist.
    pub fn detect(&self, frame: &Frame) -> Result<Result<Observation, String>> {
        let idle = || self.idle.lock().map_err(|error| anyhow!("{error}"));
        let ready = idle()?.pop();
        let mut sensor = ready.map_or_else(|| self.open(), Ok)?;
        let measurement = measure(&mut sensor, frame);
        idle()?.push(sensor);
        let refused = reasons(measurement.status);
        Ok(match (measurement.markers, measurement.features) {
            (Some(markers), Some(features)) if refused.is_empty() => Ok(Observation {
                features_q16: features_to_q16(&features),
                areas_px: markers.map(|m| m.area),
            }),
            _ => Err(refused),
        })
    }

    fn open(&self) -> Result<Box<Sensor<'static>>> {
        let Recipe {
            preset,
            width,
            height,
            ..
        } = *self.recipe;
        let mut sensor = Box::new(Sensor::new());
        let settings = Settings {
            threshold: Threshold::red(self.recipe.format),
            centroid: self.recipe.centroid,
            ..Settings::usual(Geometry::preset(preset, width, height), ByteOrder::Native)
        };
        let configured = sensor.configure(settings, None);
        configured.map_err(|error| anyhow!("{error}"))?;
        Ok(sensor)
    }
}

/// Measures a frame with a sensor.
pub fn measure(sensor: &mut Sensor<'_>, frame: &Frame) -> Measurement {
    sensor.measure_frame(&frame.words())
}

/// Names of the status bits that forbid a force, except the missing model.
pub fn reasons(status: Status) -> String {
    let forbids = |name: &&str| {
        let bit = Status::NAMES
            .iter()
            .find(|(_, n)| n == name)
            .map_or(Status::OK, |(bit, _)| *bit);
        Status::NO_FORCE.contains(bit) && bit != Status::MODEL_MISSING
    };
    status.names().filter(forbids).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_leave_out_what_is_no_reason() {
        let status = Status::MARKERS_MISSING | Status::TARE_MISSING | Status::MODEL_MISSING;
        assert_eq!(reasons(status), "markers_missing");
    }
}
