//! Describes the frames that a model was made for.

use crate::markers::settings::Settings;
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::{ByteOrder, Threshold};

/// Everything about a frame that changes its features, and the meaning of the training labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Conditions {
    /// The name of the geometry.
    pub preset: Preset,
    /// Lens, frame and markers.
    pub geometry: Geometry,
    /// The threshold that made the mask, and with that the pixel format.
    pub threshold: Threshold,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// How a marker's position is taken from its pixels.
    pub centroid: CentroidEstimator,
    /// The meaning of α and β in the labels.
    pub contact: ContactReading,
    /// Where the training data came from.
    pub origin: Origin,
}

/// Where the training data came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Origin {
    /// A simulated sensor.
    Simulated,
    /// The sensor whose microcontroller has this 96-bit unique number.
    Unit([u8; 12]),
}

impl Conditions {
    /// The settings with which markers are found in the same way.
    pub fn settings(&self, byte_order: ByteOrder) -> Settings {
        Settings {
            threshold: self.threshold,
            dilations: self.dilations,
            centroid: self.centroid,
            ..Settings::usual(self.geometry, byte_order)
        }
    }

    /// Returns whether these settings find markers in the same way.
    pub fn are_of(&self, settings: &Settings) -> bool {
        settings.geometry == self.geometry
            && settings.threshold == self.threshold
            && settings.dilations == self.dilations
            && settings.centroid == self.centroid
    }
}
