//! The errors of a unit's model on loads that it is not fitted to.

use anyhow::Result;

use super::descent::Found;
use super::equations::LoadEquations;
use super::linear::{inverse, times};
use super::problem::Problem;

/// The error of a load that a sensor finds with a model fitted to all other loads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeaveOneOutError {
    /// |F| found less the known |F|, N.
    pub size_n: f64,
    /// Between the directions, degrees.
    pub direction_deg: f64,
    /// The place found less the known place, mm; `None` where nobody noted it.
    pub place_mm: Option<[f64; 2]>,
}

impl Found {
    /// Each load left out of the fit: by the equations where the fit ended, so that nothing is
    /// solved anew.
    ///
    /// # Errors
    /// When the other loads do not tell the unit's numbers, or what is seen of one not the load.
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
                size_n: parts[0] * known.size_n,
                direction_deg: turned.to_degrees(),
                place_mm: (known.each_place_mm.is_finite())
                    .then(|| [3, 4].map(|k| parts[k] * sigma_mm)),
            })
        };
        self.solved.loads.iter().enumerate().map(of_load).collect()
    }
}
