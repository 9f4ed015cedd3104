//! Errors of a unit's model on loads that it was not fitted to.

use anyhow::Result;

use super::descent::Found;
use super::equations::LoadEquations;
use super::linear::{inverse, times};
use super::problem::Problem;

/// Difference between a load found with a model fitted to all others, and its stated values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeaveOneOutError {
    /// |F| stated, N.
    pub stated_n: f64,
    /// |F| found minus |F| stated, N.
    pub size_n: f64,
    /// Angle between the two directions, degrees.
    pub direction_deg: f64,
    /// The place found minus the place stated, mm; `None` where nobody noted it.
    pub place_mm: Option<[f64; 2]>,
}

impl Found {
    /// The error of each load when it is left out of the fit. It follows from the equations where
    /// the fit ended, without another solution.
    ///
    /// # Errors
    /// When the other loads do not determine the unit's numbers, or a load's picture does not
    /// determine the load.
    pub fn left_out(&self, problem: &Problem<'_>) -> Result<Vec<LeaveOneOutError>> {
        let of_load = |(number, load): (usize, &LoadEquations)| {
            let mut others = self.solved.whole.clone();
            others.take(load, -1.0);
            let step = times(&inverse(others.matrix)?, &others.side);
            let parts = load.found(&step)?;
            let known = &problem.loads[number];
            let turned = parts[1].hypot(parts[2]) * known.direction_sigma_rad();
            let sigma_mm = known.place_sigma_mm();
            Ok(LeaveOneOutError {
                stated_n: known.magnitude_n(),
                size_n: parts[0] * known.size_n,
                direction_deg: turned.to_degrees(),
                place_mm: (known.each_place_mm.is_finite())
                    .then(|| [3, 4].map(|k| parts[k] * sigma_mm)),
            })
        };
        self.solved.loads.iter().enumerate().map(of_load).collect()
    }
}
