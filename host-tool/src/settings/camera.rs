//! Exposure, gain and rate of the camera as JSON, as lines, and as changes by `settings set`.

use super::temporal::thousandths;
use hivtac_terms::camera::{CameraSettings, LEAST_GAIN, MOST_GAIN, Rate, White};
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::settings::CameraReport;
use serde::{Deserialize, Serialize};

/// [`CameraSettings`] as JSON, in whole numbers of the device's units; null where the camera adapts
/// to the light. Unchecked.
#[derive(Serialize, Deserialize)]
#[serde(remote = "CameraSettings", deny_unknown_fields)]
pub struct CameraJson {
    #[serde(default, rename = "exposure_us")]
    exposure: Option<Microseconds>,
    #[serde(default, rename = "gain_sixteenths")]
    gain: Option<Sixteenths>,
    #[serde(with = "RateJson")]
    rate: Rate,
    /// Null for gains in the middle of the maker's presets.
    #[serde(default, with = "optional_white")]
    white: Option<White>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "White", deny_unknown_fields)]
struct WhiteJson {
    #[serde(rename = "red_64ths")]
    red: u8,
    #[serde(rename = "blue_64ths")]
    blue: u8,
}

optional_json!(optional_white, White, "super::WhiteJson");

#[derive(Serialize, Deserialize)]
#[serde(remote = "Rate", rename_all = "kebab-case")]
enum RateJson {
    Full,
    Half,
    Quarter,
}

/// The camera's values in use.
#[derive(Serialize)]
pub struct InUse {
    exposure_us: u32,
    gain_sixteenths: Sixteenths,
    frames_per_second: u16,
}

impl InUse {
    /// From a device's report.
    pub fn new(report: &CameraReport) -> InUse {
        InUse {
            exposure_us: report.exposure.0,
            gain_sixteenths: report.gain,
            frames_per_second: frames_per_second(report),
        }
    }
}

fn frames_per_second(report: &CameraReport) -> u16 {
    report.limits.at(report.settings.rate).frames_per_second
}

/// Name and text of each setting, for a person.
pub fn texts(report: &CameraReport) -> Vec<(&'static str, String)> {
    let automatic = |is_automatic| {
        if is_automatic {
            ", as the light needs"
        } else {
            ""
        }
    };
    let CameraSettings { exposure, gain, .. } = report.settings;
    let [exposed, amplified] = match report.exposure {
        Microseconds(0) => ["not known before the camera answers"; 2].map(str::to_owned),
        known => [
            format!("{known} ms{}", automatic(exposure.is_none())),
            format!(
                "{}{}",
                f64::from(report.gain.0) / 16.0,
                automatic(gain.is_none())
            ),
        ],
    };
    let rate = format!("{} frames a second", frames_per_second(report));
    let white = report.settings.white;
    let white = white.map(|white| ("white", white.to_string()));
    let texts = [("exposure", exposed), ("gain", amplified), ("rate", rate)];
    texts.into_iter().chain(white).collect()
}

/// A change of one setting.
#[derive(Clone, Copy, Debug)]
pub enum Change {
    /// The exposure of each row.
    Exposure(Wanted<Microseconds>),
    /// The gain.
    Gain(Wanted<Sixteenths>),
    /// Frames a second.
    Rate(u16),
}

/// A value; `None` to adapt to the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted<T>(Option<T>);

impl Change {
    /// The device's settings with this change.
    ///
    /// # Errors
    /// Why the camera does not support it.
    pub fn of(self, report: &CameraReport) -> Result<CameraSettings, String> {
        let mut settings = report.settings;
        match self {
            Change::Exposure(Wanted(exposure)) => settings.exposure = exposure,
            Change::Gain(Wanted(gain)) => settings.gain = gain,
            Change::Rate(frames_per_second) => {
                let limits = report.limits;
                let sends = |rate: &Rate| limits.at(*rate).frames_per_second == frames_per_second;
                settings.rate = Rate::ALL.into_iter().find(sends).ok_or_else(|| {
                    let [full, half, quarter] =
                        Rate::ALL.map(|rate| limits.at(rate).frames_per_second);
                    format!("the camera sends {full}, {half} or {quarter} frames a second")
                })?;
            }
        }
        let checked = report.limits.check(&settings);
        checked.map_err(|error| error.to_string())?;
        Ok(settings)
    }

