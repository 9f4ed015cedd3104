//! Where the markers' images go under a load, with the slopes of that.
//!
//! One table serves all four markers and both directions: mirroring the film at its axes puts every
//! marker into the lower right corner, and mirroring it at the diagonal makes of what moves along x
//! what moves along y. What one unit has beside that is in tables of its own, without mirrors.

use super::pose::Pose;
use super::solve::{Column, EQUATIONS, UNKNOWNS};
use super::table::{Answer, Load, Place, Sums, Table};
use super::terms::{Limits, Sizes, Tilts};

/// Signs of x and y of markers 0–3.
pub const CORNERS: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Positions along x and y for each marker.
pub type Markers = [[f32; 2]; 4];

/// The film's tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tables<'a> {
    /// How the image of marker 2 moves along x, in focal lengths.
    pub moved: Table<'a>,
    /// How that changes when marker and tip are both farther along x or along y, in focal lengths
    /// per mm: less, and more evenly, than when the marker alone is, which near the tip moves quite
    /// otherwise a little beside.
    pub beside: Table<'a>,
    /// What this unit's images move more: x and y of markers 0–3, in focal lengths.
    pub own: Option<Table<'a>>,
}

/// Where the images go.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prediction {
    /// x and y of markers 0–3, in focal lengths.
    pub moved: Column,
    /// Slopes by size, tilt along x and y (1/rad), place along x and y (1/mm).
    pub slopes: [Column; UNKNOWNS],
}

impl Tables<'_> {
    /// Where the images of markers go that are glued `beside_mm` of their places.
    pub fn predict(&self, pose: &Pose, limits: &Limits, beside_mm: &Markers) -> Prediction {
        let sizes = Sizes::at(pose.size, limits);
        let [x, y] = pose.tilt;
        let tilts = [[x, y], [y, x]].map(|tilt| Tilts::at(tilt, limits));
        let mut prediction = Prediction::default();
        let mut sums = Sums::new();
        for (marker, corner) in CORNERS.into_iter().enumerate() {
            let beside_mm = beside_mm[marker];
            // The place beside which a marker in its place would be as far from the tip.
            let place_mm = [0, 1].map(|i| corner[i] * (pose.place_mm[i] - beside_mm[i]));
            let is_beside = beside_mm != [0.0; 2];
            let at = place(&self.moved, place_mm);
            let beside_at = is_beside.then(|| place(&self.beside, place_mm));
            for axis in [0, 1] {
                let reflection = Reflection { corner, axis };
                let load = Load {
                    sizes: &sizes,
                    tilts: &tilts[axis].mirrored(reflection.signs()),
                };
                let mut answer = self
                    .moved
                    .answer(0, &reflection.swapped(at), &load, &mut sums);
                if let Some(at) = beside_at {
                    let at = reflection.swapped(at);
                    for (output, part) in reflection.vector(beside_mm).into_iter().enumerate() {
                        answer.value += part * self.beside.value(output, &at, &load, &mut sums);
                    }
                }
                prediction.set(2 * marker + axis, &reflection.back(&answer));
            }
        }
        if let Some(own) = &self.own {
            let at = place(own, pose.place_mm);
            let load = Load {
                sizes: &sizes,
                tilts: &tilts[0],
            };
            for (k, moved) in prediction.moved.iter_mut().enumerate() {
                *moved += own.value(k, &at, &load, &mut sums);
            }
        }
        prediction
    }
}

impl Prediction {
    fn set(&mut self, equation: usize, answer: &Answer) {
        debug_assert!(equation < EQUATIONS);
        self.moved[equation] = answer.value;
        for (column, slope) in self.slopes.iter_mut().zip(answer.slopes) {
            column[equation] = slope;
        }
    }
}

/// The reflection in which a marker is in the lower right corner, and moves along x where it moves
/// along `axis`.
struct Reflection {
    corner: [f32; 2],
    axis: usize,
}

impl Reflection {
    /// A vector along the film, reflected; and a reflected one, as it is.
    fn vector(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sx, sy] = self.corner;
        match self.axis {
            0 => [sx * x, sy * y],
            _ => [sy * y, sx * x],
        }
    }

    /// The signs of what is reflected.
    fn signs(&self) -> [f32; 2] {
        let [sx, sy] = self.corner;
        match self.axis {
            0 => [sx, sy],
            _ => [sy, sx],
        }
    }

    /// A place, reflected into the lower right corner.
    fn swapped(&self, place: Place) -> Place {
        match self.axis {
            0 => place,
            _ => Place {
                x: place.y,
                y: place.x,
            },
        }
    }

    /// What was reflected, as it is.
    fn back(&self, reflected: &Answer) -> Answer {
        let sign = self.corner[self.axis];
        let [size, a, b, x, y] = reflected.slopes;
        let along = |[a, b]: [f32; 2]| {
            let [sx, sy] = self.corner;
            match self.axis {
                0 => [sign * sx * a, sign * sy * b],
                _ => [sign * sx * b, sign * sy * a],
            }
        };
        let ([a, b], [x, y]) = (along([a, b]), along([x, y]));
        Answer {
            value: sign * reflected.value,
            slopes: [sign * size, a, b, x, y],
        }
    }
}

fn place(table: &Table<'_>, [x, y]: [f32; 2]) -> Place {
    Place {
        x: table.axis().at(x),
        y: table.axis().at(y),
    }
}
