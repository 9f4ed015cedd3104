//! Computes how the film's own weight moves the images: at rest, and less under a load.
//!
//! Weight along the film's normal acts as a load of its own. With it, the film is as under a load
//! of size a, the root of |F|(a) = |F|(s) − p·g_z, with the tip's size s. The motion is nearly in
//! proportion to Δ = a − s; under a deep press it is a few hundredths of that at rest. Functions of
//! Δ and of gravity along the film are computed once, when gravity changes. Each frame sums the
//! rest over the load.

use super::covariance::{Covariance, add_square, between};
use super::mounting::Mounting;
use super::pose::{Pose, Stiffness, limited};
use super::predict::Prediction;
use super::solve::Column;
use super::terms::Limits;
use super::{Forward, Markers};
use crate::force::kernels::sqrt;
use crate::force::rest::Rest;

/// Gravity along x, y and z of the film frame, in g.
pub type Gravity = [f32; 3];

/// Number of functions of gravity whose sum is the effect at rest: Δ, Δ², Δ³, x, y, x·Δ and y·Δ.
pub const AT_REST: usize = 7;
/// Number of functions that have an additional part under a load: Δ, Δ², x and y.
pub const UNDER_LOAD: usize = 4;
/// Number of sizes at which the additional part is given: (k/n)² of the largest, k from 1. It is 0
/// at size 0.
pub const SIZES: usize = 10;
/// Number of functions of place and tilt: 1, x, y, x², x·y, y², the tilt's a and b, a² + b².
pub const TERMS: usize = 9;
/// Bytes of the additional part at one size by one function of gravity: a step, and a coefficient
/// of each coordinate and term.
const fn block_length(coordinates: usize) -> usize {
    4 + 2 * coordinates * TERMS
}
/// Bytes of all additional parts of this number of coordinates.
pub const fn length(coordinates: usize) -> usize {
    SIZES * UNDER_LOAD * block_length(coordinates)
}
/// Allowed steps of the additional part.
pub const LEGAL: core::ops::RangeInclusive<f32> = 0.0..=1e3;
/// Places are limited to this, mm.
const LAST_MM: f32 = 5.0;
/// Newton's steps to a size.
const STEPS: usize = 12;
/// Standard uncertainty of an unknown gravity, relative to the effect of 1 g along an axis. A
/// sensor that was turned over is within two of it. Any two directions differ by √(2/3) along each
/// axis (root mean square).
const ANY_WAY: f32 = 1.0;
/// Standard uncertainty of each coordinate that these functions leave. `LEFT`: relative to the
/// effect of weight under the load. `LEFT_OF_TURN`: relative to the effect of a turn at rest, times
/// the softness. Below a few mN the film buckles inside out if gravity pulls away from the camera.
const LEFT: f32 = 0.02;
const LEFT_OF_TURN: f32 = 0.15;
/// Gravity counts as equal if it differs by less than this, in g.
const SAME: f32 = 2e-3;
/// How often a rest picture is read to find the size of the weight's effect in it: each reading
/// leaves a twentieth of the previous error.
const READINGS: usize = 3;

/// The effect of weight, borrowed from a model file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weight<'a> {
    /// Gravity on the film of the tables and of the model's own rest position. Zeros: that film had
    /// no weight.
    pub down: Gravity,
    /// The press that sinks the film as its weight does, N.
    pub press_n: f32,
    /// Relative standard uncertainty of the effect: of the unit that the model was made on, and of
    /// any other.
    pub unsure: [f32; 2],
    /// Number of coordinates.
    pub coordinates: usize,
    /// The effect at rest by function and coordinate, f32 each, focal lengths.
    pub at_rest: &'a [u8],
    /// The additional part at each size of each function, divided by the film's [softness](soft).
    pub under_load: &'a [u8],
}

/// The properties of a film that the functions of gravity need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Functions {
    /// The force of each size.
    pub stiffness: Stiffness,
    /// As [`Weight::press_n`].
    pub press_n: f32,
}

