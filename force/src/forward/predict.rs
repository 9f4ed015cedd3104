//! Where the markers' images go under a load, with the slopes of that.
//!
//! One table serves all four markers and both directions: mirroring the film at its axes puts every
//! marker into the lower right corner, and mirroring it at the diagonal makes of what moves along x
//! what moves along y. What one unit has beside that is in tables of its own, without mirrors.

use super::pose::Pose;
use super::solve::{Column, EQUATIONS, UNKNOWNS};
use super::table::{Answer, Place, Steps, Table};
use super::terms::{Limits, Powers, Sizes, Tilts};

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

/// An output of a table.
#[derive(Clone, Copy)]
struct Output<'t>(&'t Table<'t>, usize);

impl Tables<'_> {
    /// Where the images of markers go that are glued `beside_mm` of their places.
    pub fn predict(&self, pose: &Pose, limits: &Limits, beside_mm: &Markers) -> Prediction {
        let sizes = Sizes::at(pose.size, limits);
        let [x, y] = pose.tilt.map(|part| Powers::at(part, limits));
        let tilts = [Tilts::of(&x, &y), Tilts::of(&y, &x)];
        let outputs = [(&self.moved, 0), (&self.beside, 0), (&self.beside, 1)];
        let outputs = outputs.map(|(table, output)| Output(table, output));
        let outputs = match *beside_mm == Markers::default() {
            true => outputs.get(..1).unwrap_or_default(),
            false => &outputs,
        };
        let mut prediction = Prediction::default();
        // Under the load as marker 2 has it, for what moves along x and for what moves along y.
        let mut steps: [Steps; 2] = Default::default();
        for (nth, &Output(table, output)) in outputs.iter().enumerate() {
            for (steps, tilts) in steps.iter_mut().zip(&tilts) {
                table.set(steps, output, &sizes, tilts);
            }
            let mut seen = [1.0; 2];
            for (marker, (corner, beside_mm)) in CORNERS.into_iter().zip(beside_mm).enumerate() {
                for (along, (seen, corner)) in seen.iter_mut().zip(corner).enumerate() {
                    if *seen != corner {
                        turn(table, &mut steps, along);
                        *seen = corner;
                    }
                }
                // The place beside which a marker in its place would be as far from the tip.
                let place_mm = [0, 1].map(|i| corner[i] * (pose.place_mm[i] - beside_mm[i]));
                let at = place(table, place_mm);
                for (axis, steps) in steps.iter().enumerate() {
                    let reflection = Reflection { corner, axis };
                    let answer = table.answer(output, &reflection.swapped(at), steps);
                    let equation = 2 * marker + axis;
                    let [x, y] = reflection.vector(*beside_mm);
                    // What gluing changes of the slopes is far less than they are.
                    let more = |part: f32| reflection.sign() * part * answer.value;
                    match nth {
                        0 => prediction.set(equation, &reflection.back(&answer)),
                        1 => prediction.add(equation, more(x)),
                        _ => prediction.add(equation, more(y)),
                    }
                }
            }
        }
        if let Some(own) = &self.own {
            let [steps, _] = &mut steps;
            let at = place(own, pose.place_mm);
            for (k, moved) in prediction.moved.iter_mut().enumerate() {
                own.set(steps, k, &sizes, &tilts[0]);
                *moved += own.answer(k, &at, steps).value;
            }
        }
        prediction
    }
}

/// Sees the load in a mirror: its part along x (0) or y (1) turned around.
fn turn(table: &Table<'_>, [of_x, of_y]: &mut [Steps; 2], along: usize) {
    table.turn(of_x, along);
    table.turn(of_y, 1 - along);
}

impl Prediction {
    fn set(&mut self, equation: usize, answer: &Answer) {
        debug_assert!(equation < EQUATIONS);
        let columns = self.slopes.iter_mut().zip(answer.slopes);
        for (column, part) in columns.chain([(&mut self.moved, answer.value)]) {
            if let Some(place) = column.get_mut(equation) {
                *place = part;
            }
        }
    }

    fn add(&mut self, equation: usize, moved: f32) {
        if let Some(place) = self.moved.get_mut(equation) {
            *place += moved;
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
    /// Of what moves, reflected.
    fn sign(&self) -> f32 {
        let [sx, sy] = self.corner;
        if self.axis == 0 { sx } else { sy }
    }

    /// A vector along the film, reflected; and a reflected one, as it is.
    fn vector(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sx, sy] = self.corner;
        match self.axis {
            0 => [sx * x, sy * y],
            _ => [sy * y, sx * x],
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

    /// What was reflected, as it is: its slopes by tilt are those by the tilt as it is, but for
    /// which comes first.
    fn back(&self, reflected: &Answer) -> Answer {
        let ([sx, sy], sign) = (self.corner, self.sign());
        let [size, a, b, x, y] = reflected.slopes;
        let ([a, b], [x, y]) = match self.axis {
            0 => ([a, b], [x, y]),
            _ => ([b, a], [y, x]),
        };
        Answer {
            value: sign * reflected.value,
            slopes: [
                sign * size,
                sign * a,
                sign * b,
                sign * sx * x,
                sign * sy * y,
            ],
        }
    }
}

fn place(table: &Table<'_>, [x, y]: [f32; 2]) -> Place {
    Place {
        x: table.axis().at(x),
        y: table.axis().at(y),
    }
}
