//! Finds lamps that the film mirrors.

use crate::frame::Frame;
use crate::look;

/// Least level of all channels in a lamp's reflection, of 255: RGB565's last.
const WHITE: u8 = 250;
/// Fewest pixels of a reflection; a marker has 170 at 320 × 240.
const FEWEST: usize = 8;
/// Largest part of the picture that is a reflection, and no film that is too bright.
const LARGEST_PART: f64 = 0.05;

/// The remedy for the reflections in a picture; `None` without any.
pub fn advice(frame: &Frame) -> Option<String> {
    let levels = look::levels(frame);
    let pixels = levels.chunks_exact(3).enumerate();
    let white: Vec<usize> = pixels
        .filter(|(_, pixel)| pixel.iter().all(|level| *level >= WHITE))
        .map(|(index, _)| index)
        .collect();
    let most = LARGEST_PART * f64::from(frame.width) * f64::from(frame.height);
    let first = *white.first()?;
    let (x, y) = (
        first % usize::from(frame.width),
        first / usize::from(frame.width),
    );
    let is_some = white.len() >= FEWEST && white.len() as f64 <= most;
    is_some.then(|| {
        format!(
            "glare: {} px are white, the first at ({x}, {y}): the film mirrors a lamp; switch the \
             camera board's LEDs off, put a diffuser over the lamp, or take a matt film",
            white.len()
        )
    })
}
