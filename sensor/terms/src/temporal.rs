//! Defines how forces are processed from frame to frame: contact, slip, filter, re-zeroing, and
//! creep. Their limits are settings that a device keeps.

use crate::units::{
    Micrometres, MilliPx, Milliseconds, Permille, SmallPermille, UnsignedMicroNewtons,
};
use core::fmt;

/// How forces are followed from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct TemporalSettings {
    /// Limits of a contact.
    pub contact: ContactLimits,
    /// Limits of a slip.
    pub slip: SlipLimits,
    /// The filter of the force that is sent.
    pub filter: Filter,
    /// How the rest position follows drift; `None` if it does not.
    pub rezero: Option<Rezero>,
    /// The film's memory of its loads.
    pub creep: Creep,
    /// When the output pin is high.
    pub output: Output,
}

/// The film is touched from |F| ≥ `begins` on, until |F| < `ends`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct ContactLimits {
    /// |F| with which a contact begins, 1 µN to 1 N.
    pub begins: UnsignedMicroNewtons,
    /// |F| below which it ends, 1 µN to `begins`.
    pub ends: UnsignedMicroNewtons,
}

/// A contact slips if its place moves by `distance` within the time `within`, while the tangential
/// force is at least `ratio` of the normal one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct SlipLimits {
    /// Distance that the place moves, 1 µm to 5 mm.
    pub distance: Micrometres,
    /// Longest time for that, 10 to 100 ms.
    pub within: Milliseconds,
    /// Smallest ratio of tangential to normal force, 0 to 2.
    pub ratio: Permille,
}

/// The filter of the force that is sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum Filter {
    /// No filter: each frame's own force.
    #[default]
    None,
    /// A first-order low-pass of each component.
    LowPass {
        /// Its time constant, 1 to 10,000 ms, by which a steady change lags.
        time_constant: Milliseconds,
    },
    /// The median of each component in three frames; a steady change lags by one frame.
    MedianOfThree,
}

/// When the output pin is high: from the frame on that shows it, without a host. A frame without a
/// force changes nothing for 100 ms; after that, and without a camera, the pin is low.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum Output {
    /// Never.
    #[default]
    Off,
    /// While something touches the film.
    Contact,
    /// While the contact slips.
    Slip,
    /// From |F| ≥ `limit` until |F| < 9/10 of it.
    Force {
        /// The limit, 1 µN to 1 N.
        limit: UnsignedMicroNewtons,
    },
}

/// How the rest position follows drift while the film is untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Rezero {
    /// Time without a touch before it begins, 1 to 3600 s.
    pub after: Milliseconds,
    /// Largest change of a coordinate of a marker's rest position in a second, 1 to 100.
    pub rate: MilliPx,
    /// Largest total change from where it was tared, 1 to 250.
    pub total: MilliPx,
}

/// The film's memory of its loads. A held load seems to grow by two parts of itself, within half a
/// second and within 20 s. When it is removed, the same parts remain and decay. Forces are right a
/// second after a load was applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Creep {
    /// The parts, 0 to 150 each, which are subtracted. Both are 0 if they were not measured.
    pub parts: [SmallPermille; 2],
}

impl TemporalSettings {
    /// A contact begins at 2 mN and ends below 1 mN. A slip is 60 µm within 50 ms, with a
    /// tangential force of at least a tenth of the normal one. No filter; re-zeroing as
    /// [`Rezero::USUAL`]; a film as [`Creep::USUAL`]; no output.
    pub const USUAL: TemporalSettings = TemporalSettings {
        contact: ContactLimits {
            begins: UnsignedMicroNewtons(2_000),
            ends: UnsignedMicroNewtons(1_000),
        },
        slip: SlipLimits {
            distance: Micrometres(60),
            within: Milliseconds(50),
            ratio: Permille(100),
        },
        filter: Filter::None,
        rezero: Some(Rezero::USUAL),
        creep: Creep::USUAL,
        output: Output::Off,
    };
}

