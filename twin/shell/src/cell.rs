//! The stiffness of one cell, summed over points. Assembly spends most of its time here.

use pulp::Simd;

use crate::point::{Second, V3, VECTORS};
use crate::shell::LOCAL;

/// Number of points that are summed together.
const BATCH: usize = 9;
/// The pairs of components c ≤ e.
pub const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
/// Number of rows of functions that are summed together.
const ROWS: usize = 8;

/// One number for each function of a cell.
pub type Row = [f64; LOCAL];
/// For each pair of components c ≤ e, the stiffness between component c of a function and e of
/// another. For c = e only the lower triangle is filled.
pub type CellStiffness = [[Row; LOCAL]; PAIRS.len()];

/// A sum over points of slopes · second derivatives · slopes.
pub struct CellSum {
    left: [Row; VECTORS * BATCH],
    right: [[Row; VECTORS * BATCH]; PAIRS.len()],
    points: usize,
    /// The sum of the complete batches; [`CellSum::finish`] adds the rest.
    pub stiffness: CellStiffness,
}

impl CellSum {
    /// Returns a sum over no points.
    pub fn new() -> Box<CellSum> {
        Box::new(CellSum {
            left: [[0.0; LOCAL]; VECTORS * BATCH],
            right: [[[0.0; LOCAL]; VECTORS * BATCH]; PAIRS.len()],
            points: 0,
            stiffness: [[[0.0; LOCAL]; LOCAL]; PAIRS.len()],
        })
    }

    /// Removes all points.
    pub fn clear(&mut self) {
        self.points = 0;
        self.stiffness = [[[0.0; LOCAL]; LOCAL]; PAIRS.len()];
    }

    /// Adds a point with the slopes of its functions.
    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, slopes: &[Row; VECTORS], second: &Second) {
        let first = VECTORS * self.points;
        self.left[first..first + VECTORS].copy_from_slice(slopes);
        let n = &second.normal;
        let lanes = LOCAL / S::as_simd_f64s(&slopes[0]).0.len();
        for column in (0..LOCAL).step_by(lanes) {
            let columns = column..column + lanes;
            let [s0, s1, s2, s3, s4] = [
                S::as_simd_f64s(&slopes[0][columns.clone()]).0[0],
                S::as_simd_f64s(&slopes[1][columns.clone()]).0[0],
                S::as_simd_f64s(&slopes[2][columns.clone()]).0[0],
                S::as_simd_f64s(&slopes[3][columns.clone()]).0[0],
                S::as_simd_f64s(&slopes[4][columns.clone()]).0[0],
            ];
            let mut far = [s0; 3];
            for (sum, [a, b, c]) in far.iter_mut().zip(second.far) {
                *sum = simd.mul_f64s(simd.splat_f64s(a), s2);
                *sum = simd.mul_add_e_f64s(simd.splat_f64s(b), s3, *sum);
                *sum = simd.mul_add_e_f64s(simd.splat_f64s(c), s4, *sum);
            }
            for (pair, &(c, e)) in self.right.iter_mut().zip(&PAIRS) {
                for k in 0..2 {
                    let (plane, mixed) = (&second.plane[k], &second.mixed[k]);
                    let mut sum = simd.mul_f64s(simd.splat_f64s(plane[0][c][e]), s0);
                    sum = simd.mul_add_e_f64s(simd.splat_f64s(plane[1][c][e]), s1, sum);
                    sum = simd.mul_add_e_f64s(simd.splat_f64s(mixed[0][c][e]), s2, sum);
                    sum = simd.mul_add_e_f64s(simd.splat_f64s(mixed[1][c][e]), s3, sum);
                    sum = simd.mul_add_e_f64s(simd.splat_f64s(mixed[2][c][e]), s4, sum);
                    S::as_mut_simd_f64s(&mut pair[first + k][columns.clone()]).0[0] = sum;
                }
                let along = simd.splat_f64s(n[c] * n[e]);
                for i in 0..3 {
                    let mut sum = simd.mul_f64s(along, far[i]);
                    sum = simd.mul_add_e_f64s(simd.splat_f64s(second.mixed[0][i][e][c]), s0, sum);
                    sum = simd.mul_add_e_f64s(simd.splat_f64s(second.mixed[1][i][e][c]), s1, sum);
                    S::as_mut_simd_f64s(&mut pair[first + 2 + i][columns.clone()]).0[0] = sum;
                }
            }
        }
        self.points += 1;
        if self.points == BATCH {
            self.finish(simd);
        }
    }

    /// Sums the points that remain.
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

/// Adds the slopes' product with a gradient: the force on each function.
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
