//! The film under a tip that sticks to it: full solutions on a grid of forces and ways, and cubic splines between them.
//!
//! The film answers to a steep way with a slack side that buckles, within so few degrees that polynomials over all ways
//! miss it; splines follow. The grid is of ways of the octant 0 ≤ y ≤ x; mirroring gives the others. What
//! the tip's offset does is told to third order: the first has the grid of the ways, the rest a coarser one with straight
//! lines.

mod grid;
mod octant;
mod spline;
#[cfg(test)]
mod tests;
mod text;

use super::curves::{Answer, DiscMotion};
use super::{MAX_OFFSET_MM, MAX_TANGENT};
use crate::SceneError;
use grid::{Axes, Place};
use octant::Octant;

/// The steepest way: 12° along x and along y.
const STEEPEST: f64 = std::f64::consts::SQRT_2 * MAX_TANGENT;

/// A force along a way, in the grid's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    /// (force along the way / 0.3 N)^⅓, 0 to 1.
    pub size: f64,
    /// How steep, 0 to 1: see [`steepness`].
    pub steepness: f64,
    /// The direction of its sideways part, degrees from +x towards +y.
    pub turn_deg: f64,
}

/// A full solution with the tip in the middle of the film, and how it changes with the tip's offset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// The tip's vector is the sideways force on the film, N, and minus the depth, mm.
    pub answer: Answer,
    /// The change for each mm of offset along x and along y.
    pub by_offset: [Shift; 2],
}

/// A change of the tip's vector and of the markers' means, film frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shift {
    /// Of the tip's vector (sideways force, N; minus the depth, mm).
    pub tip: [f64; 3],
    /// Of the markers, by identity, mm.
    pub moved_mm: [[f64; 3]; 4],
}

/// The tip's vector and the markers' means, all in a row.
pub type Numbers = [f64; 15];

/// What first derivatives leave of an offset's effect: the coefficients of [`even`] of x, xy, [`even`] of y, [`odd`] of x,
/// x²y, xy² and [`odd`] of y, with the offset (x, y) in parts of the largest (0.25 mm).
pub type Bend = [Shift; 7];

/// How what is even in an offset along x or along y grows with it, in parts of the largest: as 1 − cos πx rather than x². The
/// largest offset is half a cell of the full solution's mesh, and most of this effect is the mesh's.
pub fn even(x: f64) -> f64 {
    let square = x * x;
    square * (2.0 - square)
}

/// The same for what is odd and of higher than first order: as πx − sin πx rather than x³.
pub fn odd(x: f64) -> f64 {
    let square = x * x;
    x * square * (1.5 - 0.5 * square)
}

/// Full solutions on two grids of ways.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solved {
    /// Solutions and their answer to offsets.
    pub states: Vec<(Way, State)>,
    /// The rest of the answer to offsets.
    pub bends: Vec<(Way, Bend)>,
}

/// Full solutions, ready to be evaluated between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Stuck {
    axes: Axes<4>,
    tips: Vec<[f32; TIP]>,
    /// Of markers 0 and 1, and of 2 and 3.
    discs: [Vec<[f32; 2 * DISC]>; 2],
    bend_axes: Axes<2>,
    /// The tip's numbers, then the discs'.
    bend_rows: Vec<[f32; BENT]>,
}

/// Numbers of the tip in a row: its vector, its change by offsets along x and y; and a rest.
const TIP: usize = 12;
/// Numbers of a disc: its mean, its change by offsets along x and y, its slopes along x and y; and a rest.
const DISC: usize = 16;
/// Numbers of the rest of the answer to offsets: 16 for each product.
const BENT: usize = 7 * 16;

/// The tangent at which one side of a film that sticks goes slack: about half the depth over half the span; never less
/// than where bending holds it.
fn slack(size: f64) -> f64 {
    0.22 * (size * size + 0.01).sqrt()
}

/// The steepness of a way of this size whose sideways part is so much of its depth: stretched by asinh about where the
/// film goes slack, and 1 for 12° along x and along y.
pub fn steepness(size: f64, tangent: f64) -> f64 {
    let slack = slack(size);
    libm::asinh(tangent / slack) / libm::asinh(STEEPEST / slack)
}

