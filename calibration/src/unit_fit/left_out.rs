//! How good a unit's model is on loads that it was not fitted to.

use anyhow::Result;

use super::descent::Found;
use super::equations::LoadEquations;
use super::linear::{inverse, times};
use super::problem::Problem;

/// How far a sensor would find a load from what is told of it, with a model fitted to all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// |F| found less |F| told, N.
    pub size_n: f64,
    /// Between the directions, degrees.
    pub direction_deg: f64,
    /// The place found less the place told, mm; `None` where nobody noted it.
    pub place_mm: Option<[f64; 2]>,
}

impl Found {
    /// Each load left out of the fit: by the equations where the fit ended, so that nothing is
    /// solved anew.
    ///
    /// # Errors
    /// When the other loads do not tell the unit's numbers, or what is seen of one not the load.
    pub fn left_out(&self, problem: &Problem<'_>) -> Result<Vec<LeftOut>> {
        let of_load = |(number, load): (usize, &LoadEquations)| {
            let mut others = self.solved.whole.clone();
            others.take(load, -1.0);
            let step = times(&inverse(others.matrix)?, &others.side);
            let parts = load.found(&step)?;
            let told = &problem.loads[number];
            let turned = parts[1].hypot(parts[2]) * told.direction_sigma_rad();
            let sigma_mm = told.place_sigma_mm();
            Ok(LeftOut {
                size_n: parts[0] * told.size_n,
                direction_deg: turned.to_degrees(),
                place_mm: (told.each_place_mm.is_finite())
                    .then(|| [3, 4].map(|k| parts[k] * sigma_mm)),
            })
        };
        self.solved.loads.iter().enumerate().map(of_load).collect()
    }
}
