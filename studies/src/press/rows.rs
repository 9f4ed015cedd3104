//! Errors of many answers, by force.

use anyhow::{Context, Result};
use hivtac_calibration::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_sensor::force::Force;
use hivtac_twin::Load;
use serde::Serialize;

/// How far an answer is off, and its stated 95 % bounds: of the direction, degrees, of |F|, mN, and
/// of the place, µm.
#[derive(Clone, Copy, Debug)]
pub struct Off {
    /// Without sign.
    pub errors: [f64; 3],
    /// What 95 of 100 errors shall lie within.
    pub bounds: [f64; 3],
}

impl Off {
    /// Of a force that was found, by what it truly is.
    ///
    /// # Errors
    /// When the force comes without a place.
    pub fn of(force: &Force, truth: &Load) -> Result<Off> {
        let found = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
        let direction = angle_deg(found, truth.vector_n()).unwrap_or(180.0);
        let magnitude = f64::from(force.magnitude.0) * 1e-3 - 1e3 * truth.magnitude_n();
        let place = force.place.context("the model tells no places")?;
        let [x, y] = truth.offset_mm();
        let far = (f64::from(place.x.0) - 1e3 * x).hypot(f64::from(place.y.0) - 1e3 * y);
        Ok(Off {
            errors: [direction, magnitude.abs(), far],
            bounds: [
                DIRECTION_BOUND * f64::from(force.direction_sigma.0) * 1e-3,
                MAGNITUDE_BOUND * f64::from(force.magnitude_sigma.0) * 1e-3,
                PLACE_BOUND * f64::from(place.sigma.0),
            ],
        })
    }

    /// Whether an error is beyond three standard uncertainties: so much more than its 95 % bound.
    pub fn is_far(&self) -> bool {
        let far = 3.0 / MAGNITUDE_BOUND;
        (0..3).any(|k| self.errors[k] > far * self.bounds[k])
    }

    /// Which errors lie within their bounds.
    pub fn within(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.errors[k] <= self.bounds[k])
    }
}

/// Sums of squares of errors, and how many of them are within what was stated.
#[derive(Clone, Copy, Debug, Default)]
pub struct Errors {
    /// Answers with a force.
    pub count: u32,
    /// Answers without one.
    pub refused: u32,
    /// Of the direction, square degrees; of |F|, mN²; of each coordinate of the place, µm².
    squares: [f64; 3],
    /// How many of them are within their 95 % bounds.
    within: [u32; 3],
}

/// Errors, and how many forces are far beyond what they state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// The errors.
    pub errors: Errors,
    /// Forces of which direction, |F| or place is beyond three stated standard uncertainties.
    pub beyond: u32,
}

impl Tally {
    /// Takes an answer.
    ///
    /// # Errors
    /// When the force comes without a place.
    pub fn add(&mut self, force: Option<&Force>, truth: &Load) -> Result<()> {
        self.errors.add(force, truth)?;
        if let Some(force) = force {
            self.beyond += u32::from(Off::of(force, truth)?.is_far());
        }
        Ok(())
    }

    /// Takes another tally with its own.
    pub fn merge(&mut self, other: &Tally) {
        self.errors.merge(&other.errors);
        self.beyond += other.beyond;
    }
}

/// Root mean squares at a force.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// |F|, mN.
    pub force_mn: u32,
    /// Of the direction, degrees.
    pub direction_deg: f64,
    /// Of |F|, mN.
    pub magnitude_mn: f64,
    /// Of each coordinate of the place, µm.
    pub place_um: f64,
}

impl Errors {
    /// Takes an answer.
    ///
    /// # Errors
    /// When the force comes without a place.
    pub fn add(&mut self, force: Option<&Force>, truth: &Load) -> Result<()> {
        match force {
            Some(force) => self.take(&Off::of(force, truth)?),
            None => self.refused += 1,
        }
        Ok(())
    }

    /// Takes an answer with a force.
    pub fn take(&mut self, off: &Off) {
        self.count += 1;
        for (k, (error, within)) in off.errors.into_iter().zip(off.within()).enumerate() {
            // A place has two coordinates.
            self.squares[k] += error * error / if k == 2 { 2.0 } else { 1.0 };
            self.within[k] += u32::from(within);
        }
    }

    /// Takes other errors with their own.
    pub fn merge(&mut self, other: &Errors) {
        self.count += other.count;
        self.refused += other.refused;
        for k in 0..3 {
            self.squares[k] += other.squares[k];
            self.within[k] += other.within[k];
        }
    }

    /// Root mean squares: of the direction, degrees, of |F|, mN, and of each coordinate of the
    /// place, µm.
    pub fn rms(&self) -> [f64; 3] {
        self.squares.map(|sum| (sum / f64::from(self.count)).sqrt())
    }

    /// Of the errors of each the part within their stated 95 % bounds, per cent.
    pub fn covered(&self) -> [f64; 3] {
        self.within
            .map(|within| 100.0 * f64::from(within) / f64::from(self.count))
    }

    /// The row of a force.
    pub fn row(&self, force_mn: u32) -> Row {
        let [direction_deg, magnitude_mn, place_um] = self.rms();
        Row {
            force_mn,
            direction_deg,
            magnitude_mn,
            place_um,
        }
    }
}
