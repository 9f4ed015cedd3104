//! Defines the units that cross module borders, as transparent newtypes instead of bare integers.

use crate::fixed::Q;
use core::fmt;
use core::ops::{Add, Sub};

/// A pixel coordinate or distance in Q16.16: 65,536 steps a pixel. The centre of pixel (0, 0) is
/// the origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Px(pub i32);

impl Px {
    /// Fractional bits.
    pub const FRACTION_BITS: u32 = 16;
    /// One pixel.
    pub const ONE: Px = Px(1 << Self::FRACTION_BITS);

    /// A whole number of pixels, |`pixels`| < 32,768.
    pub const fn from_int(pixels: i32) -> Px {
        Px(pixels << Self::FRACTION_BITS)
    }

    /// A length in pixels; saturates at ± 32,768 px.
    pub fn saturated(length: Q<16, i64>) -> Px {
        Px(length.bits().clamp(i32::MIN.into(), i32::MAX.into()) as i32)
    }

    /// From a value in pixels, truncated towards zero to a step; saturates at the limits of 32
    /// bits.
    pub const fn of_f32(px: f32) -> Px {
        Px((px * 65_536.0) as i32)
    }

    /// The value in pixels, exact to 2⁻²⁴ relative.
    pub fn to_f32(self) -> f32 {
        self.0 as f32 / 65_536.0
    }

    /// The value in pixels, for display and for tests; exact.
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) / 65_536.0
    }
}

impl From<Px> for Q<16, i64> {
    fn from(length: Px) -> Self {
        Q::from_bits(i64::from(length.0))
    }
}

impl Add for Px {
    type Output = Px;
    fn add(self, other: Px) -> Px {
        Px(self.0 + other.0)
    }
}

impl Sub for Px {
    type Output = Px;
    fn sub(self, other: Px) -> Px {
        Px(self.0 - other.0)
    }
}

/// A force component or magnitude in millionths of a newton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct MicroNewtons(pub i32);

/// An angle in thousandths of a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct MilliDegrees(pub i32);

/// A length on the film or in the lens, in thousandths of a millimetre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Micrometres(pub u32);

/// A coordinate on the film, in thousandths of a millimetre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct SignedMicrometres(pub i32);

/// A standard uncertainty of a force component or magnitude, in millionths of a newton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct UnsignedMicroNewtons(pub u32);

/// A standard uncertainty of a direction, in thousandths of a degree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct UnsignedMilliDegrees(pub u32);

/// A torque, in thousandths of a millionth of a newton metre: µN times mm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct NanoNewtonMetres(pub i32);

/// A standard uncertainty of a torque, in thousandths of a millionth of a newton metre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct UnsignedNanoNewtonMetres(pub u32);

/// A time, in thousandths of a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Milliseconds(pub u32);

/// A ratio, in thousandths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Permille(pub u16);

/// A ratio in thousandths, up to 255 of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct SmallPermille(pub u8);

/// A distance in a picture, in thousandths of a pixel: for settings, which people write.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct MilliPx(pub u16);

impl MilliPx {
    /// The value in pixels, for display.
    pub fn to_f64(self) -> f64 {
        f64::from(self.0) * 1e-3
    }
}

/// A short time, in millionths of a second.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Microseconds(pub u32);

impl fmt::Display for Microseconds {
    /// In milliseconds, without the unit.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:03}", self.0 / 1_000, self.0 % 1_000)
    }
}

/// A gain, in sixteenths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Sixteenths(pub u16);
