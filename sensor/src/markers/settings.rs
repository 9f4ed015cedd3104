//! Holds the settings that a sensor needs before its first frame.

use crate::markers::scanner::{ScanError, ScanSettings};
use core::fmt;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold, ThresholdError};
use hivtac_terms::units::Px;

/// Pixels of a frame for each run that it may have. Four markers have one run per about a thousand
/// pixels. The limit leaves room for 2,000 specks at 800 × 600, and bounds the cost of a frame of
/// noise to three times a usual one.
const PIXELS_PER_RUN: u32 = 64;
/// Runs that any frame may have.
const FEWEST_RUNS: u32 = 64;

/// A frame's size and format, and how its markers are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Settings {
    /// Lens, frame size and markers.
    pub geometry: Geometry,
    /// The colours of a marker's pixels, and with them the pixel format.
    pub threshold: Threshold,
    /// Byte order of RGB565 pixels in a row.
    pub byte_order: ByteOrder,
    /// 3×3 dilations of the mask, 0–3.
    pub dilations: u8,
    /// Blobs of fewer pixels, after dilation, are dropped.
    pub min_area: u32,
    /// How a marker's position is computed from its pixels.
    pub centroid: CentroidEstimator,
}

/// Why settings are refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SettingsError {
    /// The frame cannot be scanned.
    Scan(ScanError),
    /// The threshold is invalid.
    Threshold(ThresholdError),
    /// The width is odd, but this format has pixels in pairs.
    OddWidth(u16, PixelFormat),
    /// [`Geometry::is_sound`] is false.
    Geometry,
}

impl Settings {
    /// The project's usual settings for a geometry: red markers, one dilation, and no blob smaller
    /// than a quarter of a marker at rest.
    pub fn usual(geometry: Geometry, byte_order: ByteOrder) -> Settings {
        Settings {
            geometry,
            threshold: Threshold::red(PixelFormat::Rgb565),
            byte_order,
            dilations: 1,
            min_area: geometry.rest_area(Px(0)) / 4,
            centroid: CentroidEstimator::BinaryMask,
        }
    }

    /// Checks whether a sensor can have these settings.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.scan().check().map_err(SettingsError::Scan)?;
        self.threshold.check().map_err(SettingsError::Threshold)?;
        let (width, format) = (self.geometry.width, self.threshold.format());
        if format != PixelFormat::Rgb565 && !width.is_multiple_of(2) {
            return Err(SettingsError::OddWidth(width, format));
        }
        if self.geometry.is_sound() {
            Ok(())
        } else {
            Err(SettingsError::Geometry)
        }
    }

    /// Returns the settings of the scanner.
    pub fn scan(&self) -> ScanSettings {
        let pixels = u32::from(self.geometry.width) * u32::from(self.geometry.height);
        ScanSettings {
            width: self.geometry.width,
            height: self.geometry.height,
            dilations: self.dilations,
            min_area: self.min_area,
            weighted: self.centroid == CentroidEstimator::RednessWeighted,
            max_runs: FEWEST_RUNS + pixels / PIXELS_PER_RUN,
            cleaned: false,
        }
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SettingsError::Scan(error) => error.fmt(f),
            SettingsError::Threshold(error) => error.fmt(f),
            SettingsError::OddWidth(width, format) => write!(
                f,
                "frame width {width} is odd, and {} has pixels in pairs: use an even width",
                format.name()
            ),
            SettingsError::Geometry => f.write_str(
                "the focal length and all measures of markers and film must be positive and at \
                 most a metre, and a marker no wider than its distance from the axis",
            ),
        }
    }
}

impl core::error::Error for SettingsError {}
