//! The unknowns of an applied load: its differences from the stated values.

use crate::loads::SeenLoad;

/// Unknowns of a load: its force along and across the stated one (3), its place (2).
pub const UNKNOWNS: usize = 5;

/// The least standard uncertainties of a direction, rad, and of a place, mm: a stage's.
const BEST_DIRECTION_RAD: f64 = 1e-4;
const BEST_PLACE_MM: f64 = 1e-3;
/// Standard uncertainty of a place that nobody noted and that is estimated from the picture, mm.
const ROUGH_PLACE_MM: f64 = 1.5;

/// The greatest distance of a tip from the film's middle along x or y, mm.
const FARTHEST_MM: f64 = 6.0;

/// A force, N, and a place, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// The force on the film, N.
    pub force_n: [f64; 3],
    /// Where the tip touches the film, in the stage's coordinates, mm.
    pub place_mm: [f64; 2],
}

impl SeenLoad {
    /// The force and the place at these standard uncertainties from the stated values.
    pub fn at(&self, parts: &[f64; UNKNOWNS]) -> Pressed {
        let mut force_n = self.force_n;
        for (direction, part) in self.directions().iter().zip(parts) {
            for (sum, along) in force_n.iter_mut().zip(direction) {
                *sum += part * along;
            }
        }
        // A tip can only press, whatever a step asks for.
        force_n[2] = force_n[2].min(-1e-6);
        let sigma_mm = self.place_sigma_mm();
        let place = |i: usize| self.place_mm[i] + sigma_mm * parts[3 + i];
        Pressed {
            force_n,
            place_mm: [0, 1].map(|i| place(i).clamp(-FARTHEST_MM, FARTHEST_MM)),
        }
    }

    /// Change of the force, N, per standard uncertainty of each of its unknowns: along it, and in
    /// two directions across.
    pub fn directions(&self) -> [[f64; 3]; 3] {
        let size = self.magnitude_n();
        let along = self.force_n.map(|part| part / size);
        // Two unit vectors across the force, which is not along x.
        let side = along[1].hypot(along[2]);
        let first = [0.0, -along[2] / side, along[1] / side];
        let second = [
            side,
            -along[0] * along[1] / side,
            -along[0] * along[2] / side,
        ];
        let turn = size * self.direction_sigma_rad();
        [
            along.map(|part| self.size_n * part),
            first.map(|part| turn * part),
            second.map(|part| turn * part),
        ]
    }

    /// Standard uncertainty of its direction, each way, rad, > 0.
    pub fn direction_sigma_rad(&self) -> f64 {
        self.direction_rad.max(BEST_DIRECTION_RAD)
    }

    /// Standard uncertainty of each coordinate of its place, mm, > 0.
    pub fn place_sigma_mm(&self) -> f64 {
        match self.each_place_mm.is_finite() {
            true => self.each_place_mm.max(BEST_PLACE_MM),
            false => ROUGH_PLACE_MM,
        }
    }
}
