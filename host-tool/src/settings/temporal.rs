//! Touch, slip, filter, re-zeroing, creep and the output pin as JSON, as lines, and as changes by
//! `settings set`. They decide how forces are followed from frame to frame.

use hivtac_host::decimal::Decimal;
use hivtac_terms::temporal::{
    ContactLimits, Creep, Filter, Output, Rezero, SlipLimits, TemporalSettings,
};
use hivtac_terms::units::{
    Micrometres, MilliPx, Milliseconds, Permille, SmallPermille, UnsignedMicroNewtons,
};
use serde::{Deserialize, Serialize};

/// [`TemporalSettings`] as JSON, in whole numbers of the device's units, unchecked.
#[derive(Serialize, Deserialize)]
#[serde(remote = "TemporalSettings", deny_unknown_fields)]
pub struct TemporalJson {
    #[serde(with = "ContactJson")]
    contact: ContactLimits,
    #[serde(with = "SlipJson")]
    slip: SlipLimits,
    #[serde(with = "FilterJson")]
    filter: Filter,
    #[serde(default, with = "optional_rezero")]
    rezero: Option<Rezero>,
    #[serde(with = "CreepJson")]
    creep: Creep,
    /// Files of earlier versions have none.
    #[serde(default, with = "OutputJson")]
    output: Output,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "ContactLimits", deny_unknown_fields)]
struct ContactJson {
    #[serde(rename = "begins_un")]
    begins: UnsignedMicroNewtons,
    #[serde(rename = "ends_un")]
    ends: UnsignedMicroNewtons,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "SlipLimits", deny_unknown_fields)]
struct SlipJson {
    #[serde(rename = "distance_um")]
    distance: Micrometres,
    #[serde(rename = "within_ms")]
    within: Milliseconds,
    #[serde(rename = "ratio_permille")]
    ratio: Permille,
}

