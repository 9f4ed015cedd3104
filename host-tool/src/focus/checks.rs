//! Checks a picture before its forces can be used: each check has a limit, the limit's reason, and
//! advice.
//!
//! `docs/building-a-sensor.md` has the same limits for a builder.

use super::dots::Dots;
use super::seen::{Marker, NotSeen, Seen};
use crate::frame::Frame;
use hivtac_terms::threshold::Threshold;
use serde::Serialize;

/// Widest rim, px. A sharp lens has a rim of 1.3. One that blurs every point by a pixel (standard
/// deviation) has 3, by two pixels 5.3. Of the simulated sensor's hard cases, all frames are
/// accepted at one pixel and most are refused at two (`docs/results/hard-cases.md`, blur-1 and
/// blur-2).
const RIM_PX: f64 = 3.5;
/// Widest rim in YUV422, where two pixels share a colour, px.
const RIM_OF_PAIRS_PX: f64 = 4.0;
/// Largest relative difference of a marker's width from the one that the optics give. It is half of
/// the sensing's limit; the other half is for threshold and light.
const WIDTH_PART: f64 = 0.19;
/// Least margin of a marker's colour above its threshold, in levels. It is eight standard
/// deviations (2.5 levels each) of the simulated camera's noise, which keeps every pixel inside a
/// marker.
const COLOUR_MARGIN: f64 = 20.0;
/// Value of the darkest marker, as a multiple of the threshold's lowest value. At half of that
/// light a marker loses two thirds of its mask and, without a warning, its place.
pub const DARKEST_VALUES: f64 = 2.0;
/// Brightest level: RGB565's last but one. Beyond it, levels are not proportional to light, and
/// rims are weighed by levels.
const BRIGHTEST: f64 = 247.0;
/// Largest distance of the pattern's middle from the picture's, px, and largest turn, degrees. Both
/// are three standard deviations of the units for which calibration was shown to compensate
/// (`docs/results/units.md`).
const SHIFT_PX: f64 = 9.0;
/// See [`SHIFT_PX`].
const TURN_DEG: f64 = 6.0;
/// Largest relative difference of the pattern's size from the geometry's; a tare is refused beyond.
const SIZE_PART: f64 = 0.15;

/// One condition of a good picture.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Its name: `rim`, `width`, `colour`, `brightness`, `film`, `centre`, `turn`, `size`.
    pub what: &'static str,
    /// Its marker; `None` for the whole pattern.
    pub marker: Option<usize>,
    /// Its value; `None` if it cannot be measured.
    pub value: Option<f64>,
    /// Its least value.
    pub least: Option<f64>,
    /// Its largest value.
    pub most: Option<f64>,
    /// The unit of value, least and most.
    pub unit: &'static str,
    /// Whether it is fulfilled.
    pub right: bool,
    /// The remedy; empty if it is fulfilled.
    pub advice: String,
}

impl Check {
    fn new(
        what: &'static str,
        marker: Option<usize>,
        value: Option<f64>,
        [least, most]: [Option<f64>; 2],
        unit: &'static str,
    ) -> Check {
        let within = |value: f64| {
            least.is_none_or(|least| value >= least) && most.is_none_or(|most| value <= most)
        };
        Check {
            what,
            marker,
            value,
            least,
            most,
            unit,
            right: value.is_some_and(within),
            advice: String::new(),
        }
    }

    /// Adds advice for a value that is too small, and for one that is too large.
    fn or(mut self, too_little: &str, too_much: &str) -> Check {
        let little = self
            .value
            .zip(self.least)
            .is_none_or(|(value, least)| value < least);
        self.advice = match (self.right, little && self.least.is_some()) {
            (true, _) => String::new(),
            (false, true) => too_little.to_owned(),
            (false, false) => too_much.to_owned(),
        };
        self
    }
}

/// All checks of a frame: four of each marker, one of the film around it, three of the pattern.
pub fn checks(frame: &Frame, seen: &Seen) -> Vec<Check> {
    let markers = (0..).zip(&seen.markers);
    let mut checks: Vec<Check> = markers
        .flat_map(|(id, marker)| of_marker(frame, id, marker))
        .collect();
    checks.extend([of_place(seen), of_turn(seen), of_size(seen)]);
    checks
}

/// Advice about a picture that does not show all markers.
pub fn advice(not_seen: &NotSeen) -> String {
    let NotSeen {
        dots,
        blobs,
        status,
    } = not_seen;
    let (wanted, pattern) = match dots {
        Dots::Four => (dots.in_words(), "on a square"),
        Dots::EightV => (dots.in_words(), "as those of 8v"),
    };
    let why = status.join(" ");
    match blobs {
        0 => format!(
            "no marker is seen ({why}): take the cap off the lens, switch the light on, and look \
             with `hivtac snapshot`"
        ),
        few if *few < dots.count() => format!(
            "{blobs} of {wanted} markers are seen ({why}): turn or move the camera until all are in \
             the picture, and light all of them"
        ),
        _ => format!(
            "no {wanted} of {blobs} things of the markers' colour lie {pattern} ({why}): take what \
             else is red out of view"
        ),
    }
}

