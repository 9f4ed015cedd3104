//! Computes the Cramér–Rao bound of a force and its place that are measured from four centroids.

use anyhow::{Context, Result};
use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use hivtac_twin::Load;

use super::{Answer, TestedUnit};

/// Unknowns: F_x, F_y, F_z (N) and p_x, p_y (mm).
const UNKNOWNS: usize = 5;
/// Coordinates of the four centroids.
const COORDINATES: usize = 8;
/// Change of a load for the derivatives of the centroids: part of |F|, and distance of the tip, mm.
const STEP: f64 = 0.005;
const STEP_MM: f64 = 0.01;

/// The inverse of the covariance of centroids, px⁻².
pub struct Information([[f64; COORDINATES]; COORDINATES]);

impl Information {
    /// From the scatter of centroids around the true places of the markers, in these frames.
    pub fn of(answers: &[Answer]) -> Result<Information> {
        let off: Vec<[f64; COORDINATES]> = (answers.iter())
            .filter_map(|answer| answer.off_px?.as_flattened().try_into().ok())
            .collect();
        let mean_of = |of: &dyn Fn(&[f64; COORDINATES]) -> f64| {
            off.iter().map(of).sum::<f64>() / off.len() as f64
        };
        let mean: [f64; COORDINATES] = std::array::from_fn(|i| mean_of(&|off| off[i]));
        let covariance =
            |i: usize, j: usize| mean_of(&|off| (off[i] - mean[i]) * (off[j] - mean[j]));
        let covariance = std::array::from_fn(|i| std::array::from_fn(|j| covariance(i, j)));
        Ok(Information(inverse(covariance).context("too few frames")?))
    }

    /// The least mean squares of any unbiased measurement of a press on a unit. Of the angle
    /// between found and true force, square radians, to first order; of |F|, N²; of each coordinate
    /// of the place, mm².
    pub fn bound(&self, unit: &TestedUnit, load: &Load) -> Result<[f64; 3]> {
        let columns = jacobian(unit, load)?;
        let information = |a: usize, b: usize| -> f64 {
            let row =
                |i: usize| -> f64 { (0..COORDINATES).map(|j| self.0[i][j] * columns[b][j]).sum() };
            (0..COORDINATES).map(|i| columns[a][i] * row(i)).sum()
        };
        let information = std::array::from_fn(|a| std::array::from_fn(|b| information(a, b)));
        let covariance: [[f64; UNKNOWNS]; UNKNOWNS] =
            inverse(information).context("the centroids leave an unknown undetermined")?;
        let size = load.magnitude_n();
        let toward = load.vector_n().map(|part| part / size);
        let both = |i: usize, j: usize| toward[i] * toward[j] * covariance[i][j];
        let along: f64 = (0..9).map(|k| both(k / 3, k % 3)).sum();
        let whole: f64 = (0..3).map(|i| covariance[i][i]).sum();
        let place = (covariance[3][3] + covariance[4][4]) / 2.0;
        Ok([(whole - along) / (size * size), along, place])
    }
}

/// Derivatives of the centroids by each unknown, px per N and px per mm, by central differences.
fn jacobian(unit: &TestedUnit, load: &Load) -> Result<[[f64; COORDINATES]; UNKNOWNS]> {
    let mut columns = [[0.0; COORDINATES]; UNKNOWNS];
    for (k, column) in columns.iter_mut().enumerate() {
        let step = if k < 3 {
            STEP * load.magnitude_n()
        } else {
            STEP_MM
        };
        let moved = |step: f64| -> Result<[f64; COORDINATES]> {
            let (mut force_n, mut place_mm) = (load.vector_n(), load.offset_mm());
            if k < 3 {
                force_n[k] += step;
            } else {
                place_mm[k - 3] += step;
            }
            centroids(unit, Load::from_vector(force_n)?.with_offset_mm(place_mm)?)
        };
        let (more, less) = (moved(step)?, moved(-step)?);
        *column = std::array::from_fn(|i| (more[i] - less[i]) / (2.0 * step));
    }
    Ok(columns)
}

/// The true centroids under a load, px: x0, y0, x1, …
fn centroids(unit: &TestedUnit, load: Load) -> Result<[f64; COORDINATES]> {
    let truth = unit.scene.truth_under(&unit.with_tip(load)?)?;
    let mut px = [0.0; COORDINATES];
    for (pair, marker) in px.chunks_exact_mut(2).zip(&truth.markers) {
        pair.copy_from_slice(&marker.context("a marker is out of sight")?.centroid_px);
    }
    Ok(px)
}

/// The inverse of a matrix; `None` if it is not positive definite.
fn inverse<const N: usize>(matrix: [[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let matrix = Mat::from_fn(N, N, |i, j| matrix[i][j]);
    let inverse = matrix.llt(Side::Lower).ok()?.inverse();
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|j| inverse[(i, j)])
    }))
}