/// Sideways part over depth of a way of this size and steepness.
pub fn tangent(size: f64, steepness: f64) -> f64 {
    let slack = slack(size);
    slack * libm::sinh(steepness * libm::asinh(STEEPEST / slack))
}

impl Shift {
    /// Tip and markers in a row.
    pub fn numbers(&self) -> Numbers {
        let mut numbers = [0.0; 15];
        fill(&mut numbers, &[self.tip]);
        fill(&mut numbers[3..], &self.moved_mm);
        numbers
    }

    /// The way back.
    pub fn from_numbers(numbers: Numbers) -> Shift {
        let vector = |k: usize| std::array::from_fn(|c| numbers[3 * k + c]);
        Shift {
            tip: vector(0),
            moved_mm: std::array::from_fn(|k| vector(k + 1)),
        }
    }

    fn times(&self, factor: f64) -> Shift {
        let times = |vector: [f64; 3]| vector.map(|part| factor * part);
        Shift {
            tip: times(self.tip),
            moved_mm: self.moved_mm.map(times),
        }
    }
}

impl Way {
    /// The way of the octant of a tip that moves so far sideways for a depth of 1.
    fn new(size: f64, [x, y]: [f64; 2]) -> Way {
        let turn = if x > 0.0 { libm::atan(y / x) } else { 0.0 };
        Way {
            size,
            steepness: steepness(size, (x * x + y * y).sqrt()).min(1.0),
            turn_deg: turn.to_degrees(),
        }
    }
}

impl Stuck {
    /// Makes splines of full solutions.
    ///
    /// # Errors
    /// When the solutions are no grid of ways.
    pub fn new(solved: &Solved) -> Result<Stuck, SceneError> {
        let ways = |k: usize| solved.states[k].0;
        let ways: Vec<Way> = (0..solved.states.len()).map(ways).collect();
        let (axes, rows) = Axes::new(&ways, |k, octant| row(&octant.state(&solved.states[k].1)))?;
        let ways: Vec<Way> = solved.bends.iter().map(|(way, _)| *way).collect();
        let (cubic, bends) = Axes::<4>::new(&ways, |k, octant| {
            bend_row(&octant.bend(&solved.bends[k].1))
        })?;
        let (bend_axes, bend_rows) = cubic.refined(&part(&bends, 0));
        Ok(Stuck {
            axes,
            tips: part(&rows, 0),
            discs: [part(&rows, TIP), part(&rows, TIP + 2 * DISC)],
            bend_axes,
            bend_rows,
        })
    }

    /// Tip and markers under a tip of this size (0 to 1) whose way has these tangents and that touches at this offset, mm.
    pub fn at(&self, size: f64, tangents: [f64; 2], offset_mm: [f64; 2]) -> Answer {
        self.placed(size, tangents, offset_mm).answer()
    }

    /// Such a tip's place between the solutions.
    #[inline(always)]
    pub(super) fn placed(&self, size: f64, tangents: [f64; 2], offset_mm: [f64; 2]) -> Placed<'_> {
        let octant = Octant::of(tangents);
        let way = Way::new(size, octant.mirrored(tangents));
        Placed {
            stuck: self,
            octant,
            offset: Offset::new(octant.mirrored(offset_mm)),
            place: self.axes.at(&way),
            bend_place: self.bend_axes.at(&way),
        }
    }
}

/// A tip that sticks, by the solutions around it: its vector can be told without the markers.
pub(super) struct Placed<'a> {
    stuck: &'a Stuck,
    octant: Octant,
    offset: Offset,
    place: Place<4>,
    bend_place: Place<2>,
}