fn of_marker(frame: &Frame, id: usize, marker: &Marker) -> [Check; 5] {
    let id = Some(id);
    let rim = marker.edge.map(|edge| edge.rim_px);
    let most = match frame.threshold {
        Threshold::Yuv422(_) => RIM_OF_PAIRS_PX,
        _ => RIM_PX,
    };
    let width = marker.edge.map(|edge| edge.diameter_px);
    let widths = [1.0 - WIDTH_PART, 1.0 + WIDTH_PART];
    let widths = widths.map(|part| Some(part * marker.expected_px));
    let film = marker.film.into_iter().reduce(f64::max);
    [
        Check::new("rim", id, rim, [None, Some(most)], "px")
            .or("", "turn the lens until it is sharp"),
        Check::new("width", id, width, widths, "px").or(
            "the dot is too small, or the film too far from the lens",
            "the dot is too large, or the film too near to the lens",
        ),
        of_colour(frame, id, marker),
        of_brightness(frame, id, marker),
        Check::new("film", id, film, [None, Some(BRIGHTEST)], "").or(
            "",
            "the film is too bright there: less light, or spread it, then `hivtac expose`",
        ),
    ]
}

/// Checks a marker's colour in the threshold's quantity: saturation, Cr or luma.
fn of_colour(frame: &Frame, id: Option<usize>, marker: &Marker) -> Check {
    let [red, green, blue] = marker.colour;
    let high = red.max(green).max(blue);
    let (value, limits) = match frame.threshold {
        Threshold::Rgb565(it) => {
            let saturation = 255.0 * (high - red.min(green).min(blue)) / high.max(1.0);
            let least = f64::from(it.saturation_low) + COLOUR_MARGIN;
            (saturation, [Some(least), None])
        }
        Threshold::Yuv422(it) => {
            let cr = 128.0 + 0.5 * red - 0.419 * green - 0.081 * blue;
            (cr, [Some(f64::from(it.cr_low) + COLOUR_MARGIN), None])
        }
        Threshold::Mono(it) => {
            let above = |low: u8| (low > 0).then_some(f64::from(low) + COLOUR_MARGIN);
            let below = |high: u8| (high < 255).then_some(f64::from(high) - COLOUR_MARGIN);
            (red, [above(it.low), below(it.high)])
        }
    };
    Check::new("colour", id, Some(value), limits, "").or(
        "the dot is too pale: use a stronger red, white light, and no light from outside",
        "the dot is too pale: use a darker one, and no light from outside",
    )
}

fn of_brightness(frame: &Frame, id: Option<usize>, marker: &Marker) -> Check {
    let value = marker.colour.into_iter().reduce(f64::max);
    let least = match frame.threshold {
        Threshold::Rgb565(it) => Some(DARKEST_VALUES * f64::from(it.value_low)),
        Threshold::Yuv422(_) | Threshold::Mono(_) => None,
    };
    Check::new("brightness", id, value, [least, Some(BRIGHTEST)], "").or(
        "too dark: more light, then `hivtac expose`",
        "too bright: less light, then `hivtac expose`",
    )
}

fn of_place(seen: &Seen) -> Check {
    let [right, down] = seen.shift_px;
    let check = Check::new(
        "centre",
        None,
        Some(right.hypot(down)),
        [None, Some(SHIFT_PX)],
        "px",
    );
    let side = if right > 0.0 { "right" } else { "left" };
    let height = if down > 0.0 { "below" } else { "above" };
    let advice = format!(
        "the pattern is {:.0} px to the {side} of the picture's middle and {:.0} px {height} it: \
         move the camera or the film",
        right.abs(),
        down.abs()
    );
    check.or("", &advice)
}

fn of_turn(seen: &Seen) -> Check {
    let limits = [Some(-TURN_DEG), Some(TURN_DEG)];
    let check = Check::new("turn", None, Some(seen.turn_deg), limits, "°");
    check.or(
        "turn the camera counter-clockwise, seen from behind it",
        "turn the camera clockwise, seen from behind it",
    )
}

fn of_size(seen: &Seen) -> Check {
    let limits = [Some(1.0 - SIZE_PART), Some(1.0 + SIZE_PART)];
    Check::new("size", None, Some(seen.size), limits, "times the nominal").or(
        "the film is too far from the lens, or the dots too near to each other",
        "the film is too near to the lens or pressed, or the dots too far from each other",
    )
}