/// Gravity on a sensor as far as known: when its rest position was taken, and now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turned {
    /// Unknown, both times.
    AnyWay,
    /// Known, both times.
    From {
        /// When the rest position was taken.
        before: Gravity,
        /// Now.
        now: Gravity,
    },
}

/// The effect of weight under this gravity, in addition to what the tables include.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hanging {
    /// True if the prediction includes the effect; otherwise only the covariance does.
    is_predicted: bool,
    /// The functions of gravity at each size, relative to those of the tables' film.
    functions: [[f32; AT_REST]; SIZES + 1],
    /// The part of the effect that the rest position includes.
    at_rest: Column,
    /// The uncertain effect at rest, and its relative standard uncertainty.
    moved: Column,
    unsure: f32,
    /// The effect of gravity along x and along y, if gravity is unknown.
    along: Option<[Column; 2]>,
}

impl<'a> Weight<'a> {
    /// Whether these bytes of a file are the additional parts of this number of coordinates: their
    /// number is [`length`], and all steps are within [`LEGAL`].
    pub fn is_under_load(bytes: &[u8], coordinates: usize) -> bool {
        let mut blocks = bytes.chunks(block_length(coordinates).max(1));
        bytes.len() == length(coordinates) && blocks.all(|block| LEGAL.contains(&step(block)))
    }

    /// The effect at rest of each function of gravity, focal lengths.
    fn columns(&self) -> impl Iterator<Item = Column> {
        let (parts, _) = self.at_rest.as_chunks();
        let columns = parts.chunks(self.coordinates.max(1));
        columns.map(|parts| Column::of(parts.iter().map(|part| f32::from_le_bytes(*part))))
    }

    /// How far gravity moves the images at rest, compared with a weightless film, focal lengths.
    pub fn hangs(&self, stiffness: &Stiffness, gravity: Gravity) -> Column {
        self.at_rest_of(&self.functions(stiffness).at(0.0, gravity))
    }

    /// Returns the effect of weight on a turned sensor, in addition to the tables: for the unit
    /// that they were made on (`is_own`), or for another.
    pub fn hanging(
        &self,
        stiffness: &Stiffness,
        limits: &Limits,
        turned: Turned,
        is_own: bool,
    ) -> Hanging {
        let unsure = self.unsure[usize::from(!is_own)];
        let parts = match turned {
            Turned::AnyWay => [(0.5, [0.0, 0.0, 1.0]), (-0.5, [0.0, 0.0, -1.0])],
            Turned::From { now, .. } => [(1.0, now), (-1.0, self.down)],
        };
        let mut functions = [[0.0; AT_REST]; SIZES + 1];
        for (number, sum) in functions.iter_mut().enumerate() {
            let size = size_of(number, limits);
            for (part, gravity) in parts {
                let functions = self.functions(stiffness).at(size, gravity);
                for (sum, function) in sum.iter_mut().zip(functions) {
                    *sum += part * function;
                }
            }
        }
        let at_rest = self.at_rest_of(&functions[0]);
        let mut hanging = Hanging {
            is_predicted: true,
            functions,
            at_rest,
            moved: Column::defaults(at_rest.len()),
            unsure,
            along: None,
        };
        match turned {
            Turned::AnyWay => {
                let along = |k: usize| {
                    let column = self.columns().nth(k).unwrap_or_default();
                    column.map(|part| ANY_WAY * part)
                };
                hanging.is_predicted = false;
                hanging.moved = at_rest;
                hanging.unsure = ANY_WAY;
                hanging.along = Some([along(3), along(4)]);
            }
            Turned::From { before, now } => {
                add(&mut hanging.moved, 1.0, &self.hangs(stiffness, now));
                add(&mut hanging.moved, -1.0, &self.hangs(stiffness, before));
            }
        }
        hanging
    }

    /// The effect at rest with these functions of gravity.
    fn at_rest_of(&self, functions: &[f32; AT_REST]) -> Column {
        let mut sum = Column::defaults(self.coordinates);
        for (part, column) in functions.iter().zip(self.columns()) {
            add(&mut sum, *part, &column);
        }
        sum
    }

    fn functions(&self, stiffness: &Stiffness) -> Functions {
        Functions {
            stiffness: *stiffness,
            press_n: self.press_n,
        }
    }