impl Default for TemporalSettings {
    /// [`TemporalSettings::USUAL`].
    fn default() -> Self {
        TemporalSettings::USUAL
    }
}

impl Default for ContactLimits {
    /// Those of [`TemporalSettings::USUAL`].
    fn default() -> Self {
        TemporalSettings::USUAL.contact
    }
}

impl Default for SlipLimits {
    /// Those of [`TemporalSettings::USUAL`].
    fn default() -> Self {
        TemporalSettings::USUAL.slip
    }
}

impl Rezero {
    /// After 10 s, by 5 thousandths of a pixel a second, 200 thousandths in all.
    pub const USUAL: Rezero = Rezero {
        after: Milliseconds(10_000),
        rate: MilliPx(5),
        total: MilliPx(200),
    };
}

impl Default for Rezero {
    /// [`Rezero::USUAL`].
    fn default() -> Self {
        Rezero::USUAL
    }
}

impl Creep {
    /// A film whose creep was not measured.
    pub const USUAL: Creep = Creep {
        parts: [SmallPermille(0); 2],
    };
    /// The time constants. A series with other time constants is nearly one with these and other
    /// parts.
    pub const TIMES: [Milliseconds; 2] = [Milliseconds(500), Milliseconds(20_000)];

    /// Standard uncertainty of each part: 5 in a thousand if they were measured. Otherwise it
    /// covers the range of silicones, in which a held load grows by 2 to 15 % in all.
    pub fn uncertain(&self) -> SmallPermille {
        SmallPermille(if self.is_measured() { 5 } else { 50 })
    }

    /// Returns whether the parts were measured.
    pub fn is_measured(&self) -> bool {
        self.parts != Creep::USUAL.parts
    }
}

impl Default for Creep {
    /// [`Creep::USUAL`].
    fn default() -> Self {
        Creep::USUAL
    }
}

/// The setting that is outside its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TemporalError {
    /// [`ContactLimits::begins`].
    ContactBegins,
    /// [`ContactLimits::ends`].
    ContactEnds,
    /// [`SlipLimits::distance`].
    SlipDistance,
    /// [`SlipLimits::within`].
    SlipWithin,
    /// [`SlipLimits::ratio`].
    SlipRatio,
    /// The time constant of [`Filter::LowPass`].
    TimeConstant,
    /// [`Rezero::after`].
    RezeroAfter,
    /// [`Rezero::rate`].
    RezeroRate,
    /// [`Rezero::total`].
    RezeroTotal,
    /// [`Creep::parts`].
    CreepParts,
    /// The limit of [`Output::Force`].
    OutputLimit,
}

impl fmt::Display for TemporalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            TemporalError::ContactBegins => "a contact begins at 0.001 to 1000 mN",
            TemporalError::ContactEnds => "a contact ends at 0.001 mN to where it begins",
            TemporalError::SlipDistance => "a slip's distance is 1 to 5000 µm",
            TemporalError::SlipWithin => "a slip's time is 10 to 100 ms",
            TemporalError::SlipRatio => "a slip's ratio is 0 to 2",
            TemporalError::TimeConstant => "the filter's time constant is 1 to 10000 ms",
            TemporalError::RezeroAfter => "re-zeroing begins after 1 to 3600 s",
            TemporalError::RezeroRate => "the rate of re-zeroing is 0.001 to 0.1 px a second",
            TemporalError::RezeroTotal => "re-zeroing moves by 0.001 to 0.25 px in all",
            TemporalError::CreepParts => "a part of creep is 0 to 15 %",
            TemporalError::OutputLimit => "the output's limit is 0.001 to 1000 mN",
        })
    }
}

