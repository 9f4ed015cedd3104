//! Finds equilibria by Newton's method.
//!
//! An equilibrium is where the energy minus the loads' work is stationary, among displacements in
//! which each guided sum of unknowns has its target. Every step solves the linearized problem by
//! Cholesky's factors, with the guides by their Schur complement. A stiffness that is not positive
//! definite is shifted until it is. Once the guides are met (after one full step: they are linear),
//! a step is shortened until the energy falls. Near the equilibrium the last factors are used
//! again, at a tenth of a step's cost, as long as each use brings the film much nearer.

use crate::ShellError;
use crate::shell::Shell;
use crate::sparse::{Factors, Pattern, Solver};

/// With unbalanced forces below this, N, the film is near: the energy needs no check.
const NEAR_N: f64 = 1e-4;
/// Factors are used again as long as each use leaves less than this part of the unbalanced force.
const NEARER: f64 = 0.25;
/// At equilibrium no unknown has more unbalanced force than this, N.
pub const FORCE_TOLERANCE_N: f64 = 1e-10;
const TARGET_TOLERANCE_MM: f64 = 1e-11;
const MAX_STEPS: usize = 80;
/// The part of the predicted fall of energy that a step must reach (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// The fall of energy below which rounding hides it, N·mm. A full step is then taken.
const HIDDEN_N_MM: f64 = 1e-12;

/// A sum of unknowns with a prescribed value.
pub struct Guide {
    /// The unknowns' weights.
    pub weights: Vec<f64>,
    /// The value of the sum, mm.
    pub target_mm: f64,
}

/// A problem to solve: the film, its load and its guides.
pub struct Problem<'a> {
    /// The film.
    pub shell: &'a Shell,
    /// The force on each unknown, N.
    pub load: Vec<f64>,
    /// A few guides at most.
    pub guides: Vec<Guide>,
}

/// An equilibrium.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The unknowns, mm.
    pub unknowns: Vec<f64>,
    /// The guides' forces, N.
    pub guide_n: Vec<f64>,
    /// Number of Newton steps taken.
    pub steps: usize,
}

/// An energy and its gradient.
type First = (f64, Vec<f64>);

/// A step towards equilibrium, with the force and factors that it was made from.
struct Step {
    step: Vec<f64>,
    guide_n: Vec<f64>,
}