/// A filter, as in the settings and in the output of `info`.
#[derive(Serialize, Deserialize)]
#[serde(
    remote = "Filter",
    tag = "kind",
    rename_all = "kebab-case",
    deny_unknown_fields
)]
pub enum FilterJson {
    /// Each frame's own force.
    None,
    /// A first-order low-pass.
    LowPass {
        /// Its time constant.
        #[serde(rename = "time_constant_ms")]
        time_constant: Milliseconds,
    },
    /// The median of each component in three frames.
    MedianOfThree,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Rezero", deny_unknown_fields)]
struct RezeroJson {
    #[serde(rename = "after_ms")]
    after: Milliseconds,
    #[serde(rename = "rate_mpx_per_s")]
    rate: MilliPx,
    #[serde(rename = "total_mpx")]
    total: MilliPx,
}

optional_json!(optional_rezero, Rezero, "super::RezeroJson");

#[derive(Serialize, Deserialize)]
#[serde(remote = "Creep", deny_unknown_fields)]
struct CreepJson {
    #[serde(rename = "parts_permille")]
    parts: [SmallPermille; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(
    remote = "Output",
    tag = "high",
    rename_all = "kebab-case",
    deny_unknown_fields
)]
enum OutputJson {
    #[serde(rename = "never")]
    Off,
    Contact,
    Slip,
    Force {
        #[serde(rename = "limit_un")]
        limit: UnsignedMicroNewtons,
    },
}

/// The filter and the delay it causes, for a person.
pub fn filter_text(filter: Filter) -> String {
    match filter {
        Filter::None => "none: each frame's own force".to_owned(),
        Filter::LowPass { time_constant } => {
            let ms = time_constant.0;
            format!("low-pass of {ms} ms: a steady change comes {ms} ms later")
        }
        Filter::MedianOfThree => "median of three: a steady change comes a frame later".to_owned(),
    }
}

/// Name and text of each setting, for a person.
pub fn texts(settings: &TemporalSettings) -> [(&'static str, String); 6] {
    let TemporalSettings {
        contact,
        slip,
        filter,
        rezero,
        creep,
        output,
    } = settings;
    let rezero = match rezero {
        None => "off".to_owned(),
        Some(Rezero { after, rate, total }) => format!(
            "after {} s without a contact, by {} px a second, {} px in all",
            Decimal::thousandths(after.0),
            Decimal::thousandths(rate.0),
            Decimal::thousandths(total.0)
        ),
    };
    [
        (
            "touch",
            format!(
                "from {} mN on, until below {} mN",
                Decimal::thousandths(contact.begins.0),
                Decimal::thousandths(contact.ends.0)
            ),
        ),
        (
            "slip",
            format!(
                "{} µm within {} ms, from {} of the normal force on",
                slip.distance.0,
                slip.within.0,
                Decimal::thousandths(slip.ratio.0)
            ),
        ),
        ("filter", filter_text(*filter)),
        ("rezero", rezero),
        ("creep", creep_text(creep)),
        ("output", output_text(*output)),
    ]
}

fn output_text(output: Output) -> String {
    match output {
        Output::Off => "off: its pin stays low".to_owned(),
        Output::Contact => "high while something touches the film".to_owned(),
        Output::Slip => "high while the contact slips".to_owned(),
        Output::Force { limit } => format!(
            "high from {} mN on, until a tenth below",
            Decimal::thousandths(limit.0)
        ),
    }
}

fn creep_text(creep: &Creep) -> String {
    if !creep.is_measured() {
        return "not measured: uncertain as silicones differ".to_owned();
    }
    let [first, second] = creep.parts.map(|part| Decimal::thousandths(part.0));
    let [short, long] = Creep::TIMES.map(|time| Decimal::thousandths(time.0));
    format!("{first} of a force within {short} s, {second} within {long} s")
}

/// A change; `None` keeps a value.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// A change of [`ContactLimits`].
    Touch {
        /// The force with which a contact begins.
        begins: Option<UnsignedMicroNewtons>,
        /// The force below which it ends.
        ends: Option<UnsignedMicroNewtons>,
    },
    /// A change of [`SlipLimits`].
    Slip {
        /// Distance that the place moves.
        distance: Option<Micrometres>,
        /// Longest time for it.
        within: Option<Milliseconds>,
        /// Least ratio of forces.
        ratio: Option<Permille>,
    },
    /// The new filter.
    Filter(Filter),
    /// The new re-zeroing; `None` switches it off. A missing value stays, or gets its default.
    Rezero(Option<RezeroChange>),
    /// The new [`Creep`].
    Creep(Creep),
    /// The new [`Output`].
    Output(Output),
}

/// A change of [`Rezero`].
#[derive(Clone, Copy, Debug)]
pub struct RezeroChange {
    /// Time without a touch.
    pub after: Option<Milliseconds>,
    /// Distance in a second.
    pub rate: Option<MilliPx>,
    /// Distance in total.
    pub total: Option<MilliPx>,
}

impl Change {
    /// The settings with this change.
    pub fn of(self, mut settings: TemporalSettings) -> TemporalSettings {
        let TemporalSettings { contact, slip, .. } = &mut settings;
        match self {
            Change::Touch { begins, ends } => {
                contact.begins = begins.unwrap_or(contact.begins);
                contact.ends = ends.unwrap_or(contact.ends);
            }
            Change::Slip {
                distance,
                within,
                ratio,
            } => {
                slip.distance = distance.unwrap_or(slip.distance);
                slip.within = within.unwrap_or(slip.within);
                slip.ratio = ratio.unwrap_or(slip.ratio);
            }
            Change::Creep(creep) => settings.creep = creep,
            Change::Output(output) => settings.output = output,
            Change::Filter(filter) => settings.filter = filter,
            Change::Rezero(change) => {
                let before = settings.rezero.unwrap_or_default();
                settings.rezero = change.map(|change| Rezero {
                    after: change.after.unwrap_or(before.after),
                    rate: change.rate.unwrap_or(before.rate),
                    total: change.total.unwrap_or(before.total),
                });
            }
        }
        settings
    }