    /// The effect of these functions of gravity at the size with this number, divided by the
    /// softness.
    fn under_load_of(
        &self,
        number: usize,
        softness: f32,
        functions: &[f32; AT_REST],
        terms: &[f32; TERMS],
    ) -> Column {
        let mut sum = self.at_rest_of(functions).map(|part| part / softness);
        let [d, square, _, x, y, ..] = *functions;
        let first = number.wrapping_sub(1).saturating_mul(UNDER_LOAD);
        let blocks = self
            .under_load
            .chunks(block_length(self.coordinates).max(1));
        for (function, block) in [d, square, x, y].into_iter().zip(blocks.skip(first)) {
            add_block(block, function, terms, &mut sum);
        }
        sum
    }
}

impl Forward<'_> {
    /// Converts a rest position under today's gravity to the gravity of the model's own film.
    pub fn as_made(&self, rest: &Rest, turned: Turned) -> Rest {
        match (&self.weight, turned) {
            (Some(weight), Turned::From { now, .. }) => self.turned(rest, now, weight.down),
            _ => *rest,
        }
    }

    /// Converts a rest position from one gravity to another.
    pub fn turned(&self, rest: &Rest, from: Gravity, to: Gravity) -> Rest {
        let Some(weight) = &self.weight else {
            return *rest;
        };
        let hangs = |gravity| weight.hangs(&self.stiffness, gravity);
        let moved = |from: Gravity, to: Gravity, by: &Mounting| {
            let mut moved = hangs(to);
            add(&mut moved, -1.0, &hangs(from));
            let px = moved.as_chunks().0.iter().map(|moved| by.px(*moved));
            rest.displaced(&Markers::of(px))
        };
        let mut flat = *rest;
        for _ in 0..READINGS {
            flat = moved(from, weight.down, &self.rest_image.mounting(&flat));
        }
        match is_same(to, weight.down) {
            true => flat,
            false => moved(from, to, &self.rest_image.mounting(&flat)),
        }
    }

    /// Returns the effect of weight on a turned sensor, in addition to the tables. Returns `None`
    /// if gravity has always been as on the model's own film, or the file has no weight section.
    pub fn hanging(&self, turned: Turned, is_own: bool) -> Option<Hanging> {
        let weight = self.weight.as_ref()?;
        if let Turned::From { before, now } = turned
            && is_same(before, weight.down)
            && is_same(now, weight.down)
        {
            return None;
        }
        Some(weight.hanging(&self.stiffness, &self.limits, turned, is_own))
    }
}

fn is_same(a: Gravity, b: Gravity) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME)
}

impl Functions {
    /// The functions of gravity under a load of a size.
    pub fn at(&self, size: f32, [x, y, z]: Gravity) -> [f32; AT_REST] {
        let stiffness = &self.stiffness;
        let with_n = stiffness.magnitude_n(size) - self.press_n * z;
        // An odd function; Newton's steps find its root from above.
        let (sign, with_n) = if with_n < 0.0 {
            (-1.0, -with_n)
        } else {
            (1.0, with_n)
        };
        let mut root = (with_n / stiffness.linear_n).min(libm::cbrtf(with_n / stiffness.cubic_n));
        for _ in 0..STEPS {
            root -= (stiffness.magnitude_n(root) - with_n) / stiffness.per_size_n(root);
        }
        let d = sign * root - size;
        [d, d * d, d * d * d, x, y, x * d, y * d]
    }
}

/// The functions of place, mm, and tilt, rad.
pub fn terms(place_mm: [f32; 2], [a, b]: [f32; 2]) -> [f32; TERMS] {
    let [x, y] = place_mm.map(|part| limited(part, -LAST_MM, LAST_MM));
    [1.0, x, y, x * x, x * y, y * y, a, b, a * a + b * b]
}

/// The softness of the film under a load of a size, relative to rest: 1 at rest, less under load.
pub fn soft(stiffness: &Stiffness, size: f32) -> f32 {
    stiffness.linear_n / stiffness.per_size_n(size)
}

