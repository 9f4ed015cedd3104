//! Under which conditions data was taken and a model holds, in words that files can carry.

use anyhow::{Context, Result};
use clap::ValueEnum;
use hivtac_sensing::geometry::{Geometry, Preset};
use hivtac_sensing::model::{self, CentroidEstimator, ContactReading, Origin, PixelFormat};
use hivtac_sensing::threshold::HsvBox;
use serde::{Deserialize, Serialize};

/// Everything about frames and labels that a model depends on (`docs/model-file.md`, conditions).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Conditions {
    /// Geometry preset: `paper` or `ov7725`.
    pub preset: String,
    /// Columns of a frame.
    pub width: u16,
    /// Rows of a frame.
    pub height: u16,
    /// What a pixel is.
    pub pixel_format: PixelName,
    /// Threshold: lowest and highest hue, saturation and value (OpenCV's 8-bit HSV; hue may wrap through 0).
    pub threshold: [u8; 6],
    /// 3×3 dilations of the mask.
    pub dilations: u8,
    /// How a marker's position is taken from its pixels.
    pub centroid: CentroidName,
    /// What the labels mean.
    pub contact: ContactName,
    /// Where the data came from.
    pub origin: OriginName,
}

/// Pixel formats by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PixelName {
    /// 16-bit colour.
    Rgb565,
}

/// Centroid estimators by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum CentroidName {
    /// The mean of a marker's pixels in the mask.
    BinaryMask,
    /// The mean of the same pixels, weighted with their redness.
    RednessWeighted,
}

/// Contact readings by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactName {
    /// Labels are the force on the film.
    Force,
}

/// Origins by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OriginName {
    /// Rendered from a scene.
    Simulated,
}

impl CentroidName {
    /// The same as the model file holds it.
    pub fn to_model(self) -> CentroidEstimator {
        match self {
            CentroidName::BinaryMask => CentroidEstimator::BinaryMask,
            CentroidName::RednessWeighted => CentroidEstimator::RednessWeighted,
        }
    }
}

impl From<CentroidEstimator> for CentroidName {
    fn from(estimator: CentroidEstimator) -> Self {
        match estimator {
            CentroidEstimator::BinaryMask => CentroidName::BinaryMask,
            CentroidEstimator::RednessWeighted => CentroidName::RednessWeighted,
        }
    }
}

impl Conditions {
    /// What the scene renders and the pipeline does by default, at a frame size.
    pub fn simulated(preset: Preset, width: u16, height: u16) -> Self {
        Self {
            preset: preset.name().into(),
            width,
            height,
            pixel_format: PixelName::Rgb565,
            threshold: HsvBox::RED.limits(),
            dilations: 1,
            centroid: CentroidName::BinaryMask,
            contact: ContactName::Force,
            origin: OriginName::Simulated,
        }
    }

    /// The same as the model file holds it.
    ///
    /// # Errors
    /// When there is no such preset.
    pub fn to_model(&self) -> Result<model::Conditions> {
        let preset = preset(&self.preset)?;
        Ok(model::Conditions {
            preset,
            geometry: Geometry::preset(preset, self.width, self.height),
            pixel_format: match self.pixel_format {
                PixelName::Rgb565 => PixelFormat::Rgb565,
            },
            threshold: HsvBox::of_limits(self.threshold),
            dilations: self.dilations,
            centroid: self.centroid.to_model(),
            contact: match self.contact {
                ContactName::Force => ContactReading::Force,
            },
            origin: match self.origin {
                OriginName::Simulated => Origin::Simulated,
            },
        })
    }
}

/// The geometry preset of that name.
///
/// # Errors
/// When there is none.
pub fn preset(name: &str) -> Result<Preset> {
    Preset::from_name(name).with_context(|| format!("unknown preset `{name}`: use paper or ov7725"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_what_the_firmware_uses() {
        let model = Conditions::simulated(Preset::Ov7725, 320, 240)
            .to_model()
            .unwrap();
        assert_eq!(model.threshold, HsvBox::RED);
        assert_eq!(model.dilations, 1);
        assert_eq!(model.geometry, Geometry::preset(Preset::Ov7725, 320, 240));
        assert_eq!(model.origin, Origin::Simulated);
    }

    #[test]
    fn an_unknown_preset_is_named() {
        let mut conditions = Conditions::simulated(Preset::Paper, 800, 600);
        conditions.preset = "Paper".into();
        assert!(
            conditions
                .to_model()
                .unwrap_err()
                .to_string()
                .contains("`Paper`")
        );
    }
}
