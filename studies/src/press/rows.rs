//! Sums errors of many answers, by force.

use anyhow::{Context, Result};
use hivtac_calibration::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_sensor::force::Force;
use hivtac_twin::Load;
use serde::Serialize;

/// Sums of squares of errors, and the number of errors within their stated bounds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// Answers with a force.
    pub count: u32,
    /// Answers without one.
    pub refused: u32,
    /// Forces whose direction, |F| or place exceeds three stated standard uncertainties.
    pub beyond: u32,
    /// Squares for the direction, square degrees; for |F|, mN²; for each coordinate of the place,
    /// µm².
    squares: [f64; 3],
    /// Number of each kind of errors within their 95 % bounds.
    within: [u32; 3],
}

/// Root mean square errors at a force.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// |F|, mN.
    pub force_mn: u32,
    /// Error of the direction, degrees.
    pub direction_deg: f64,
    /// Error of |F|, mN.
    pub magnitude_mn: f64,
    /// Error of each coordinate of the place, µm.
    pub place_um: f64,
    /// Number of forces.
    pub frames: u32,
}

impl Errors {
    /// Adds an answer; a force without a place is an error.
    pub fn add(&mut self, force: Option<&Force>, truth: &Load) -> Result<()> {
        let Some(force) = force else {
            self.refused += 1;
            return Ok(());
        };
        let found_n = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
        let place = force.place.context("the model tells no places")?;
        let found_mm = [place.x, place.y].map(|part| f64::from(part.0) * 1e-3);
        let bounds = [
            DIRECTION_BOUND * f64::from(force.direction_sigma.0) * 1e-3,
            MAGNITUDE_BOUND * f64::from(force.magnitude_sigma.0) * 1e-3,
            PLACE_BOUND * f64::from(place.sigma.0),
        ];
        let magnitude_n = f64::from(force.magnitude.0) * 1e-6;
        let truth = (truth.vector_n(), truth.offset_mm());
        self.take((found_n, magnitude_n, found_mm), truth, bounds);
        Ok(())
    }

    /// Adds a force (N), its magnitude (N) and its place (mm), with the true force and place. Also
    /// takes the stated 95 % bounds: of the direction (degrees), of |F| (mN), and of the place
    /// (µm).
    pub fn take(
        &mut self,
        (found_n, magnitude_n, found_mm): ([f64; 3], f64, [f64; 2]),
        (truth_n, truth_mm): ([f64; 3], [f64; 2]),
        bounds: [f64; 3],
    ) {
        let true_size_n = truth_n.iter().map(|part| part * part).sum::<f64>().sqrt();
        let errors = [
            angle_deg(found_n, truth_n).unwrap_or(180.0),
            1e3 * (magnitude_n - true_size_n).abs(),
            1e3 * (found_mm[0] - truth_mm[0]).hypot(found_mm[1] - truth_mm[1]),
        ];
        self.count += 1;
        // Ratio of three standard uncertainties to a 95 % bound.
        let far = 3.0 / MAGNITUDE_BOUND;
        self.beyond += u32::from((0..3).any(|k| errors[k] > far * bounds[k]));
        for k in 0..3 {
            // A place has two coordinates.
            self.squares[k] += errors[k] * errors[k] / if k == 2 { 2.0 } else { 1.0 };
            self.within[k] += u32::from(errors[k] <= bounds[k]);
        }
    }

    /// Adds the errors of another sum.
    pub fn merge(&mut self, other: &Errors) {
        self.count += other.count;
        self.refused += other.refused;
        self.beyond += other.beyond;
        for k in 0..3 {
            self.squares[k] += other.squares[k];
            self.within[k] += other.within[k];
        }
    }

    /// Root mean square errors: direction, degrees; |F|, mN; each coordinate of the place, µm.
    pub fn rms(&self) -> [f64; 3] {
        self.squares.map(|sum| (sum / f64::from(self.count)).sqrt())
    }

    /// Percentage of each kind of errors within their stated 95 % bounds.
    pub fn covered(&self) -> [f64; 3] {
        self.within
            .map(|within| 100.0 * f64::from(within) / f64::from(self.count))
    }

    /// The row for a force.
    pub fn row(&self, force_mn: u32) -> Row {
        let [direction_deg, magnitude_mn, place_um] = self.rms();
        Row {
            force_mn,
            direction_deg,
            magnitude_mn,
            place_um,
            frames: self.count,
        }
    }
}
