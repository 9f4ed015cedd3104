//! Finds the unit that explains the loads best, by Gauss–Newton steps.

use anyhow::{Result, anyhow};
use hivtac_shell::Change;

use super::load::UNKNOWNS;
use super::numbers::Number;
use super::own_film::FoundNumber;
use super::problem::{At, Problem, Solved, Trust, Unknowns};
use crate::loads::SeenLoad;
use crate::parallel;

/// With more loads than this, the descent begins with a selection of them; it determines a unit
/// well enough to continue with all of them from there.
const FIRST: usize = 16;
/// Where descents begin: whether the film is at first taut and weightless, and gravity along z, g,
/// which decides to which side a slack film sags. How far a barely taut film sags is far from
/// linear, so steps from afar do not reach it.
const STARTS: [(bool, f64); 4] = [(true, 0.0), (false, 0.0), (false, 0.7), (false, -0.7)];
/// The least stretch of a taut film.
const TAUT: f64 = 1e-3;
/// The trust of each stage of a descent, in order.
const TRUSTS: [Trust; 3] = [apart(100.0), apart(10.0), Trust::WHOLE];
/// χ² over the number of seen coordinates below which a fit explains them.
pub const EXPLAINED: f64 = 1.4;
/// The greatest excess of the nominal family's χ² over its expectation, in standard deviations.
const BY_CHANCE: f64 = 3.0;
/// The greatest number of steps.
const ROUNDS: usize = 20;
/// Steps end when χ² falls by less than this.
const SETTLED: f64 = 0.3;
/// χ² over the number of coordinates above which a fit is far from the loads.
const FAR: f64 = 100.0;
/// There, steps end when they lower χ² by less than this part of it: they then do not come near the
/// loads.
const FAR_SETTLED: f64 = 0.03;
/// Damping factors, tried in order until χ² falls (Levenberg–Marquardt): each is added to the prior
/// of every number, in parts of that prior.
const DAMPINGS: [f64; 6] = [0.0, 3.0, 30.0, 300.0, 3e3, 3e4];
/// Parts of a load's own step that are tried; the first at which χ² falls is taken.
const LENGTHS: [f64; 4] = [1.0, 0.4, 0.15, 0.05];

const fn apart(blur: f64) -> Trust {
    Trust {
        blur,
        from_rest: false,
    }
}

/// Where a descent ended.
pub struct Found {
    /// The unknowns there, and the film and residuals that follow from them.
    pub at: At,
    /// The equations there, and the covariance of the numbers.
    pub solved: Solved,
}

impl Found {
    /// χ² over the number of coordinates that were seen.
    pub fn chi_square(&self) -> f64 {
        chi_square(&self.at)
    }

    /// Index of the load that the fit explains worst.
    pub fn worst(&self) -> usize {
        let of_load = |residual: &Vec<f64>| residual.iter().map(|part| part * part).sum::<f64>();
        let squares: Vec<f64> = self.at.residuals.iter().map(of_load).collect();
        let worst = (0..squares.len()).max_by(|a, b| squares[*a].total_cmp(&squares[*b]));
        worst.unwrap_or_default()
    }

    /// Factor by which variances exceed the stated ones, at least 1.
    pub fn scatter(&self) -> f64 {
        self.chi_square().max(1.0)
    }
}

fn chi_square(at: &At) -> f64 {
    at.square() / coordinates(at) as f64
}

/// How many coordinates were seen.
fn coordinates(at: &At) -> usize {
    at.residuals.iter().flatten().count() + 2 * at.made.dots_mm.len()
}

/// A load's contribution to χ².
fn own_square(parts: &[f64; UNKNOWNS], residual: &[f64]) -> f64 {
    parts.iter().chain(residual).map(|part| part * part).sum()
}

