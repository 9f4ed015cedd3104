//! Sums of splines over a grid of ways.

use super::Way;
use super::octant::Octant;
use super::spline::Splines;
use crate::SceneError;

/// Mirrored ways beyond each border of the octant, where there are so many: what the splines' ends do is not felt inside.
const BEYOND: usize = 3;

/// The axes of a grid, with no force before the first size and with mirrored ways beyond the octant.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Axes<const BASES: usize> {
    size: Splines<BASES>,
    steepness: Splines<BASES>,
    turn: Splines<BASES>,
    counts: [usize; 3],
}

/// Where a way lies among the base functions of a grid.
pub(super) struct Place<const BASES: usize> {
    /// For each of some sizes and steepnesses, the first of as many rows.
    rows: [[usize; BASES]; BASES],
    weights: [[[f32; BASES]; BASES]; BASES],
}

impl<const BASES: usize> Axes<BASES> {
    /// The axes of ways that are a grid, and one row of values for each of their nodes by what `mirrored` says of a
    /// way's number, mirrored back from the octant.
    ///
    /// # Errors
    /// When the ways are no grid in the order of size, steepness and turn.
    pub(super) fn new<const N: usize>(
        ways: &[Way],
        mirrored: impl Fn(usize, Octant) -> [f64; N],
    ) -> Result<(Axes<BASES>, Vec<[f64; N]>), SceneError> {
        let [sizes, steeps, turns] = places(ways)?;
        let size: Vec<f64> = std::iter::once(0.0).chain(sizes).collect();
        let [steepness, turn] = with_mirrored(&steeps, &turns);
        let counts = [size.len(), steepness.len(), turn.len()];
        // At no force nothing moves.
        let mut rows = vec![[0.0; N]; counts[1] * counts[2]];
        for step in 0..size.len() - 1 {
            for (part, at) in steepness
                .iter()
                .flat_map(|part| turn.iter().map(move |at| (part, at)))
            {
                let (sin, cos) = libm::sincos(at.to_radians());
                let octant = Octant::of([part * cos, part * sin]);
                let [x, y] = octant.mirrored([cos, sin].map(|side| side * part.signum()));
                let steep = nearest(&steeps, part.abs());
                let turned = nearest(&turns, libm::atan2(y, x).to_degrees());
                let number = (step * steeps.len() + steep) * turns.len() + turned;
                rows.push(mirrored(number, octant));
            }
        }
        let axes = Axes {
            size: Splines::new(size),
            steepness: Splines::new(steepness),
            turn: Splines::new(turn),
            counts,
        };
        axes.solve(rows.as_flattened_mut(), N);
        Ok((axes, rows))
    }

    /// Straight lines in the octant between rows that these splines tell, at places twice as dense.
    pub(super) fn refined<const N: usize>(&self, rows: &[[f32; N]]) -> (Axes<2>, Vec<[f32; N]>) {
        let inside = |places: &[f64]| {
            let own = places.iter().copied().filter(|place| *place > 0.0);
            halved(std::iter::once(0.0).chain(own))
        };
        let size = inside(self.size.places());
        let steepness = inside(self.steepness.places());
        let mut turn = inside(self.turn.places());
        turn.retain(|turn| *turn <= 45.0);
        let mut fine = Vec::new();
        for size in &size {
            for steepness in &steepness {
                fine.extend(turn.iter().map(|turn_deg| {
                    let way = Way {
                        size: *size,
                        steepness: *steepness,
                        turn_deg: *turn_deg,
                    };
                    self.at(&way).sum(rows)
                }));
            }
        }
        let axes = Axes {
            counts: [size.len(), steepness.len(), turn.len()],
            size: Splines::new(size),
            steepness: Splines::new(steepness),
            turn: Splines::new(turn),
        };
        (axes, fine)
    }

    /// Turns values into coefficients, along each axis in its turn.
    fn solve(&self, values: &mut [f64], width: usize) {
        let [_, steeps, turns] = self.counts;
        self.size.solve(values, steeps * turns * width);
        for layer in values.chunks_exact_mut(steeps * turns * width) {
            self.steepness.solve(layer, turns * width);
            for row in layer.chunks_exact_mut(turns * width) {
                self.turn.solve(row, width);
            }
        }
    }

