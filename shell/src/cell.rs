//! The stiffness of one cell, summed over points: what assembly spends its time on.

use pulp::Simd;

use crate::point::{Second, V3, VECTORS};
use crate::shell::LOCAL;

/// Points that are summed at once.
const BATCH: usize = 9;
/// The pairs of components c ≤ e.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
/// Rows of functions that are summed at once.
const ROWS: usize = 8;

/// One number for each function of a cell.
pub type Row = [f64; LOCAL];
/// For each pair of components c ≤ e, what component c of a function and e of another meet in; of
/// equal ones, the lower triangle.
pub type CellStiffness = [[Row; LOCAL]; PAIRS.len()];

/// A sum over points of slopes · second derivatives · slopes.
pub struct CellSum {
    left: [Row; VECTORS * BATCH],
    right: [[Row; VECTORS * BATCH]; PAIRS.len()],
    points: usize,
    /// What is summed so far; [`CellSum::finish`] adds the rest.
    pub stiffness: CellStiffness,
}

impl CellSum {
    /// Of no points.
    pub fn new() -> Box<CellSum> {
        Box::new(CellSum {
            left: [[0.0; LOCAL]; VECTORS * BATCH],
            right: [[[0.0; LOCAL]; VECTORS * BATCH]; PAIRS.len()],
            points: 0,
            stiffness: [[[0.0; LOCAL]; LOCAL]; PAIRS.len()],
        })
    }

    /// Forgets all points.
    pub fn clear(&mut self) {
        self.points = 0;
        self.stiffness = [[[0.0; LOCAL]; LOCAL]; PAIRS.len()];
    }

    /// Adds a point with the slopes of its functions.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, slopes: &[Row; VECTORS], second: &Second) {
        let first = VECTORS * self.points;
        self.left[first..first + VECTORS].copy_from_slice(slopes);
        let far: [Row; 3] = [0, 1, 2].map(|i| {
            let [a, b, c] = second.far[i];
            let mut row = [0.0; LOCAL];
            combine(simd, &mut row, [(a, &slopes[2]), (b, &slopes[3]), (c, &slopes[4])]);
            row
        });
        let n = &second.normal;
        for (pair, &(c, e)) in self.right.iter_mut().zip(&PAIRS) {
            for (k, row) in pair[first..first + 2].iter_mut().enumerate() {
                let plane = [0, 1].map(|l| second.plane[k][l][c][e]);
                let mixed = [0, 1, 2].map(|j| second.mixed[k][j][c][e]);
                combine(
                    simd,
                    row,
                    [
                        (plane[0], &slopes[0]),
                        (plane[1], &slopes[1]),
                        (mixed[0], &slopes[2]),
                        (mixed[1], &slopes[3]),
                        (mixed[2], &slopes[4]),
                    ],
                );
            }
            for (i, row) in pair[first + 2..first + VECTORS].iter_mut().enumerate() {
                let mixed = [0, 1].map(|k| second.mixed[k][i][e][c]);
                combine(
                    simd,
                    row,
                    [
                        (n[c] * n[e], &far[i]),
                        (mixed[0], &slopes[0]),
                        (mixed[1], &slopes[1]),
                    ],
                );
            }
        }
        self.points += 1;
        if self.points == BATCH {
            self.finish(simd);
        }
    }

    /// Sums what is left.
    #[inline(always)]
    pub fn finish<S: Simd>(&mut self, simd: S) {
        let count = VECTORS * self.points;
        self.points = 0;
        let lanes = LOCAL / S::as_simd_f64s(&self.left[0]).0.len();
        for (pair, (sum, right)) in self.stiffness.iter_mut().zip(&self.right).enumerate() {
            for block in (0..LOCAL).step_by(ROWS) {
                for column in (0..LOCAL).step_by(lanes) {
                    if pair < 3 && column >= block + ROWS {
                        continue;
                    }
                    let mut sums = [simd.splat_f64s(0.0); ROWS];
                    for (left, right) in self.left[..count].iter().zip(&right[..count]) {
                        let across = S::as_simd_f64s(&right[column..column + lanes]).0[0];
                        for (sum, part) in sums.iter_mut().zip(&left[block..block + ROWS]) {
                            *sum = simd.mul_add_e_f64s(simd.splat_f64s(*part), across, *sum);
                        }
                    }
                    for (row, add) in sum[block..block + ROWS].iter_mut().zip(sums) {
                        let slot = &mut S::as_mut_simd_f64s(&mut row[column..column + lanes]).0[0];
                        *slot = simd.add_f64s(*slot, add);
                    }
                }
            }
        }
    }
}

/// row = Σ factor · other row.
#[inline(always)]
fn combine<S: Simd, const N: usize>(simd: S, row: &mut Row, terms: [(f64, &Row); N]) {
    let out = S::as_mut_simd_f64s(row).0;
    for (k, slot) in out.iter_mut().enumerate() {
        let mut sum = simd.splat_f64s(0.0);
        for (factor, other) in terms {
            let other = S::as_simd_f64s(other).0[k];
            sum = simd.mul_add_e_f64s(simd.splat_f64s(factor), other, sum);
        }
        *slot = sum;
    }
}

/// The slopes' sum over a gradient: the force on each function.
#[inline(always)]
pub fn add_force(sum: &mut [V3; LOCAL], slopes: &[Row; VECTORS], gradient: &[V3; VECTORS]) {
    for (a, total) in sum.iter_mut().enumerate() {
        for (row, vector) in slopes.iter().zip(gradient) {
            for (part, force) in total.iter_mut().zip(vector) {
                *part += row[a] * force;
            }
        }
    }
}