impl TemporalSettings {
    /// Checks whether each setting is within its range.
    ///
    /// # Errors
    /// The first setting that is not.
    pub fn check(&self) -> Result<(), TemporalError> {
        let TemporalSettings {
            contact: ContactLimits { begins, ends },
            slip,
            filter,
            rezero,
            creep,
            output,
        } = self;
        let within = |is_within: bool, error| is_within.then_some(()).ok_or(error);
        let begins_within = (1..=1_000_000).contains(&begins.0);
        within(begins_within, TemporalError::ContactBegins)?;
        let ends_within = (1..=begins.0).contains(&ends.0);
        within(ends_within, TemporalError::ContactEnds)?;
        let distance_within = (1..=5_000).contains(&slip.distance.0);
        within(distance_within, TemporalError::SlipDistance)?;
        let time_within = (10..=100).contains(&slip.within.0);
        within(time_within, TemporalError::SlipWithin)?;
        within(slip.ratio.0 <= 2_000, TemporalError::SlipRatio)?;
        if let Filter::LowPass { time_constant } = filter {
            let constant_within = (1..=10_000).contains(&time_constant.0);
            within(constant_within, TemporalError::TimeConstant)?;
        }
        let parts_within = creep.parts.iter().all(|part| part.0 <= 150);
        within(parts_within, TemporalError::CreepParts)?;
        if let Output::Force { limit } = output {
            let limit_within = (1..=1_000_000).contains(&limit.0);
            within(limit_within, TemporalError::OutputLimit)?;
        }
        let Some(Rezero { after, rate, total }) = rezero else {
            return Ok(());
        };
        let after_within = (1_000..=3_600_000).contains(&after.0);
        within(after_within, TemporalError::RezeroAfter)?;
        within((1..=100).contains(&rate.0), TemporalError::RezeroRate)?;
        within((1..=250).contains(&total.0), TemporalError::RezeroTotal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_within_their_ranges() {
        let settings = TemporalSettings {
            rezero: Some(Rezero::default()),
            ..TemporalSettings::default()
        };
        assert_eq!(settings.check(), Ok(()));
    }

    #[test]
    fn what_is_out_of_range_is_named() {
        type Edit = fn(&mut TemporalSettings);
        let low_pass = |ms| Filter::LowPass {
            time_constant: Milliseconds(ms),
        };
        let good: [Edit; 4] = [
            |s| s.contact.ends = s.contact.begins,
            |s| s.slip.ratio = Permille(2_000),
            |s| s.filter = Filter::MedianOfThree,
            |s| s.rezero = Some(Rezero::default()),
        ];
        for edit in good {
            let mut settings = TemporalSettings::default();
            edit(&mut settings);
            assert_eq!(settings.check(), Ok(()));
        }
        for (constant, is_good) in [(0, false), (1, true), (10_000, true), (10_001, false)] {
            let settings = TemporalSettings {
                filter: low_pass(constant),
                ..TemporalSettings::default()
            };
            assert_eq!(settings.check().is_ok(), is_good, "{constant}");
        }
        let bad: [(Edit, TemporalError); 10] = [
            (
                |s| {
                    s.output = Output::Force {
                        limit: UnsignedMicroNewtons(0),
                    }
                },
                TemporalError::OutputLimit,
            ),
            (
                |s| s.creep.parts[1] = SmallPermille(151),
                TemporalError::CreepParts,
            ),
            (
                |s| s.contact.begins.0 = 1_000_001,
                TemporalError::ContactBegins,
            ),
            (|s| s.contact.ends.0 = 2_001, TemporalError::ContactEnds),
            (|s| s.contact.ends.0 = 0, TemporalError::ContactEnds),
            (|s| s.slip.distance.0 = 0, TemporalError::SlipDistance),
            (|s| s.slip.within.0 = 101, TemporalError::SlipWithin),
            (|s| s.slip.ratio.0 = 2_001, TemporalError::SlipRatio),
            (
                |s| {
                    s.rezero = Some(Rezero {
                        after: Milliseconds(999),
                        ..Rezero::default()
                    });
                },
                TemporalError::RezeroAfter,
            ),
            (
                |s| {
                    s.rezero = Some(Rezero {
                        total: MilliPx(251),
                        ..Rezero::default()
                    });
                },
                TemporalError::RezeroTotal,
            ),
        ];
        for (edit, error) in bad {
            let mut settings = TemporalSettings::default();
            edit(&mut settings);
            assert_eq!(settings.check(), Err(error));
        }
    }
}