impl Problem<'_> {
    /// Value and standard uncertainty of each number.
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

    /// Every unknown at its prior mean.
    fn likeliest(&self) -> Unknowns {
        Unknowns {
            numbers: vec![0.0; self.priors.len()],
            loads: vec![[0.0; UNKNOWNS]; self.loads.len()],
        }
    }

    /// Descends from the prior means. `None` when that does not explain all that is seen, or the
    /// film finds no equilibrium.
    ///
    /// # Errors
    /// When a state is not stable.
    pub fn explained(&self) -> Result<Option<Found>> {
        let some = self.some();
        let first = self.with(&some);
        let is_explained = |found: &Found| {
            let seen = coordinates(&found.at) as f64;
            found.at.square() < seen + BY_CHANCE * (2.0 * seen).sqrt()
        };
        let Some(best) = first.start(false, 0.0).ok().filter(is_explained) else {
            return Ok(None);
        };
        Ok(Some(self.with_all(&some, best)?).filter(is_explained))
    }

    /// Descends by some of the loads, from several starts until one explains them; then by all
    /// loads.
    ///
    /// # Errors
    /// When the film finds no equilibrium from any start.
    pub fn found(&self) -> Result<Found> {
        let some = self.some();
        let first = self.with(&some);
        let mut best: Result<Found> = Err(anyhow!("no start"));
        for (taut, down) in STARTS {
            let found = first.start(taut, down);
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
        self.with_all(&some, best?)
    }

    /// The selection of loads to begin with.
    fn some(&self) -> Vec<SeenLoad> {
        let every = self.loads.len().div_ceil(FIRST);
        self.loads.iter().step_by(every).cloned().collect()
    }

    /// The same problem with other loads.
    fn with<'b>(&'b self, loads: &'b [SeenLoad]) -> Problem<'b> {
        Problem {
            bench: self.bench,
            loads,
            family: self.family,
            priors: self.priors.clone(),
            trust: self.trust,
        }
    }

    /// Descends by all loads from the fit of some of them.
    fn with_all(&self, some: &[SeenLoad], best: Found) -> Result<Found> {
        if some.len() == self.loads.len() {
            return Ok(best);
        }
        let unknowns = Unknowns {
            numbers: best.at.unknowns.numbers,
            ..self.likeliest()
        };
        let here = self.at(unknowns, Some((&best.at.film, &[])))?;
        self.descend(self.located(here)?)
    }

    /// Descends with growing trust from the prior means, with gravity along z at `down`, g. If
    /// `taut`, the film is taut and weightless at first.
    fn start(&self, taut: bool, down: f64) -> Result<Found> {
        let mut unknowns = self.likeliest();
        let mut way = Problem {
            priors: self.priors.clone(),
            ..*self
        };
        for (prior, part) in way.priors.iter_mut().zip(&mut unknowns.numbers) {
            match prior.number {
                Number::Film(Change::Down(2)) if taut => prior.range = [0.0; 2],
                Number::Film(Change::Down(2)) => {
                    *part = prior.within((down - prior.mean) / prior.sigma);
                }
                Number::Film(Change::Stretch(_)) if taut => prior.range[0] = TAUT,
                _ => {}
            }
        }
        let [first, rest @ ..] = TRUSTS;
        way.trust = first;
        let mut found = way.descend(way.at(unknowns, None)?)?;
        for trust in rest {
            way.trust = trust;
            found = way.go_on(found)?;
        }
        if taut {
            found = self.go_on(found)?;
        }
        Ok(found)
    }

    /// Descends from where another descent ended.
    fn go_on(&self, from: Found) -> Result<Found> {
        let near = Some((&from.at.film, &from.at.states[..]));
        self.descend(self.at(from.at.unknowns.clone(), near)?)
    }

    /// Moves each load to its best place and force with the unit held as it is, independently of
    /// the other loads. A roughly known place would spoil steps of all unknowns.
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
        let loads = parallel::try_map(self.loads.len(), of_load)?;
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
        let mut solved = self.solve(&here)?;
        let mut least_damped = 0;
        for round in 1.. {
            let mut dampings = DAMPINGS.iter().enumerate().skip(least_damped);
            let shorter = dampings.find_map(|(k, damping)| {
                let step = solved.step(&self.priors, &here.unknowns, *damping).ok()?;
                let there = here.unknowns.after(&step, &self.priors);
                let there = self.at(there, Some((&here.film, &here.states))).ok()?;
                let fell = here.square() - there.square();
                // A film that is about to snap has no slopes.
                let next = (fell > 0.0).then(|| self.solve(&there))?.ok()?;
                Some((there, next, fell, k))
            });
            let Some((there, next, fell, damped)) = shorter else {
                return Ok(Found { at: here, solved });
            };
            (here, solved) = (there, next);
            least_damped = damped.saturating_sub(1);
            let least = match chi_square(&here) > FAR {
                true => FAR_SETTLED * here.square(),
                false => SETTLED,
            };
            if round >= ROUNDS || fell < least {
                return Ok(Found { at: here, solved });
            }
        }
        unreachable!("the rounds end")
    }
}