impl Placed<'_> {
    /// Tip and markers.
    pub(super) fn answer(&self) -> Answer {
        let bent: [f32; 16] = self.offset.bent(&self.bend_place, &self.stuck.bend_rows);
        let halves = [0, 1].map(|half| self.place.sum(&self.stuck.discs[half]));
        let disc = |k: usize| {
            let row = &halves[k / 2][DISC * (k % 2)..][..DISC];
            DiscMotion {
                moved_mm: self.offset.moves(row, &bent[3 * (k + 1)..]),
                along_x: vector(&row[9..]),
                along_y: vector(&row[12..]),
            }
        };
        let tip = self.offset.moves(&self.place.sum(&self.stuck.tips), &bent);
        self.octant.answer(&Answer {
            tip,
            discs: std::array::from_fn(disc),
        })
    }

    /// The tip's vector alone, the same to the last bit.
    pub(super) fn tip(&self) -> [f64; 3] {
        let bent: [f32; 4] = self.offset.bent(&self.bend_place, &self.stuck.bend_rows);
        let tip = self.place.sum(&self.stuck.tips);
        self.octant.vector(self.offset.moves(&tip, &bent))
    }
}

/// An offset of the tip, mm, and the functions of it that a [`Bend`] has coefficients of.
struct Offset {
    mm: [f64; 2],
    products: [f32; 7],
}

impl Offset {
    /// Beyond the largest it stays there.
    fn new(mm: [f64; 2]) -> Offset {
        let mm = mm.map(|part| part.clamp(-MAX_OFFSET_MM, MAX_OFFSET_MM));
        let [x, y] = mm.map(|part| part / MAX_OFFSET_MM);
        let (xy, along_x, along_y) = (x * y, odd(x), odd(y));
        let products = [even(x), xy, even(y), along_x, x * xy, y * xy, along_y];
        Offset {
            mm,
            products: products.map(|product| product as f32),
        }
    }

    /// What the first derivatives leave, of the first few of the tip's and the markers' numbers.
    #[inline(always)]
    fn bent<const FEW: usize>(&self, place: &Place<2>, rows: &[[f32; BENT]]) -> [f32; FEW] {
        let mut sum = [0.0; FEW];
        place.each(|number, weight| {
            let parts = rows[number].chunks_exact(16).zip(self.products);
            for (part, product) in parts {
                let factor = weight * product;
                for (sum, value) in sum.iter_mut().zip(part) {
                    *sum += factor * value;
                }
            }
        });
        sum
    }

    /// A vector by itself, its two changes and what they leave.
    #[inline(always)]
    fn moves(&self, row: &[f32], bent: &[f32]) -> [f64; 3] {
        let (row, bent) = (&row[..9], &bent[..3]);
        let [x, y] = self.mm;
        std::array::from_fn(|c| {
            let first = x * f64::from(row[3 + c]) + y * f64::from(row[6 + c]);
            f64::from(row[c]) + (first + f64::from(bent[c]))
        })
    }
}

fn vector(row: &[f32]) -> [f64; 3] {
    [0, 1, 2].map(|c| f64::from(row[c]))
}

fn row(state: &State) -> [f64; TIP + 4 * DISC] {
    let State { answer, by_offset } = state;
    let [x, y] = by_offset;
    let mut row = [0.0; TIP + 4 * DISC];
    let (tip, discs) = row.split_at_mut(TIP);
    fill(tip, &[answer.tip, x.tip, y.tip]);
    for (k, (part, disc)) in discs.chunks_exact_mut(DISC).zip(&answer.discs).enumerate() {
        let moved = [disc.moved_mm, x.moved_mm[k], y.moved_mm[k]];
        fill(part, &moved);
        fill(&mut part[9..], &[disc.along_x, disc.along_y]);
    }
    row
}

/// A row of 16 numbers for each product: [`Shift::numbers`] and a rest.
fn bend_row(bend: &Bend) -> [f64; BENT] {
    let mut row = [0.0; BENT];
    for (part, shift) in row.chunks_exact_mut(16).zip(bend) {
        part[..15].copy_from_slice(&shift.numbers());
    }
    row
}

fn fill(row: &mut [f64], vectors: &[[f64; 3]]) {
    for (place, value) in row.iter_mut().zip(vectors.as_flattened()) {
        *place = *value;
    }
}

/// Some numbers of each row, in single precision: a nanometre of some millimetres.
fn part<const M: usize, const N: usize>(rows: &[[f64; M]], from: usize) -> Vec<[f32; N]> {
    let of_row = |row: &[f64; M]| std::array::from_fn(|k| row[from + k] as f32);
    rows.iter().map(of_row).collect()
}
