//! Gauss–Newton steps to the unit that explains the loads best.

use anyhow::Result;

use super::own::FoundNumber;
use super::problem::{At, Problem, Solved, Unknowns};

/// So many loads tell a unit well enough to begin with all of them there.
const FIRST: usize = 14;
/// Steps at most, and the change of χ² that ends them.
const ROUNDS: usize = 20;
const SETTLED: f64 = 0.05;
/// Parts of a step that are tried, the first at which χ² falls is taken.
const LENGTHS: [f64; 4] = [1.0, 0.4, 0.15, 0.05];

/// Where a descent ended.
pub struct Found {
    /// The values, and what they explain.
    pub at: At,
    /// The equations there, and what is known of the numbers.
    pub solved: Solved,
}

impl Found {
    /// χ² over the number of coordinates that were seen.
    pub fn chi_square(&self) -> f64 {
        let seen = self.at.residuals.iter().flatten().count() + 2 * self.at.made.dots_mm.len();
        self.at.square() / seen as f64
    }

    /// How many times larger variances are than they were thought to be, at least 1.
    pub fn scatter(&self) -> f64 {
        self.chi_square().max(1.0)
    }
}

impl Problem<'_> {
    /// What was found of each number.
    pub fn found_numbers(&self, found: &Found) -> Vec<FoundNumber> {
        let parts = self.priors.iter().zip(&found.at.unknowns.numbers).enumerate();
        let of_number = parts.map(|(k, (prior, part))| FoundNumber {
            name: prior.number.name(),
            value: prior.value(*part),
            sigma: prior.sigma * (found.scatter() * found.solved.covariance[k][k]).sqrt(),
        });
        of_number.collect()
    }

    /// Every unknown as it is most likely before there is a load.
    fn likeliest(&self) -> Unknowns {
        Unknowns {
            numbers: vec![0.0; self.priors.len()],
            loads: vec![[0.0; super::load::UNKNOWNS]; self.loads.len()],
        }
    }

    /// Descends from what is most likely: by some of the loads where there are many, then by all.
    ///
    /// # Errors
    /// When the film finds no equilibrium under a load.
    pub fn found(&self) -> Result<Found> {
        let likeliest = self.likeliest();
        if self.loads.len() < 2 * FIRST {
            return self.descend(likeliest);
        }
        let every = self.loads.len().div_ceil(FIRST);
        let some: Vec<_> = self.loads.iter().step_by(every).cloned().collect();
        let first = Problem {
            bench: self.bench,
            loads: &some,
            priors: self.priors.clone(),
        };
        let found = first.descend(first.likeliest())?;
        self.descend(Unknowns {
            numbers: found.at.unknowns.numbers,
            loads: likeliest.loads,
        })
    }

    /// Descends from some values.
    ///
    /// # Errors
    /// When the film finds no equilibrium under a load.
    fn descend(&self, from: Unknowns) -> Result<Found> {
        let mut here = self.at(from, None)?;
        for round in 1.. {
            let solved = self.solve(&here)?;
            let mut fell = 0.0;
            if round <= ROUNDS {
                for length in LENGTHS {
                    let there = here.unknowns.after(&solved.step, length, &self.priors);
                    let Ok(there) = self.at(there, Some(&here)) else {
                        continue;
                    };
                    fell = here.square() - there.square();
                    if fell > 0.0 {
                        here = there;
                        break;
                    }
                }
            }
            if fell < SETTLED {
                return Ok(Found {
                    at: here,
                    solved,
                });
            }
        }
        unreachable!("the rounds end")
    }
}
