//! A press of the page on a simulated film, and the true press in each of its frames.

use serde::Serialize;

/// A press by the page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// The place, mm along x and y from the film's middle.
    pub place_mm: [f64; 2],
    /// |F|, N.
    pub force_n: f64,
    /// α and β, degrees.
    pub angles_deg: [f64; 2],
}

/// The press of each of two fingers; `None` releases the film.
pub type Fingers = [Option<Press>; 2];

/// Presses a simulated film.
pub type Hand = Box<dyn Fn(Fingers) + Send + Sync>;

/// The true press in a frame: number of the frame; then Fx, Fy, Fz and |F|, µN; α and β,
/// thousandths of a degree; and the place, µm along x and y, or `None` without a press.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Truth(pub u32, pub [i64; 4], pub [i64; 2], pub Option<[i64; 2]>);
