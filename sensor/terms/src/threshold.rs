//! Defines thresholds, which select a marker's pixels, for each pixel format. The `tables` of
//! `hivtac-sensor` compile an HSV box to a look-up table.

use crate::hsv::Hsv;
use core::fmt;

/// The format of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema),
    serde(rename_all = "lowercase")
)]
pub enum PixelFormat {
    /// 16 bits: red in bits 15–11, green in 10–5, blue in 4–0.
    #[cfg_attr(feature = "wire", serde(alias = "Rgb565"))]
    Rgb565,
    /// Pairs of pixels in the byte order Y0 Cb Y1 Cr.
    #[cfg_attr(feature = "wire", serde(alias = "Yuv422"))]
    Yuv422,
    /// One byte for each pixel: its luma.
    #[cfg_attr(feature = "wire", serde(alias = "Mono"))]
    Mono,
}

impl PixelFormat {
    /// All formats, in the order in which the model file numbers them.
    pub const ALL: [PixelFormat; 3] = [PixelFormat::Rgb565, PixelFormat::Yuv422, PixelFormat::Mono];

    /// Its name in files and on command lines: `rgb565`, `yuv422` or `mono`.
    pub const fn name(self) -> &'static str {
        match self {
            PixelFormat::Rgb565 => "rgb565",
            PixelFormat::Yuv422 => "yuv422",
            PixelFormat::Mono => "mono",
        }
    }

    /// Number of `u16`s of a row of `width` pixels.
    pub const fn row_length(self, width: u16) -> usize {
        match self {
            PixelFormat::Rgb565 | PixelFormat::Yuv422 => width as usize,
            PixelFormat::Mono => width.div_ceil(2) as usize,
        }
    }
}

/// The colours of a marker's pixels, and with them the pixel format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum Threshold {
    /// A box of colours.
    Rgb565(HsvBox),
    /// A lowest Cr.
    Yuv422(Yuv422),
    /// Limits of the luma.
    Mono(Mono),
}

impl Threshold {
    /// The default for red markers on grey film.
    pub const fn red(format: PixelFormat) -> Threshold {
        match format {
            PixelFormat::Rgb565 => Threshold::Rgb565(HsvBox::RED),
            PixelFormat::Yuv422 => Threshold::Yuv422(Yuv422::RED),
            PixelFormat::Mono => Threshold::Mono(Mono::DARK),
        }
    }

    /// The pixel format.
    pub const fn format(&self) -> PixelFormat {
        match self {
            Threshold::Rgb565(_) => PixelFormat::Rgb565,
            Threshold::Yuv422(_) => PixelFormat::Yuv422,
            Threshold::Mono(_) => PixelFormat::Mono,
        }
    }

    /// From its six numbers in a file: those of [`HsvBox::limits`]; a lowest Cr and zeros; or
    /// lowest and highest luma and zeros.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), or a number that must be zero in this format is not.
    pub const fn of_limits(
        format: PixelFormat,
        limits: [u8; 6],
    ) -> Result<Threshold, ThresholdError> {
        let threshold = match (format, limits) {
            (PixelFormat::Rgb565, limits) => Threshold::Rgb565(HsvBox::of_limits(limits)),
            (PixelFormat::Yuv422, [cr_low, 0, 0, 0, 0, 0]) => Threshold::Yuv422(Yuv422 { cr_low }),
            (PixelFormat::Mono, [low, high, 0, 0, 0, 0]) => Threshold::Mono(Mono { low, high }),
            (format, _) => return Err(ThresholdError::NotZero(format)),
        };
        match threshold.check() {
            Ok(()) => Ok(threshold),
            Err(error) => Err(error),
        }
    }

    /// Its six numbers, the arguments of [`of_limits`](Self::of_limits).
    pub const fn limits(&self) -> [u8; 6] {
        match *self {
            Threshold::Rgb565(hsv_box) => hsv_box.limits(),
            Threshold::Yuv422(Yuv422 { cr_low }) => [cr_low, 0, 0, 0, 0, 0],
            Threshold::Mono(Mono { low, high }) => [low, high, 0, 0, 0, 0],
        }
    }

    /// Checks whether the threshold is valid.
    ///
    /// # Errors
    /// Those of [`HsvBox::check`], or a lowest luma above the highest.
    pub const fn check(&self) -> Result<(), ThresholdError> {
        match *self {
            Threshold::Rgb565(hsv_box) => hsv_box.check(),
            Threshold::Mono(Mono { low, high }) if low > high => {
                Err(ThresholdError::LumaEmpty { low, high })
            }
            Threshold::Yuv422(_) | Threshold::Mono(_) => Ok(()),
        }
    }
}

impl From<HsvBox> for Threshold {
    fn from(hsv_box: HsvBox) -> Threshold {
        Threshold::Rgb565(hsv_box)
    }
}

/// An inclusive box in OpenCV's 8-bit HSV (H 0–179). `hue_low > hue_high` wraps through 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
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

    /// The box with these six limits, in the order of the fields, unchecked: as in files and
    /// commands.
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

    /// Checks whether the box is valid.
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

    /// Returns whether a colour is in the box, borders included.
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

/// YUV422 in the order Y0 Cb Y1 Cr: one `u16` for each pixel, luma in its low byte. A pair of
/// pixels belongs to a marker if its Cr is at least the threshold. A pixel's weight is 64 at the
/// threshold, and grows by two for each level of Cr.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Yuv422 {
    /// Lowest Cr of a marker.
    pub cr_low: u8,
}

/// Mono: two pixels in a `u16`, the left one in its low byte. A pixel belongs to a marker if its
/// luma is within the limits, both included. Its weight is 64 at the nearer limit, and grows by 5/4
/// for each level inside it. A limit of 0 or 255 does not count as a limit here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Mono {
    /// Lowest luma of a marker.
    pub low: u8,
    /// Highest luma of a marker.
    pub high: u8,
}

impl Yuv422 {
    /// Half way between the Cr of grey film (132) and of red markers (191).
    pub const RED: Yuv422 = Yuv422 { cr_low: 162 };
}

impl Mono {
    /// Half way between dark markers and film. Red markers have a luma of 36 in green light or
    /// behind a green filter, and the film 141. (In white light they are hardly darker than the
    /// film.)
    pub const DARK: Mono = Mono { low: 0, high: 88 };
}

/// Why numbers are not a valid threshold.
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
    /// The lowest luma is above the highest: no pixel would pass.
    LumaEmpty {
        /// Lowest luma.
        low: u8,
        /// Highest luma.
        high: u8,
    },
    /// A number that this format does not use is not zero.
    NotZero(PixelFormat),
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
            ThresholdError::LumaEmpty { low, high } => {
                write!(f, "threshold luma {low} to {high} is empty: swap the two")
            }
            ThresholdError::NotZero(format) => write!(
                f,
                "a threshold of {} has fewer numbers than six: set the others to 0",
                format.name()
            ),
        }
    }
}

impl core::error::Error for ThresholdError {}

/// Order of the two bytes of an RGB565 pixel in the `u16`s of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ByteOrder {
    /// The `u16` is the pixel: red in bits 15–11.
    Native,
    /// The bytes are swapped, as DCMI stores them from a camera that sends the high byte first.
    Swapped,
}

impl ByteOrder {
    /// Returns the pixel (red in bits 15–11) whose value in memory is `raw`.
    pub const fn pixel(self, raw: u16) -> u16 {
        match self {
            ByteOrder::Native => raw,
            ByteOrder::Swapped => raw.swap_bytes(),
        }
    }
}