    /// The name of the changed setting, as in [`texts`].
    pub fn name(self) -> &'static str {
        match self {
            Change::Exposure(_) => "exposure",
            Change::Gain(_) => "gain",
            Change::Rate(_) => "rate",
        }
    }
}

const AUTOMATIC: &str = "auto";

/// Reads an exposure, ms, or `auto`.
///
/// # Errors
/// When it is neither of them.
pub fn exposure(text: &str) -> Result<Wanted<Microseconds>, String> {
    match text {
        AUTOMATIC => Ok(Wanted(None)),
        _ => Ok(Wanted(Some(Microseconds(thousandths(text)?)))),
    }
}

/// Reads a gain, or `auto`; rounds it to the nearest sixteenth.
///
/// # Errors
/// When it is neither of them, or out of range.
pub fn gain(text: &str) -> Result<Wanted<Sixteenths>, String> {
    if text == AUTOMATIC {
        return Ok(Wanted(None));
    }
    let number: f64 = text.parse().map_err(|_| "it is no number".to_owned())?;
    let sixteenths = (number * 16.0).round();
    let [least, most] = [LEAST_GAIN, MOST_GAIN].map(|gain| f64::from(gain.0));
    match (least..=most).contains(&sixteenths) {
        true => Ok(Wanted(Some(Sixteenths(sixteenths as u16)))),
        false => Err(format!("a gain is {} to {}", least / 16.0, most / 16.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::camera::{CameraLimits, RateLimits};

    fn report(settings: CameraSettings) -> CameraReport {
        CameraReport {
            settings,
            exposure: Microseconds(2_512),
            gain: Sixteenths(24),
            limits: CameraLimits([
                RateLimits::new(156, [24, 6_405].map(Microseconds)),
                RateLimits::new(78, [47, 12_810].map(Microseconds)),
                RateLimits::new(39, [93, 25_620].map(Microseconds)),
            ]),
        }
    }

    #[test]
    fn what_the_camera_cannot_do_says_what_it_can() {
        let now = report(CameraSettings::default());
        let long = Change::Exposure(exposure("12").unwrap());
        let error = long.of(&now).unwrap_err();
        assert_eq!(
            error,
            "at 156 frames a second an exposure is 0.024 to 6.405 ms"
        );
        let error = Change::Rate(100).of(&now).unwrap_err();
        assert_eq!(error, "the camera sends 156, 78 or 39 frames a second");
        let half = Change::Rate(78).of(&now).unwrap();
        assert_eq!(half.rate, Rate::Half);
        let set = long.of(&report(half)).unwrap();
        assert_eq!(set.exposure, Some(Microseconds(12_000)));
        // The full rate has no time for this exposure.
        assert!(Change::Rate(156).of(&report(set)).is_err());
        let automatic = Change::Exposure(exposure("auto").unwrap());
        assert_eq!(automatic.of(&report(set)).unwrap().exposure, None);
    }

    #[test]
    fn a_person_reads_what_is_in_use_and_who_chose_it() {
        let settings = CameraSettings {
            exposure: Some(Microseconds(2_500)),
            ..CameraSettings::default()
        };
        let text = |report: &CameraReport| -> Vec<String> {
            texts(report).into_iter().map(|(_, text)| text).collect()
        };
        let expected = ["2.512 ms", "1.5, as the light needs", "156 frames a second"];
        assert_eq!(text(&report(settings)), expected);
        let white = CameraSettings {
            white: Some(White { red: 76, blue: 132 }),
            ..settings
        };
        assert_eq!(text(&report(white))[3], "red 1.19, blue 2.06");
        let unknown = CameraReport {
            exposure: Microseconds(0),
            ..report(settings)
        };
        assert_eq!(text(&unknown)[1], "not known before the camera answers");
    }

    #[test]
    fn gains_are_sixteenths_from_1_to_4() {
        assert_eq!(gain("1.5"), Ok(Wanted(Some(Sixteenths(24)))));
        assert_eq!(gain("4"), Ok(Wanted(Some(Sixteenths(64)))));
        assert_eq!(gain("auto"), Ok(Wanted(None)));
        for bad in ["0.9", "4.1", "nan", "", "x"] {
            assert!(gain(bad).is_err(), "{bad}");
        }
    }
}