    /// Where a way of the octant lies.
    #[inline(always)]
    pub(super) fn at(&self, way: &Way) -> Place<BASES> {
        let [_, steeps, turns] = self.counts;
        let (size, by_size) = self.size.at(way.size);
        let (steep, by_steepness) = self.steepness.at(way.steepness);
        let (turn, by_turn) = self.turn.at(way.turn_deg);
        let row = |i: usize, j: usize| ((size + i) * steeps + steep + j) * turns + turn;
        let weights = |i: usize, j: usize| {
            let both = by_size[i] * by_steepness[j];
            by_turn.map(|part| (both * part) as f32)
        };
        Place {
            rows: std::array::from_fn(|i| std::array::from_fn(|j| row(i, j))),
            weights: std::array::from_fn(|i| std::array::from_fn(|j| weights(i, j))),
        }
    }
}

impl<const BASES: usize> Place<BASES> {
    /// Every row's number and weight.
    #[inline(always)]
    pub(super) fn each(&self, mut tell: impl FnMut(usize, f32)) {
        let weights = self.weights.as_flattened();
        for (first, weights) in self.rows.as_flattened().iter().zip(weights) {
            for (k, weight) in weights.iter().enumerate() {
                tell(first + k, *weight);
            }
        }
    }

    /// The weighted sum of a grid's rows.
    #[inline(always)]
    pub(super) fn sum<const N: usize>(&self, rows: &[[f32; N]]) -> [f32; N] {
        let mut sum = [0.0; N];
        let weights = self.weights.as_flattened();
        for (first, weights) in self.rows.as_flattened().iter().zip(weights) {
            let few = &rows[*first..][..BASES];
            for (row, weight) in few.iter().zip(weights) {
                for (sum, part) in sum.iter_mut().zip(row) {
                    *sum += weight * part;
                }
            }
        }
        sum
    }
}

/// Sizes, steepnesses and turns of ways that are a grid.
fn places(ways: &[Way]) -> Result<[Vec<f64>; 3], SceneError> {
    let different = |of: fn(&Way) -> f64| {
        let mut places: Vec<f64> = ways.iter().map(of).collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        places
    };
    let axes = [
        different(|way| way.size),
        different(|way| way.steepness),
        different(|way| way.turn_deg),
    ];
    let [sizes, steeps, turns] = &axes;
    let of_size = |size: &f64| {
        let size = *size;
        let of_steepness = move |steepness: &f64| {
            let steepness = *steepness;
            turns.iter().map(move |turn_deg| Way {
                size,
                steepness,
                turn_deg: *turn_deg,
            })
        };
        steeps.iter().flat_map(of_steepness)
    };
    let all = sizes.iter().flat_map(of_size);
    let octant = turns.first() == Some(&0.0) && turns.last() == Some(&45.0);
    let whole =
        octant && sizes.len() >= 3 && steeps.len() >= 2 && sizes[0] > 0.0 && steeps[0] > 0.0;
    if whole && all.eq(ways.iter().copied()) {
        return Ok(axes);
    }
    Err(SceneError::Curves(format!(
        "{} solutions are no grid: expected one for each of three sizes or more above 0, two steepnesses or more above \
         0 and turns from 0 to 45 degrees, in this order",
        ways.len()
    )))
}

/// Steepnesses and turns with the mirrored ones beyond the octant's borders: backward, and before 0 and after 45 degrees.
fn with_mirrored(steeps: &[f64], turns: &[f64]) -> [Vec<f64>; 2] {
    let (across, round) = (BEYOND.min(steeps.len()), BEYOND.min(turns.len() - 1));
    let backward = steeps[..across].iter().rev().map(|part| -part);
    let before = turns[1..=round].iter().rev().map(|turn| -turn);
    let after = turns.iter().rev().skip(1).take(round);
    let after = after.map(|turn| 90.0 - turn);
    [
        backward.chain(steeps.iter().copied()).collect(),
        before.chain(turns.iter().copied()).chain(after).collect(),
    ]
}

/// Places and those halfway between them.
fn halved(places: impl Iterator<Item = f64>) -> Vec<f64> {
    let places: Vec<f64> = places.collect();
    let between = places
        .windows(2)
        .flat_map(|pair| [pair[0], (pair[0] + pair[1]) / 2.0]);
    between.chain(places.last().copied()).collect()
}

fn nearest(places: &[f64], place: f64) -> usize {
    let distance = |k: &usize| (places[*k] - place).abs();
    let all = 0..places.len();
    all.min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or_default()
}
