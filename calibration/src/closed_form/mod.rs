//! The closed form in floats: force from how far the markers move apart and together.
//!
//! A press moves the markers apart, a lateral force moves them together. With r the mean displacement away from the
//! pattern's middle and s the mean displacement, F_x = h(r)·s_x, F_y = h(r)·s_y, F_z = −g(r) − k(r)·|s|²; g, h and k are
//! polynomials of r. It needs a few known loads, where a network needs thousands.

mod fit;
pub(crate) mod least_squares;

use anyhow::{Context, Result, ensure};
use hivtac_sensing::closed_form::{LARGEST_KNOT, ONE};
use hivtac_sensing::model::ClosedFormSpec;
use serde::{Deserialize, Serialize};

use crate::network::INPUTS;

pub use fit::{Effort, fit, left_out};

/// A closed form. Displacements are in px, forces in N.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClosedForm {
    /// From the pattern's middle to each marker at rest, unit vectors (x, y).
    pub directions: [[f64; 2]; 4],
    /// The largest radius it was made from, px.
    pub radius_px: f64,
    /// Coefficients of ρ, ρ², … with ρ = r / `radius_px`, N: without motion apart there is no force.
    pub g: Vec<f64>,
    /// Coefficients of 1, ρ, …, N/px.
    pub h: Vec<f64>,
    /// Coefficients of 1, ρ, …, N/px²; none for zero.
    pub k: Vec<f64>,
}

/// Radius and shift of the markers, px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Mean displacement away from the pattern's middle.
    pub radius: f64,
    /// Mean displacement (x, y).
    pub shift: [f64; 2],
}

/// The most knots that an export uses: interpolation between them then costs 0.05 mN at most, and the file is small.
const KNOTS: usize = 129;

/// Unit vectors from the middle of four markers to each; features as in a data set.
///
/// # Errors
/// When a marker is in the middle.
pub fn directions(rest: &[f64; INPUTS]) -> Result<[[f64; 2]; 4]> {
    let middle = [0, 1].map(|axis| (0..4).map(|k| rest[2 * k + axis]).sum::<f64>() / 4.0);
    let mut directions = [[0.0; 2]; 4];
    for (k, direction) in directions.iter_mut().enumerate() {
        let way = [rest[2 * k] - middle[0], rest[2 * k + 1] - middle[1]];
        let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
        ensure!(length > 0.0, "marker {k} rests in the middle of all four");
        *direction = way.map(|part| part / length);
    }
    Ok(directions)
}

impl Motion {
    /// Of markers with these features that rest at `rest`.
    pub fn of(directions: &[[f64; 2]; 4], features: &[f64; INPUTS], rest: &[f64; INPUTS]) -> Self {
        let moved = |k: usize, axis: usize| features[2 * k + axis] - rest[2 * k + axis];
        let mean = |of: &dyn Fn(usize) -> f64| (0..4).map(of).sum::<f64>() / 4.0;
        Self {
            radius: mean(&|k| moved(k, 0) * directions[k][0] + moved(k, 1) * directions[k][1]),
            shift: [mean(&|k| moved(k, 0)), mean(&|k| moved(k, 1))],
        }
    }
}

/// Σ cᵢ·xⁱ.
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

impl ClosedForm {
    /// The force (N) of markers with these features (px) that rest at `rest`, without the chip's rounding. Beyond the
    /// radius it was made from it answers as at that radius.
    pub fn force_n(&self, features: &[f64; INPUTS], rest: &[f64; INPUTS]) -> [f64; 3] {
        self.force_of(Motion::of(&self.directions, features, rest))
    }

    fn force_of(
        &self,
        Motion {
            radius,
            shift: [x, y],
        }: Motion,
    ) -> [f64; 3] {
        let [g, h, k] = self.curves((radius / self.radius_px).clamp(0.0, 1.0));
        [h * x, h * y, -g - k * (x * x + y * y)]
    }

    fn curves(&self, part: f64) -> [f64; 3] {
        let [g, h, k] = [&self.g, &self.h, &self.k].map(|c| polynomial(c, part));
        [g * part, h, k]
    }

    /// Checks that every number is finite and directions are directions.
    ///
    /// # Errors
    /// Says which part is not.
    pub fn validate(&self) -> Result<()> {
        let finite = |numbers: &[f64]| numbers.iter().all(|n| n.is_finite());
        ensure!(
            self.radius_px.is_finite() && self.radius_px > 0.0,
            "radius_px must be above zero"
        );
        ensure!(
            finite(&self.g) && finite(&self.h) && finite(&self.k),
            "a coefficient is not a finite number"
        );
        let unit = |[x, y]: &[f64; 2]| ((x * x + y * y).sqrt() - 1.0).abs() < 1e-6;
        ensure!(
            self.directions.iter().all(unit),
            "a direction is no unit vector"
        );
        Ok(())
    }

    /// What the chip holds: knots a power of two apart, from nothing to the largest radius. g is made never to fall.
    ///
    /// # Errors
    /// When a number does not fit its field.
    pub fn to_chip(&self) -> Result<ClosedFormSpec> {
        self.validate()?;
        const PX: f64 = 65_536.0;
        let end = self.radius_px * PX;
        let step_bits = (0..=22).find(|&bits| end / f64::from(1_u32 << bits) <= (KNOTS - 1) as f64);
        let step_bits = step_bits.context("the largest radius is more than 8000 px")?;
        let step = f64::from(1_u32 << step_bits);
        let count = (end / step).ceil().max(1.0) as usize + 1;
        let mut lowest = 0.0;
        let knot = |i: usize| {
            let [g, h, k] = self.curves((i as f64 * step / end).min(1.0));
            lowest = g.max(lowest);
            let values = [lowest * 1e6, h * 256e6, k * 256e6];
            let fits = values.iter().all(|v| v.abs() <= f64::from(LARGEST_KNOT));
            ensure!(
                fits,
                "a curve is too steep for the chip at {:.2} px",
                i as f64 * step / PX
            );
            Ok(values.map(|v| v.round() as i32))
        };
        Ok(ClosedFormSpec {
            directions: self
                .directions
                .map(|d| d.map(|part| (part * f64::from(ONE)).round() as i32)),
            step_bits,
            knots: (0..count).map(knot).collect::<Result<_>>()?,
        })
    }
}

#[cfg(test)]
mod tests;
