//! HSV box threshold: which colours a marker may have. `tables` compiles one to a look-up table.

use crate::hsv::Hsv;
use core::fmt;

/// An inclusive box in OpenCV's 8-bit HSV (H 0–179). `hue_low > hue_high` wraps through 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HsvBox {
    /// Lowest hue, 0–179.
    pub hue_low: u8,
    /// Highest hue, 0–179.
    pub hue_high: u8,
    /// Lowest saturation.
    pub saturation_low: u8,
    /// Highest saturation.
    pub saturation_high: u8,
    /// Lowest value.
    pub value_low: u8,
    /// Highest value.
    pub value_high: u8,
}

impl HsvBox {
    /// The default for red markers: H ≥ 170 or ≤ 10, S ≥ 100, V ≥ 45.
    pub const RED: HsvBox = HsvBox {
        hue_low: 170,
        hue_high: 10,
        saturation_low: 100,
        saturation_high: 255,
        value_low: 45,
        value_high: 255,
    };

    /// Largest hue.
    pub const MAX_HUE: u8 = 179;

    /// Of its six limits, in the order of the fields, unchecked: as files and commands have them.
    pub const fn of_limits(limits: [u8; 6]) -> HsvBox {
        let [
            hue_low,
            hue_high,
            saturation_low,
            saturation_high,
            value_low,
            value_high,
        ] = limits;
        HsvBox {
            hue_low,
            hue_high,
            saturation_low,
            saturation_high,
            value_low,
            value_high,
        }
    }

    /// Its six limits, in the order of the fields.
    pub const fn limits(&self) -> [u8; 6] {
        [
            self.hue_low,
            self.hue_high,
            self.saturation_low,
            self.saturation_high,
            self.value_low,
            self.value_high,
        ]
    }

    /// Says whether the box means something.
    ///
    /// # Errors
    /// A hue above 179, or a lowest saturation or value above the highest.
    pub const fn check(&self) -> Result<(), ThresholdError> {
        if self.hue_low > Self::MAX_HUE {
            return Err(ThresholdError::HueOutOfRange(self.hue_low));
        }
        if self.hue_high > Self::MAX_HUE {
            return Err(ThresholdError::HueOutOfRange(self.hue_high));
        }
        if self.saturation_low > self.saturation_high {
            return Err(ThresholdError::SaturationEmpty {
                low: self.saturation_low,
                high: self.saturation_high,
            });
        }
        if self.value_low > self.value_high {
            return Err(ThresholdError::ValueEmpty {
                low: self.value_low,
                high: self.value_high,
            });
        }
        Ok(())
    }

    /// Whether a colour lies in the box, borders included.
    pub const fn contains(&self, color: Hsv) -> bool {
        let from_low = self.hue_low <= color.hue;
        let to_high = color.hue <= self.hue_high;
        let hue = if self.hue_low <= self.hue_high {
            from_low && to_high
        } else {
            from_low || to_high
        };
        hue && self.saturation_low <= color.saturation
            && color.saturation <= self.saturation_high
            && self.value_low <= color.value
            && color.value <= self.value_high
    }
}

/// Why a box cannot be a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ThresholdError {
    /// This hue is above 179: OpenCV's 8-bit hue counts steps of two degrees.
    HueOutOfRange(u8),
    /// The lowest saturation is above the highest: no colour would pass.
    SaturationEmpty {
        /// Lowest saturation.
        low: u8,
        /// Highest saturation.
        high: u8,
    },
    /// The lowest value is above the highest: no colour would pass.
    ValueEmpty {
        /// Lowest value.
        low: u8,
        /// Highest value.
        high: u8,
    },
}

impl fmt::Display for ThresholdError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ThresholdError::HueOutOfRange(hue) => write!(
                f,
                "threshold hue {hue} is out of range: hues are steps of two degrees, 0 to 179"
            ),
            ThresholdError::SaturationEmpty { low, high } => {
                write!(
                    f,
                    "threshold saturation {low} to {high} is empty: swap the two"
                )
            }
            ThresholdError::ValueEmpty { low, high } => {
                write!(f, "threshold value {low} to {high} is empty: swap the two")
            }
        }
    }
}

impl core::error::Error for ThresholdError {}

/// How the two bytes of an RGB565 pixel lie in the `u16` that a row is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ByteOrder {
    /// The `u16` is the pixel: red in bits 15–11.
    Native,
    /// The bytes are swapped: what DCMI leaves in memory from a camera that sends the high byte first.
    Swapped,
}

impl ByteOrder {
    /// The pixel (red in bits 15–11) that lies in memory as `raw`.
    pub const fn pixel(self, raw: u16) -> u16 {
        match self {
            ByteOrder::Native => raw,
            ByteOrder::Swapped => raw.swap_bytes(),
        }
    }
}
