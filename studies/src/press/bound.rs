//! The Cramér–Rao bound of a force and its place that are read from the centroids of four markers.

use anyhow::{Context, Result};
use hivtac_scene::Load;

use super::TestedUnit;
use super::matrix::{cholesky, dot, forward, inverse};

/// Unknowns: F_x, F_y, F_z (N) and p_x, p_y (mm).
const UNKNOWNS: usize = 5;
/// Coordinates of the four centroids.
const COORDINATES: usize = 8;
/// Covariances of centroids, px².
pub type Noise = [[f64; COORDINATES]; COORDINATES];

/// Part of |F| by which a load is changed to see how the centroids follow, and how far a tip, mm.
const STEP: f64 = 0.005;
const STEP_MM: f64 = 0.01;

/// The least mean squares that any unbiased reading can have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bound {
    /// Of the angle between found and true force, square radians, to first order.
    pub direction: f64,
    /// Of |F|, N².
    pub force: f64,
    /// Of each coordinate of the place, mm², their mean.
    pub place: f64,
}

impl Bound {
    /// The sum with another one.
    pub fn plus(&self, other: &Bound) -> Bound {
        Bound {
            direction: self.direction + other.direction,
            force: self.force + other.force,
            place: self.place + other.place,
        }
    }

    /// For a press on a unit whose centroids' coordinates have these covariances, px².
    ///
    /// # Errors
    /// When a marker is out of sight, or the centroids leave an unknown undetermined.
    pub fn of(unit: &TestedUnit, load: &Load, noise: &Noise) -> Result<Bound> {
        let whitening = cholesky(noise)?;
        let columns = jacobian(unit, load)?.map(|column| forward(&whitening, column));
        let information: [[f64; UNKNOWNS]; UNKNOWNS] =
            std::array::from_fn(|i| std::array::from_fn(|j| dot(&columns[i], &columns[j])));
        let covariance = inverse(&information)?;
        let size = load.magnitude_n();
        let toward = load.vector_n().map(|part| part / size);
        let both = |i: usize, j: usize| toward[i] * toward[j] * covariance[i][j];
        let along: f64 = (0..9).map(|k| both(k / 3, k % 3)).sum();
        let whole: f64 = (0..3).map(|i| covariance[i][i]).sum();
        Ok(Bound {
            direction: (whole - along) / (size * size),
            force: along,
            place: (covariance[3][3] + covariance[4][4]) / 2.0,
        })
    }
}

/// How the centroids follow each unknown, px per N and px per mm: central differences.
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
    let truth = unit.scene().truth_under(&unit.with_tip(load)?)?;
    let mut px = [0.0; COORDINATES];
    for (pair, marker) in px.chunks_exact_mut(2).zip(&truth.markers) {
        pair.copy_from_slice(&marker.context("a marker is out of sight")?.centroid_px);
    }
    Ok(px)
}