    /// The name of the changed setting, as in [`texts`].
    pub fn name(self) -> &'static str {
        match self {
            Change::Touch { .. } => "touch",
            Change::Slip { .. } => "slip",
            Change::Filter(_) => "filter",
            Change::Rezero(_) => "rezero",
            Change::Creep(_) => "creep",
            Change::Output(_) => "output",
        }
    }
}

/// Reads a number with up to three decimals, in thousandths.
///
/// # Errors
/// When it is not a number, below 0, or too large.
pub fn thousandths(text: &str) -> Result<u32, String> {
    let number: f64 = text.parse().map_err(|_| "it is no number".to_owned())?;
    let scaled = number * 1e3;
    // The margin covers decimals that binary numbers cannot represent.
    if (scaled - scaled.round()).abs() > 1e-6 * scaled.abs().max(1.0) {
        return Err("it has more than three decimals".to_owned());
    }
    match (0.0..=f64::from(u32::MAX)).contains(&scaled) {
        true => Ok(scaled.round() as u32),
        false => Err("it is out of range".to_owned()),
    }
}

/// Reads a small number with up to three decimals, in thousandths.
///
/// # Errors
/// As [`thousandths`].
pub fn small_thousandths(text: &str) -> Result<u16, String> {
    u16::try_from(thousandths(text)?).map_err(|_| "it is out of range".to_owned())
}

/// Reads two numbers with a comma between them, each in thousandths.
///
/// # Errors
/// As [`thousandths`], or when there are not exactly two.
pub fn two_thousandths(text: &str) -> Result<[u8; 2], String> {
    let (one, other) = text
        .split_once(',')
        .ok_or("use two numbers, such as 0.03,0.04")?;
    let number = |text| {
        let number = thousandths(text)?;
        u8::try_from(number).map_err(|_| "it is out of range".to_owned())
    };
    Ok([number(one)?, number(other)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unusual() -> TemporalSettings {
        let change = RezeroChange {
            after: None,
            rate: Some(MilliPx(7)),
            total: None,
        };
        let changes = [
            Change::Touch {
                begins: Some(UnsignedMicroNewtons(3_500)),
                ends: None,
            },
            Change::Slip {
                distance: None,
                within: Some(Milliseconds(30)),
                ratio: None,
            },
            Change::Filter(Filter::LowPass {
                time_constant: Milliseconds(20),
            }),
            Change::Rezero(Some(change)),
            Change::Creep(Creep {
                parts: [SmallPermille(31), SmallPermille(42)],
            }),
            Change::Output(Output::Force {
                limit: UnsignedMicroNewtons(200_000),
            }),
        ];
        let usual = TemporalSettings::default();
        changes
            .into_iter()
            .fold(usual, |all, change| change.of(all))
    }

    #[test]
    fn only_what_is_given_changes() {
        let settings = unusual();
        let usual = TemporalSettings::default();
        assert_eq!(settings.contact.begins, UnsignedMicroNewtons(3_500));
        assert_eq!(settings.contact.ends, usual.contact.ends);
        assert_eq!(settings.slip.within, Milliseconds(30));
        assert_eq!(settings.slip.distance, usual.slip.distance);
        let rezero = settings.rezero.unwrap();
        assert_eq!(
            (rezero.rate, rezero.total),
            (MilliPx(7), Rezero::default().total)
        );
        assert_eq!(Change::Rezero(None).of(settings).rezero, None);
    }

    #[test]
    fn a_person_reads_units() {
        let [touch, slip, filter, rezero, creep, output] = texts(&unusual()).map(|(_, text)| text);
        assert_eq!(touch, "from 3.500 mN on, until below 1.000 mN");
        assert_eq!(
            slip,
            "60 µm within 30 ms, from 0.100 of the normal force on"
        );
        assert_eq!(
            filter,
            "low-pass of 20 ms: a steady change comes 20 ms later"
        );
        let expected = "after 10.000 s without a contact, by 0.007 px a second, 0.200 px in all";
        assert_eq!(rezero, expected);
        let expected = "0.031 of a force within 0.500 s, 0.042 within 20.000 s";
        assert_eq!(creep, expected);
        assert_eq!(output, "high from 200.000 mN on, until a tenth below");
    }

    #[test]
    fn numbers_have_three_decimals() {
        for (text, expected) in [("2", 2_000), ("0.3", 300), ("0.001", 1), ("0", 0)] {
            assert_eq!(thousandths(text), Ok(expected));
        }
        for text in ["0.0001", "-1", "nan", "inf", "1e9", "", "2 mN"] {
            assert!(thousandths(text).is_err(), "{text}");
        }
        assert!(small_thousandths("66").is_err());
        assert_eq!(two_thousandths("0.03,0.2"), Ok([30, 200]));
        for text in ["0.03", "0.03,", "0.03,0.3", "0.1,0.2,0.3"] {
            assert!(two_thousandths(text).is_err(), "{text}");
        }
    }
}
