//! `hivtac white`: finds the camera's gains with which a white card is white, and keeps them.

use crate::bring_up::colours::{BRIGHTNESS, Middle};
use crate::device::Target;
use crate::output;
use crate::request::{keep, set_camera};
use crate::settings::ask;
use crate::snapshot::snapshot;
use clap::Args;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_terms::camera::{CameraSettings, White};
use hivtac_terms::threshold::PixelFormat;
use hivtac_wire::settings::Selection;
use serde_json::json;
use std::ops::RangeInclusive;
use std::time::Duration;

/// Pictures until the gains must be found.
const ROUNDS: usize = 6;
/// Saturation, of 255, below which a card is white: a step and a half of RGB565's red and blue.
const WHITE_ENOUGH: f64 = 12.0;
/// The camera's colour matrix raises the ratio of a colour to green to a power of 1.1 (blue) to 1.4
/// (red). This is about its inverse.
const EXPONENT: f64 = 0.75;
/// Gains of red and blue, 64ths, for which white light asks. The maker's presets, for light from
/// the sun to a lamp at home, have 64 to 96 and 88 to 150.
const REDS: RangeInclusive<f64> = 64.0..=128.0;
const BLUES: RangeInclusive<f64> = 64.0..=192.0;
/// Changes of a colour's part of green below this are noise. Gains change while the card is not
/// white: by a twentieth and more.
const UNCHANGED: f64 = 0.004;
/// Largest standard deviation of an even surface's brightness, as a part of it.
const MOST_UNEVEN: f64 = 0.1;

/// Make white white: fit the camera's gains of red and blue to a white card, and keep them
///
/// Hold a white card where the film is; the picture's middle counts. A camera without colours and
/// anything but a white card are refused, and the settings stay as they were. Afterwards put the
/// film back.
///
/// Example: hivtac white
#[derive(Args)]
pub struct WhiteArguments {
    #[command(flatten)]
    target: Target,
}

/// Fits the gains to a white card, and keeps them.
///
/// # Errors
/// [`Kind::NotRight`] when the picture's middle is no white card; those of the link.
pub fn run(arguments: &WhiteArguments) -> Result<(), Failure> {
    let Target { device, json } = &arguments.target;
    let (mut link, hello) = device.connect()?;
    if hello.threshold.format() == PixelFormat::Mono {
        let text = "this sensor's camera sees no colours: it has no white to set";
        return Err(Failure::new(Kind::Refused, text));
    }
    let before = ask(&mut link, device.timeout)?.camera.settings;
    let found = find(&mut link, device.timeout, before);
    if found.is_err() {
        set_camera(&mut link, before, device.timeout)?;
    }
    let white = found?;
    let selection = Selection {
        camera: true,
        ..Selection::NONE
    };
    keep(&mut link, selection)?;
    let line = format!(
        "white set and kept: {white}; put the film back, then `hivtac expose` and a new tare"
    );
    let object = json!({
        "red_64ths": white.red,
        "blue_64ths": white.blue,
        "kept": true,
    });
    output::tell(*json, &line, &object)
}

/// Changes the gains from picture to picture until the card is white.
fn find(link: &mut Link, patience: Duration, before: CameraSettings) -> Result<White, Failure> {
    let mut white = before.white.unwrap_or_default();
    let mut last: Option<[f64; 3]> = None;
    for _ in 0..ROUNDS {
        let settings = CameraSettings {
            white: Some(white),
            ..before
        };
        set_camera(link, settings, patience)?;
        let middle = Middle::of(&snapshot(link, patience)?.frame);
        let colours = middle.mean.map(|level| level / middle.mean[1].max(1.0));
        if last.is_some_and(|last| are_alike(last, colours)) {
            let text = "the gains change nothing in the picture: this camera, such as a twin's, \
                        has none";
            return Err(Failure::new(Kind::Refused, text));
        }
        last = Some(colours);
        match next(&middle, white).map_err(|what| refuse(&middle, &what))? {
            None => return Ok(white),
            Some(next) => white = next,
        }
    }
    let text = format!("the card was not white after {ROUNDS} pictures: does the light change?");
    Err(Failure::new(Kind::NotRight, text))
}

/// Whether colours, relative to green, differ by less than any change of the gains makes.
fn are_alike(these: [f64; 3], others: [f64; 3]) -> bool {
    let pairs = these.into_iter().zip(others);
    pairs
        .into_iter()
        .all(|(this, other)| (this - other).abs() < UNCHANGED)
}

fn refuse(middle: &Middle, what: &str) -> Failure {
    let [red, green, blue] = middle.mean;
    let text = format!(
        "no white card in the picture's middle: {what} (red {red:.0}, green {green:.0}, blue \
         {blue:.0} of 255); nothing was changed"
    );
    Failure::new(Kind::NotRight, text)
}

/// The gains to try next; `None` if those in use make the card white.
///
/// # Errors The text describes the picture instead of a white card.
fn next(middle: &Middle, white: White) -> Result<Option<White>, String> {
    let [red, green, blue] = middle.mean.map(|level| level.max(1.0));
    let [least, most] = BRIGHTNESS;
    if middle.brightness() < least {
        return Err("it is dark; more light, or a card that is closer".to_owned());
    }
    let wanted = |gain: u8, level: f64| f64::from(gain) * (green / level).powf(EXPONENT);
    let [red, blue] = [wanted(white.red, red), wanted(white.blue, blue)];
    let colour = match () {
        () if red > *REDS.end() && blue > *BLUES.end() => Some("green"),
        () if red < *REDS.start() && blue < *BLUES.start() => Some("purple"),
        () if red < *REDS.start() => Some("red"),
        () if blue < *BLUES.start() => Some("blue"),
        () if red > *REDS.end() => Some("cyan"),
        () if blue > *BLUES.end() => Some("yellow"),
        () => None,
    };
    if let Some(colour) = colour {
        return Err(format!("it is {colour}, or the light is"));
    }
    if middle.brightness() > most {
        return Err("it is too bright; less light".to_owned());
    }
    if middle.unevenness > MOST_UNEVEN {
        return Err("it is not one even surface".to_owned());
    }
    if middle.saturation() <= WHITE_ENOUGH {
        return Ok(None);
    }
    let [red, blue] = [red, blue].map(|gain| gain.round() as u8);
    Ok(Some(White { red, blue }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn middle(mean: [f64; 3]) -> Middle {
        Middle {
            mean,
            unevenness: 0.02,
        }
    }

    #[test]
    fn a_card_under_usual_light_becomes_white() {
        let start = White::default();
        assert_eq!(next(&middle([140.0, 141.0, 138.0]), start), Ok(None));
        // Office light: the start has too much red and too little blue.
        let wanted = next(&middle([150.0, 138.0, 112.0]), start)
            .unwrap()
            .unwrap();
        assert!((75..85).contains(&wanted.red), "{wanted}");
        assert!((122..132).contains(&wanted.blue), "{wanted}");
    }

    #[test]
    fn what_is_no_white_card_is_named() {
        let start = White::default();
        for (mean, word) in [
            ([200.0, 60.0, 60.0], "red"),
            ([60.0, 200.0, 60.0], "green"),
            ([90.0, 100.0, 230.0], "blue"),
            ([40.0, 41.0, 40.0], "dark"),
            ([250.0, 251.0, 250.0], "bright"),
        ] {
            let error = next(&middle(mean), start).unwrap_err();
            assert!(error.contains(word), "{mean:?}: {error}");
        }
        let uneven = Middle {
            mean: [140.0; 3],
            unevenness: 0.3,
        };
        assert!(next(&uneven, start).unwrap_err().contains("even"));
    }
}
