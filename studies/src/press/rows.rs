//! Errors of forces, and their sums over many answers.

use anyhow::{Context, Result};
use hivtac_calibration::data::loads::norm;
use hivtac_calibration::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_sensor::force::Force;
use hivtac_twin::Load;

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

/// A force's stated uncertainties of direction (degrees), |F| (mN) and place (µm).
pub struct Judged {
    /// Errors; that of |F| is positive if it is too large.
    pub errors: [f64; 3],
    /// The stated 95 % bounds.
    pub bounds: [f64; 3],
}

/// Compares a force with the true one, N, and its place, mm; a force without a place is an error.
pub fn judged(force: &Force, truth_n: [f64; 3], truth_mm: [f64; 2]) -> Result<Judged> {
    let place = force.place.context("the model gives no places")?;
    let found_n = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    let [x, y] = [place.x, place.y].map(|part| f64::from(part.0));
    Ok(Judged {
        errors: [
            angle_deg(found_n, truth_n).unwrap_or(180.0),
            f64::from(force.magnitude.0) * 1e-3 - 1e3 * norm(truth_n),
            (x - 1e3 * truth_mm[0]).hypot(y - 1e3 * truth_mm[1]),
        ],
        bounds: [
            DIRECTION_BOUND * f64::from(force.direction_sigma.0) * 1e-3,
            MAGNITUDE_BOUND * f64::from(force.magnitude_sigma.0) * 1e-3,
            PLACE_BOUND * f64::from(place.sigma.0),
        ],
    })
}

impl Errors {
    /// Adds an answer; a force without a place is an error.
    pub fn add(&mut self, force: Option<&Force>, truth: &Load) -> Result<()> {
        let Some(force) = force else {
            self.refused += 1;
            return Ok(());
        };
        let Judged { errors, bounds } = judged(force, truth.vector_n(), truth.offset_mm())?;
        let errors = errors.map(f64::abs);
        self.count += 1;
        // Ratio of three standard uncertainties to a 95 % bound.
        let far = 3.0 / MAGNITUDE_BOUND;
        self.beyond += u32::from((0..3).any(|k| errors[k] > far * bounds[k]));
        for k in 0..3 {
            // A place has two coordinates.
            self.squares[k] += errors[k] * errors[k] / if k == 2 { 2.0 } else { 1.0 };
            self.within[k] += u32::from(errors[k] <= bounds[k]);
        }
        Ok(())
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
}