fn add(sum: &mut Column, part: f32, column: &Column) {
    for (sum, value) in sum.iter_mut().zip(column.iter()) {
        *sum += part * value;
    }
}

fn step(block: &[u8]) -> f32 {
    let step = block.first_chunk().copied();
    f32::from_le_bytes(step.unwrap_or_default())
}

/// The size with this number.
fn size_of(number: usize, limits: &Limits) -> f32 {
    let root = number as f32 / SIZES as f32;
    limits.size * root * root
}

/// Adds `function` times the additional part of a block at these terms.
fn add_block(block: &[u8], function: f32, terms: &[f32; TERMS], sum: &mut Column) {
    let part = function * step(block);
    let (coordinates, _) = block
        .get(4..)
        .unwrap_or_default()
        .as_chunks::<{ 2 * TERMS }>();
    for (sum, steps) in sum.iter_mut().zip(coordinates) {
        let steps = steps
            .as_chunks()
            .0
            .iter()
            .map(|step| i16::from_le_bytes(*step));
        let products = steps.zip(terms).map(|(step, term)| f32::from(step) * term);
        *sum += part * products.fold(0.0, |sum, product| sum + product);
    }
}

impl Hanging {
    /// Adds the effect of weight under a load to a prediction.
    #[inline(never)]
    pub fn add_to(&self, pose: &Pose, forward: &Forward<'_>, prediction: &mut Prediction) {
        if self.is_predicted {
            let (more, by_size) = self.more(pose, forward);
            add(&mut prediction.moved, 1.0, &more);
            add(&mut prediction.slopes[0], 1.0, &by_size);
        }
    }

    /// Adds the uncertainty of that effect to a covariance.
    #[inline(never)]
    pub fn add_uncertainty(&self, pose: &Pose, forward: &Forward<'_>, covariance: &mut Covariance) {
        let (more, _) = self.more(pose, forward);
        let of_turn = LEFT_OF_TURN * soft(&forward.stiffness, pose.size);
        let effects = more.iter().zip(self.at_rest.iter()).zip(self.moved.iter());
        for (row, ((more, at_rest), moved)) in covariance.rows_mut().zip(effects) {
            let (left, turned) = (LEFT * (more + at_rest), of_turn * moved);
            if let Some(variance) = row.last_mut() {
                *variance += left * left + turned * turned;
            }
        }
        let mut mode = self.moved;
        add(&mut mode, 1.0, &more);
        add_square(covariance, &mode, self.unsure);
        for along in self.along.iter().flatten() {
            add_square(covariance, along, 1.0);
        }
    }

    /// The effect of weight under a load minus that at rest, and its slope by the size.
    fn more(&self, pose: &Pose, forward: &Forward<'_>) -> (Column, Column) {
        let [mut more, mut by_size] = [Column::defaults(self.at_rest.len()); 2];
        let Some(weight) = &forward.weight else {
            return (more, by_size);
        };
        let (stiffness, limits) = (&forward.stiffness, &forward.limits);
        let terms = terms(pose.place_mm, pose.tilt);
        let size = limited(pose.size / limits.size, 1e-6, 1.0);
        let root = sqrt(size);
        let [(from, one), (to, other)] = between(root, SIZES + 1).map(|(number, part)| {
            let softness = soft(stiffness, size_of(number, limits));
            let functions = self.functions.get(number).copied().unwrap_or_default();
            (
                weight.under_load_of(number, softness, &functions, &terms),
                part,
            )
        });
        let (at, per_size_n) = (pose.size, stiffness.per_size_n(pose.size));
        let softness = stiffness.linear_n / per_size_n;
        let softer = -6.0 * stiffness.cubic_n * at * softness / per_size_n;
        let steeper = SIZES as f32 * softness / (2.0 * root * limits.size);
        let sums = more.iter_mut().zip(by_size.iter_mut());
        let ends = self.at_rest.iter().zip(from.iter().zip(to.iter()));
        for ((more, by_size), (at_rest, (from, to))) in sums.zip(ends) {
            let value = one * from + other * to;
            *more = softness * value - at_rest;
            *by_size = softer * value + steeper * (to - from);
        }
        (more, by_size)
    }
}
