//! How a user sets the camera: exposure, gain, and how often it sends a frame.

use crate::units::{Microseconds, Sixteenths};
use core::fmt;

/// How the camera is set. What is `None` is found by what the light needs, and then stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct CameraSettings {
    /// How long each row is exposed, within [`RateLimits`].
    pub exposure: Option<Microseconds>,
    /// How much what was exposed is amplified, [`LEAST_GAIN`] to [`MOST_GAIN`].
    pub gain: Option<Sixteenths>,
    /// How often it sends a frame.
    pub rate: Rate,
}

/// How often a camera sends a frame, of what it can at most.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum Rate {
    /// As often as it can.
    #[default]
    Full,
    /// Half as often: twice as much time for light.
    Half,
    /// A quarter as often.
    Quarter,
}

/// Least gain.
pub const LEAST_GAIN: Sixteenths = Sixteenths(16);
/// Most gain: beyond it noise costs more than light gains.
pub const MOST_GAIN: Sixteenths = Sixteenths(64);

/// What a camera can be set to at each of [`Rate::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct CameraLimits(pub [RateLimits; 3]);

/// What a camera can be set to at one rate.
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

/// A setting that the camera does not take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraError {
    /// [`CameraSettings::exposure`] is not within these limits.
    Exposure(RateLimits),
    /// [`CameraSettings::gain`].
    Gain,
}

impl Rate {
    /// All of them, the most frames first.
    pub const ALL: [Rate; 3] = [Rate::Full, Rate::Half, Rate::Quarter];

    /// By how much frames take longer than at the full rate.
    pub const fn divisor(self) -> u32 {
        match self {
            Rate::Full => 1,
            Rate::Half => 2,
            Rate::Quarter => 4,
        }
    }
}

impl RateLimits {
    /// Of so many frames a second, with the shortest and the longest exposure.
    pub const fn new(frames_per_second: u16, [shortest, longest]: [Microseconds; 2]) -> RateLimits {
        RateLimits {
            frames_per_second,
            shortest,
            longest,
        }
    }
}

impl CameraLimits {
    /// Those at a rate.
    pub const fn at(&self, rate: Rate) -> RateLimits {
        let CameraLimits([full, half, quarter]) = *self;
        match rate {
            Rate::Full => full,
            Rate::Half => half,
            Rate::Quarter => quarter,
        }
    }

    /// Whether the camera can be set so.
    ///
    /// # Errors
    /// The first setting that it does not take.
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
}
