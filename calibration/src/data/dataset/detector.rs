//! Detectors of markers in rendered frames: the sensing, or a method with which it is compared.

use std::sync::Mutex;

use anyhow::{Result, anyhow};
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, Threshold};
use hivtac_twin::Frame;

use super::{Observation, Recipe};
use crate::data::rest::features_to_q16;

/// The markers found in a frame, or the reason for a refusal.
pub type Detection = Result<Observation, String>;

/// Finds markers in frames.
pub trait MarkerDetector: Send {
    /// Finds the markers of a frame; an inner `Err` when it has none.
    ///
    /// # Errors
    /// When the detector itself fails.
    fn detect(&mut self, frame: &Frame) -> Result<Detection>;
}

/// Detectors for the same frames; each produces its own data set.
pub type Detectors<'a> = Vec<Box<dyn MarkerDetector + 'a>>;

/// The sensing as a detector.
pub struct Sensing<'m>(Box<Sensor<'m>>);

impl Sensing<'static> {
    /// Finds markers and features without a model: refuses only images that cannot be markers.
    ///
    /// # Errors
    /// When the recipe's frames do not exist.
    pub fn unmodelled(recipe: &Recipe) -> Result<Self> {
        let geometry = Geometry::preset(recipe.preset, recipe.width, recipe.height);
        let mut sensor = Box::new(Sensor::new());
        let settings = Settings {
            threshold: Threshold::red(recipe.format),
            centroid: recipe.centroid,
            ..Settings::usual(geometry, ByteOrder::Native)
        };
        let configured = sensor.configure(settings, None);
        configured.map_err(|error| anyhow!("{error}"))?;
        Ok(Self(sensor))
    }
}

impl<'m> Sensing<'m> {
    /// With a model, tared at the model's own rest position: refuses the same frames as the chip.
    ///
    /// # Errors
    /// When the model's frames cannot be read.
    pub fn tared(model: &Model<'m>) -> Result<Self> {
        let mut sensor = Box::new(Sensor::new());
        let settings = model.conditions.settings(ByteOrder::Native);
        let configured = sensor.configure(settings, Some(*model));
        configured.map_err(|error| anyhow!("{error}"))?;
        sensor.set_tare(Some(model.rest), Drift::NONE);
        Ok(Self(sensor))
    }
}

impl MarkerDetector for Sensing<'_> {
    fn detect(&mut self, frame: &Frame) -> Result<Detection> {
        let measurement = measure(&mut self.0, frame);
        let refused = reasons(measurement.status);
        Ok(match (measurement.markers, measurement.features) {
            (Some(markers), Some(features)) if refused.is_empty() => Ok(Observation {
                features_q16: features_to_q16(&features),
                areas_px: markers.map(|m| m.area),
            }),
            _ => Err(refused),
        })
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

/// Opens detectors.
type Open<'a> = dyn Fn() -> Result<Detectors<'a>> + Sync + 'a;

/// One set of detectors per running thread, opened when needed.
pub(super) struct Pool<'a> {
    open: Box<Open<'a>>,
    idle: Mutex<Vec<Detectors<'a>>>,
}

impl<'a> Pool<'a> {
    pub fn new(open: impl Fn() -> Result<Detectors<'a>> + Sync + 'a) -> Self {
        Self {
            open: Box::new(open),
            idle: Mutex::default(),
        }
    }

    /// Runs all detectors of a set on a frame.
    pub fn detect(&self, frame: &Frame) -> Result<Vec<Detection>> {
        let idle = || self.idle.lock().map_err(|error| anyhow!("{error}"));
        let ready = idle()?.pop();
        let mut detectors = ready.map_or_else(&self.open, Ok)?;
        let detections = detectors
            .iter_mut()
            .map(|detector| detector.detect(frame))
            .collect();
        idle()?.push(detectors);
        detections
    }
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