impl Problem<'_> {
    /// Finds the equilibrium from `start`.
    ///
    /// # Errors If no equilibrium is within reach.
    pub fn solve(&self, solver: &Solver, start: &[f64]) -> Result<Solution, ShellError> {
        let mut u = start.to_vec();
        let mut guide_n = vec![0.0; self.guides.len()];
        let mut left_over_n = f64::INFINITY;
        let mut factors = None;
        let mut at = self.shell.first(&u);
        for steps in 0..=MAX_STEPS {
            let missing = self.missing(&u);
            let met = missing.iter().all(|gap| gap.abs() < TARGET_TOLERANCE_MM);
            let before_n = left_over_n;
            left_over_n = largest(&self.left_over(&at.1, &guide_n));
            if left_over_n.is_nan() {
                break;
            }
            // Guides' forces are only known after a step.
            if met && left_over_n < FORCE_TOLERANCE_N && (steps > 0 || guide_n.is_empty()) {
                return Ok(Solution {
                    unknowns: u,
                    guide_n,
                    steps,
                });
            }
            let serves = met && left_over_n < NEAR_N && left_over_n < NEARER * before_n;
            let again = factors.is_some() && serves;
            let known = match factors.filter(|_| serves) {
                Some(known) => known,
                None => shifted_factors(solver, self.shell.pattern(), &self.shell.stiffness(&u))?,
            };
            let step = self.step(&known, &at.1, &missing)?;
            at = match met && !again {
                true => self.shortened(&mut u, &at, &step.step),
                false => {
                    advance(&mut u, &step.step, 1.0);
                    self.shell.first(&u)
                }
            };
            factors = Some(known);
            guide_n = step.guide_n;
        }
        Err(ShellError::NoEquilibrium {
            steps: MAX_STEPS,
            left_over_n,
        })
    }

    /// Returns load + guides' forces − the film's own, for each unknown.
    fn left_over(&self, gradient: &[f64], guide_n: &[f64]) -> Vec<f64> {
        let pairs = self.load.iter().zip(gradient);
        let mut rest: Vec<f64> = pairs.map(|(f, g)| f - g).collect();
        for (guide, force) in self.guides.iter().zip(guide_n) {
            advance(&mut rest, &guide.weights, *force);
        }
        rest
    }

    fn missing(&self, u: &[f64]) -> Vec<f64> {
        let gap = |guide: &Guide| guide.target_mm - inner(&guide.weights, u);
        self.guides.iter().map(gap).collect()
    }

    fn step(
        &self,
        factors: &Factors,
        gradient: &[f64],
        missing: &[f64],
    ) -> Result<Step, ShellError> {
        let count = self.guides.len();
        let unknowns = self.load.len();
        let mut sides = self.left_over(gradient, &vec![0.0; count]);
        for guide in &self.guides {
            sides.extend(&guide.weights);
        }
        factors.solve(&mut sides, 1 + count);
        let mut columns = sides.chunks(unknowns);
        let mut step = columns.next().unwrap_or_default().to_vec();
        let answers: Vec<&[f64]> = columns.collect();
        let guide_n = self.guide_forces(&step, &answers, missing)?;
        for (answer, force) in answers.iter().zip(&guide_n) {
            advance(&mut step, answer, *force);
        }
        Ok(Step { step, guide_n })
    }

    /// Solves the Schur complement: guides' weights · (step + Σ answer · force) = the missing part
    /// of the targets.
    fn guide_forces(
        &self,
        step: &[f64],
        answers: &[&[f64]],
        missing: &[f64],
    ) -> Result<Vec<f64>, ShellError> {
        let row = |guide: &Guide| -> Vec<f64> {
            let parts = answers.iter().map(|answer| inner(&guide.weights, answer));
            parts.collect()
        };
        let matrix = self.guides.iter().map(row).collect();
        let gaps = self.guides.iter().zip(missing);
        let side = gaps.map(|(guide, gap)| gap - inner(&guide.weights, step));
        solve_small(matrix, side.collect())
            .ok_or_else(|| ShellError::Solver("the guides depend on each other".into()))
    }

    /// Takes all of the step, or the half, quarter … at which the energy falls most. Returns the
    /// energy and the gradient there.
    fn shortened(&self, u: &mut Vec<f64>, at: &First, step: &[f64]) -> First {
        let here = at.0 - inner(&self.load, u);
        let slope = inner(&at.1, step) - inner(&self.load, step);
        let look = |length: f64| {
            let mut there = u.clone();
            advance(&mut there, step, length);
            let first = self.shell.first(&there);
            (first.0 - inner(&self.load, &there), there, first)
        };
        let mut length = 1.0;
        let mut best = look(length);
        if slope <= -HIDDEN_N_MM && (best.0.is_nan() || best.0 > here + SUFFICIENT * slope) {
            for _ in 0..30 {
                let half = look(length / 2.0);
                if best.0 <= here + SUFFICIENT * length * slope && best.0 <= half.0 {
                    break;
                }
                length /= 2.0;
                best = half;
            }
        }
        let (_, there, first) = best;
        *u = there;
        first
    }
}

/// Returns the factors of a stiffness, shifted if it is not positive definite.
///
/// # Errors
/// If it has none with any shift.
pub fn shifted_factors(
    solver: &Solver,
    pattern: &Pattern,
    stiffness: &[f64],
) -> Result<Factors, ShellError> {
    if let Some(factors) = solver.factor(pattern, stiffness) {
        return Ok(factors);
    }
    let diagonal = pattern.diagonal();
    let mean = diagonal.iter().map(|&k| stiffness[k].abs()).sum::<f64>();
    let mut shift = 1e-5 * mean / diagonal.len() as f64;
    let mut shifted = stiffness.to_vec();
    for _ in 0..12 {
        for &entry in diagonal {
            shifted[entry] = stiffness[entry] + shift;
        }
        if let Some(factors) = solver.factor(pattern, &shifted) {
            return Ok(factors);
        }
        shift *= 8.0;
    }
    Err(ShellError::Solver("the stiffness has no factors".into()))
}

/// Returns a · b.
pub fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn advance(u: &mut [f64], step: &[f64], length: f64) {
    for (part, add) in u.iter_mut().zip(step) {
        *part += length * add;
    }
}

/// Returns the largest absolute value; NaN if one is NaN.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| {
        if value.is_nan() {
            f64::NAN
        } else {
            value.abs().max(most)
        }
    })
}

/// Gauss elimination with pivoting, for systems of a few unknowns. Returns `None` if the matrix is
/// singular.
pub fn solve_small(mut matrix: Vec<Vec<f64>>, mut side: Vec<f64>) -> Option<Vec<f64>> {
    let n = side.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&a, &b| matrix[a][k].abs().total_cmp(&matrix[b][k].abs()))?;
        matrix.swap(k, pivot);
        side.swap(k, pivot);
        if matrix[k][k] == 0.0 || !matrix[k][k].is_finite() {
            return None;
        }
        for row in k + 1..n {
            let factor = matrix[row][k] / matrix[k][k];
            for column in k..n {
                matrix[row][column] -= factor * matrix[k][column];
            }
            side[row] -= factor * side[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n)
            .map(|column| matrix[k][column] * side[column])
            .sum();
        side[k] = (side[k] - known) / matrix[k][k];
    }
    Some(side)
}
