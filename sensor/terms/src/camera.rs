//! Defines a user's camera settings: exposure, gain, and frame rate.

use crate::units::{Microseconds, Sixteenths};
use core::fmt;

/// The settings of the camera. Values that are `None` are chosen once to suit the light, and then
/// stay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct CameraSettings {
    /// Exposure of each row, within [`RateLimits`].
    pub exposure: Option<Microseconds>,
    /// Amplification, [`LEAST_GAIN`] to [`MOST_GAIN`].
    pub gain: Option<Sixteenths>,
    /// Frame rate.
    pub rate: Rate,
    /// Gains with which white is white; `None` for the camera's usual ones, as
    /// [`White::USUAL`]. A camera without colours has no use for them.
    pub white: Option<White>,
}

/// Gains of the colours over that of green, in 64ths, at least [`LEAST_WHITE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct White {
    /// Gain of red.
    pub red: u8,
    /// Gain of blue.
    pub blue: u8,
}

impl White {
    /// Gains in the middle between OmniVision's presets of the OV7725 for sunlight (0x5C, 0x5A) and
    /// for an office (0x4C, 0x84).
    pub const USUAL: White = White {
        red: 0x54,
        blue: 0x6D,
    };
}

impl Default for White {
    fn default() -> White {
        White::USUAL
    }
}

impl fmt::Display for White {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [red, blue] = [self.red, self.blue].map(|gain| f64::from(gain) / 64.0);
        write!(f, "red {red:.2}, blue {blue:.2}")
    }
}

/// Smallest gain of a colour over that of green.
pub const LEAST_WHITE: u8 = 64;

/// Frame rate of a camera, relative to its highest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum Rate {
    /// The highest rate.
    #[default]
    Full,
    /// Half of it: twice as much time for light.
    Half,
    /// A quarter of it.
    Quarter,
}

/// Smallest gain.
pub const LEAST_GAIN: Sixteenths = Sixteenths(16);
/// Largest gain: beyond it noise costs more than light gains.
pub const MOST_GAIN: Sixteenths = Sixteenths(64);

/// A camera's limits at each of [`Rate::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct CameraLimits(pub [RateLimits; 3]);

/// A camera's limits at one rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct RateLimits {
    /// Frames a second, rounded down.
    pub frames_per_second: u16,
    /// Shortest exposure.
    pub shortest: Microseconds,
    /// Longest exposure.
    pub longest: Microseconds,
}

/// The setting that the camera does not accept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraError {
    /// [`CameraSettings::exposure`] is not within these limits.
    Exposure(RateLimits),
    /// [`CameraSettings::gain`] is out of range.
    Gain,
    /// A gain of [`CameraSettings::white`] is too small.
    White,
}

impl Rate {
    /// All rates, highest first.
    pub const ALL: [Rate; 3] = [Rate::Full, Rate::Half, Rate::Quarter];

    /// Factor by which frames take longer than at the full rate.
    pub const fn divisor(self) -> u32 {
        match self {
            Rate::Full => 1,
            Rate::Half => 2,
            Rate::Quarter => 4,
        }
    }
}

impl RateLimits {
    /// Limits with this number of frames a second, and the shortest and the longest exposure.
    pub const fn new(frames_per_second: u16, [shortest, longest]: [Microseconds; 2]) -> RateLimits {
        RateLimits {
            frames_per_second,
            shortest,
            longest,
        }
    }
}

impl CameraLimits {
    /// The limits at a rate.
    pub const fn at(&self, rate: Rate) -> RateLimits {
        let CameraLimits([full, half, quarter]) = *self;
        match rate {
            Rate::Full => full,
            Rate::Half => half,
            Rate::Quarter => quarter,
        }
    }

    /// Checks whether the camera accepts these settings.
    ///
    /// # Errors
    /// The first setting that it does not accept.
    pub fn check(&self, settings: &CameraSettings) -> Result<(), CameraError> {
        let limits = self.at(settings.rate);
        let can = |exposure| (limits.shortest..=limits.longest).contains(&exposure);
        if !settings.exposure.is_none_or(can) {
            return Err(CameraError::Exposure(limits));
        }
        let can = |gain| (LEAST_GAIN..=MOST_GAIN).contains(&gain);
        if !settings.gain.is_none_or(can) {
            return Err(CameraError::Gain);
        }
        let can = |white: White| white.red.min(white.blue) >= LEAST_WHITE;
        if !settings.white.is_none_or(can) {
            return Err(CameraError::White);
        }
        Ok(())
    }
}

impl fmt::Display for CameraError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CameraError::Exposure(limits) => write!(
                f,
                "at {} frames a second an exposure is {} to {} ms",
                limits.frames_per_second, limits.shortest, limits.longest
            ),
            CameraError::Gain => f.write_str("a gain is 1 to 4"),
            CameraError::White => f.write_str("a gain of red or blue is at least 1"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const LIMITS: CameraLimits = CameraLimits([
        RateLimits::new(156, [Microseconds(24), Microseconds(6_405)]),
        RateLimits::new(78, [Microseconds(47), Microseconds(12_810)]),
        RateLimits::new(39, [Microseconds(93), Microseconds(25_620)]),
    ]);

    fn exposed(us: u32, rate: Rate) -> CameraSettings {
        CameraSettings {
            exposure: Some(Microseconds(us)),
            rate,
            ..CameraSettings::default()
        }
    }

    #[test]
    fn an_exposure_is_within_what_its_rate_leaves() {
        assert_eq!(LIMITS.check(&CameraSettings::default()), Ok(()));
        for (us, rate, is_good) in [
            (24, Rate::Full, true),
            (23, Rate::Full, false),
            (6_405, Rate::Full, true),
            (6_406, Rate::Full, false),
            (6_406, Rate::Half, true),
            (46, Rate::Half, false),
            (25_620, Rate::Quarter, true),
            (25_621, Rate::Quarter, false),
        ] {
            let checked = LIMITS.check(&exposed(us, rate));
            assert_eq!(checked.is_ok(), is_good, "{us} µs, {rate:?}");
        }
        let error = LIMITS.check(&exposed(12_811, Rate::Half)).unwrap_err();
        let text = "at 78 frames a second an exposure is 0.047 to 12.810 ms";
        assert_eq!(error.to_string(), text);
    }

    #[test]
    fn a_gain_is_1_to_4() {
        for (gain, is_good) in [(15, false), (16, true), (64, true), (65, false)] {
            let settings = CameraSettings {
                gain: Some(Sixteenths(gain)),
                ..CameraSettings::default()
            };
            let expected = if is_good {
                Ok(())
            } else {
                Err(CameraError::Gain)
            };
            assert_eq!(LIMITS.check(&settings), expected, "{gain}");
        }
    }

    #[test]
    fn a_gain_of_a_colour_is_at_least_1() {
        for (red, blue, is_good) in [(64, 64, true), (63, 90, false), (92, 63, false)] {
            let settings = CameraSettings {
                white: Some(White { red, blue }),
                ..CameraSettings::default()
            };
            assert_eq!(LIMITS.check(&settings).is_ok(), is_good, "{red} {blue}");
        }
        assert_eq!(White::default().to_string(), "red 1.31, blue 1.70");
    }
}
