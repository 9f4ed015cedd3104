//! Checks the colours: the camera's levels for white.

use super::report::Step;
use hivtac_host::frame::Frame;
use hivtac_host::look;
use serde_json::json;

/// Largest saturation of white, of 255: half of the usual threshold's for a marker.
const LARGEST_SATURATION: f64 = 50.0;
/// Range of white's brightness, of 255. Below, markers are too dark; above, levels are not
/// proportional to light.
pub const BRIGHTNESS: [f64; 2] = [60.0, 247.0];
/// Part of each side of the picture, around its middle, that is measured; it lies between the
/// markers.
const MIDDLE: f64 = 0.2;

/// The levels around a picture's middle.
pub struct Middle {
    /// Mean red, green and blue, of 255.
    pub mean: [f64; 3],
    /// Standard deviation of green, as a part of its mean.
    pub unevenness: f64,
}

impl Middle {
    /// Measures a picture.
    pub fn of(frame: &Frame) -> Middle {
        let levels = look::levels(frame);
        let (width, height) = (usize::from(frame.width), usize::from(frame.height));
        let inside = |at: usize, side: usize| {
            let off = (at as f64 + 0.5) / side as f64 - 0.5;
            off.abs() <= MIDDLE / 2.0
        };
        let pixels = levels.chunks_exact(3).enumerate();
        let near: Vec<_> = pixels
            .filter(|(index, _)| inside(index % width, width) && inside(index / width, height))
            .map(|(_, pixel)| pixel)
            .collect();
        let mean_of = |value: &dyn Fn(&[u8]) -> f64| {
            let sum: f64 = near.iter().map(|pixel| value(pixel)).sum();
            sum / near.len().max(1) as f64
        };
        let mean = [0, 1, 2].map(|channel| mean_of(&|pixel| f64::from(pixel[channel])));
        let square = mean_of(&|pixel| (f64::from(pixel[1]) - mean[1]).powi(2));
        Middle {
            mean,
            unevenness: square.sqrt() / mean[1].max(1.0),
        }
    }

    /// The level of the brightest channel, of 255.
    pub fn brightness(&self) -> f64 {
        let [red, green, blue] = self.mean;
        red.max(green).max(blue)
    }

    /// The saturation, of 255.
    pub fn saturation(&self) -> f64 {
        let [red, green, blue] = self.mean;
        let high = self.brightness();
        255.0 * (high - red.min(green).min(blue)) / high.max(1.0)
    }
}

/// Judges the middle of a picture that should be white.
pub fn step(frame: &Frame) -> Step {
    let middle = Middle::of(frame);
    let [red, green, blue] = middle.mean;
    let (high, saturation) = (middle.brightness(), middle.saturation());
    let [least, most] = BRIGHTNESS;
    let mut wrong = Vec::new();
    if high < least {
        wrong.push(format!(
            "too dark ({high:.0}, at least {least}): cap, light; then `hivtac expose`"
        ));
    }
    if high > most {
        wrong.push(format!(
            "too bright ({high:.0}, at most {most}): less light; then `hivtac expose`"
        ));
    }
    if saturation > LARGEST_SATURATION {
        wrong.push(format!(
            "white is not white (saturation {saturation:.0}, at most {LARGEST_SATURATION}): use \
             white light and a white card, and run `hivtac white`"
        ));
    }
    let found = format!("red {red:.0}, green {green:.0}, blue {blue:.0}");
    let figures = json!({ "red_green_blue": middle.mean, "saturation": saturation });
    Step::new("white", found, wrong, figures)
}
