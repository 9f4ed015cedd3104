//! Gauss–Newton steps to the unit that explains the loads best.

use anyhow::{Context, Result, anyhow};
use hivtac_shell::Change;
use rayon::prelude::*;

use super::load::UNKNOWNS;
use super::numbers::Number;
use super::own::FoundNumber;
use super::problem::{At, Problem, Solved, Unknowns};

/// So many loads tell a unit well enough to begin with all of them there.
const FIRST: usize = 16;
/// Where descents begin: how many times more than it does what is seen is taken to scatter at
/// first, and gravity along z, g, which decides to which side a slack film sags.
const STARTS: [(&[f64], f64); 4] = [
    (&[], 0.0),
    (&[100.0, 10.0], 0.0),
    (&[10.0], 0.7),
    (&[10.0], -0.7),
];
/// χ² over the coordinates that are seen of a fit that explains them.
const EXPLAINED: f64 = 1.4;
/// Steps at most, and the change of χ² that ends them.
const ROUNDS: usize = 20;
const SETTLED: f64 = 0.3;
/// χ² over the coordinates above which a fit is far from the loads, and the part of it that a step
/// then takes away at least; with less it does not come near them.
const FAR: f64 = 100.0;
const FAR_SETTLED: f64 = 0.03;
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
        chi_square(&self.at)
    }

    /// The number of the load that is explained worst.
    pub fn worst(&self) -> usize {
        let of_load = |residual: &Vec<f64>| residual.iter().map(|part| part * part).sum::<f64>();
        let squares: Vec<f64> = self.at.residuals.iter().map(of_load).collect();
        let worst = (0..squares.len()).max_by(|a, b| squares[*a].total_cmp(&squares[*b]));
        worst.unwrap_or_default()
    }

    /// How many times larger variances are than they were thought to be, at least 1.
    pub fn scatter(&self) -> f64 {
        self.chi_square().max(1.0)
    }
}

fn chi_square(at: &At) -> f64 {
    let seen = at.residuals.iter().flatten().count() + 2 * at.made.dots_mm.len();
    at.square() / seen as f64
}

/// What a load adds to χ².
fn own_square(parts: &[f64; UNKNOWNS], residual: &[f64]) -> f64 {
    parts.iter().chain(residual).map(|part| part * part).sum()
}

impl Problem<'_> {
    /// What was found of each number.
    pub fn found_numbers(&self, found: &Found) -> Vec<FoundNumber> {
        let parts = self
            .priors
            .iter()
            .zip(&found.at.unknowns.numbers)
            .enumerate();
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
            loads: vec![[0.0; UNKNOWNS]; self.loads.len()],
        }
    }

    /// Descends by some of the loads, from several starts until one explains them, then by all.
    ///
    /// # Errors
    /// When the film finds no equilibrium from any start.
    pub fn found(&self) -> Result<Found> {
        let every = self.loads.len().div_ceil(FIRST);
        let some: Vec<_> = self.loads.iter().step_by(every).cloned().collect();
        let mut first = Problem {
            bench: self.bench,
            loads: &some,
            priors: self.priors.clone(),
            blur: 1.0,
        };
        let mut best: Result<Found> = Err(anyhow!("no start"));
        for (blurs, down) in STARTS {
            let found = first.start(blurs, down);
            let is_better = match (&best, &found) {
                (Ok(best), Ok(found)) => found.chi_square() < best.chi_square(),
                _ => best.is_err(),
            };
            if is_better {
                best = found;
            }
            if best
                .as_ref()
                .is_ok_and(|best| best.chi_square() < EXPLAINED)
            {
                break;
            }
        }
        let best = best?;
        if every == 1 {
            return Ok(best);
        }
        let unknowns = Unknowns {
            numbers: best.at.unknowns.numbers,
            ..self.likeliest()
        };
        let here = self.at(unknowns, Some((&best.at.film, &[])))?;
        self.descend(self.located(here)?)
    }

    /// Descends as if what is seen scattered so many times more than it does, one after the other,
    /// from what is most likely of a film on which gravity pulls so, g.
    fn start(&mut self, blurs: &[f64], down: f64) -> Result<Found> {
        let mut unknowns = self.likeliest();
        let gravity = Number::Film(Change::Down(2));
        for (prior, part) in self.priors.iter().zip(&mut unknowns.numbers) {
            if prior.number == gravity {
                *part = prior.within((down - prior.mean) / prior.sigma);
            }
        }
        let mut found: Option<Found> = None;
        for blur in blurs.iter().copied().chain([1.0]) {
            self.blur = blur;
            let near = found
                .as_ref()
                .map(|found| (&found.at.film, &found.at.states[..]));
            let next = self.descend(self.at(unknowns, near)?)?;
            unknowns = next.at.unknowns.clone();
            found = Some(next);
        }
        found.context("no descent")
    }

    /// Each load where it explains most with the unit as it is, whatever the others do: a place
    /// that is known roughly would spoil steps of all unknowns.
    ///
    /// # Errors
    /// When a state is not stable.
    fn located(&self, mut at: At) -> Result<At> {
        let of_load = |number: usize| {
            let mut parts = at.unknowns.loads[number];
            let mut here = (at.states[number].clone(), at.residuals[number].clone());
            for _ in 0..ROUNDS {
                let step = self.own_step(&at, number, &parts, &here)?;
                let square = own_square(&parts, &here.1);
                let found = LENGTHS.iter().find_map(|length| {
                    let there = std::array::from_fn(|i| parts[i] + length * step[i]);
                    let pressed = self.press(&at, number, &there, &here.0).ok()?;
                    let fell = square - own_square(&there, &pressed.1);
                    (fell > 0.0).then_some((there, pressed, fell))
                });
                let Some((there, pressed, fell)) = found else {
                    break;
                };
                (parts, here) = (there, pressed);
                if fell < SETTLED {
                    break;
                }
            }
            Ok((parts, here))
        };
        let loads = (0..self.loads.len()).into_par_iter().map(of_load);
        let loads: Vec<_> = loads.collect::<Result<_>>()?;
        let (own, pressed): (Vec<_>, Vec<_>) = loads.into_iter().unzip();
        at.unknowns.loads = own;
        (at.states, at.residuals) = pressed.into_iter().unzip();
        Ok(at)
    }

    /// Descends from some values.
    ///
    /// # Errors
    /// When a state is not stable.
    fn descend(&self, mut here: At) -> Result<Found> {
        for round in 1.. {
            let solved = self.solve(&here)?;
            let mut fell = 0.0;
            if round <= ROUNDS {
                for length in LENGTHS {
                    let there = here.unknowns.after(&solved.step, length, &self.priors);
                    let Ok(there) = self.at(there, Some((&here.film, &here.states))) else {
                        continue;
                    };
                    fell = here.square() - there.square();
                    if fell > 0.0 {
                        here = there;
                        break;
                    }
                }
            }
            let least = match chi_square(&here) > FAR {
                true => FAR_SETTLED * here.square(),
                false => SETTLED,
            };
            if fell < least {
                return Ok(Found { at: here, solved });
            }
        }
        unreachable!("the rounds end")
    }
}
