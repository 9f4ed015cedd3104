//! Normal equations of a unit's numbers, and each load's contribution to them.

use anyhow::Result;

use super::linear::{Matrix, dot, inverse, times};
use super::load::UNKNOWNS;
use super::numbers::Prior;

/// Derivatives of a load's residual.
pub struct LoadSlopes {
    /// By number.
    pub numbers: Vec<Vec<f64>>,
    /// By the load's own unknowns.
    pub own: Vec<Vec<f64>>,
}

/// Normal equations of a unit's numbers.
#[derive(Clone)]
pub struct Normal {
    /// Their matrix.
    pub matrix: Matrix,
    /// Their right side.
    pub side: Vec<f64>,
}

impl Normal {
    /// The prior alone, for numbers that many standard deviations from their means.
    pub fn before(numbers: &[f64]) -> Normal {
        let count = numbers.len();
        let row = |i: usize| (0..count).map(|j| f64::from(u8::from(i == j))).collect();
        Normal {
            matrix: (0..count).map(row).collect(),
            side: numbers.iter().map(|part| -part).collect(),
        }
    }

    /// Adds equations: columns by number, and the residual.
    pub fn add(&mut self, columns: &[Vec<f64>], residual: &[f64]) {
        for (i, left) in columns.iter().enumerate() {
            for (j, right) in columns.iter().enumerate() {
                self.matrix[i][j] += dot(left, right);
            }
            self.side[i] -= dot(left, residual);
        }
    }

    /// The step that solves the equations and keeps every number in its range. `at` holds the
    /// numbers, in standard deviations from their means. A number that would leave its range stops
    /// at its end, and the others are solved again. `damping` is added to each number's prior.
    ///
    /// # Errors
    /// When the equations do not determine the numbers.
    pub fn step_within(&self, priors: &[Prior], at: &[f64], damping: f64) -> Result<Vec<f64>> {
        let mut damped = self.clone();
        for k in 0..at.len() {
            damped.matrix[k][k] += damping;
        }
        let mut held: Vec<Option<f64>> = vec![None; at.len()];
        loop {
            let step = damped.step_with(&held)?;
            let mut is_within = true;
            for (k, prior) in priors.iter().enumerate() {
                let there = at[k] + step[k];
                let within = prior.within(there);
                if held[k].is_none() && within != there {
                    held[k] = Some(within - at[k]);
                    is_within = false;
                }
            }
            if is_within {
                return Ok(step);
            }
        }
    }

    /// The solution in which some steps are given.
    fn step_with(&self, held: &[Option<f64>]) -> Result<Vec<f64>> {
        let Normal {
            mut matrix,
            mut side,
        } = self.clone();
        for (k, step) in held.iter().enumerate() {
            let Some(step) = step else { continue };
            for (i, side) in side.iter_mut().enumerate() {
                *side -= matrix[i][k] * step;
                matrix[i][k] = 0.0;
                matrix[k][i] = 0.0;
            }
            matrix[k][k] = 1.0;
        }
        for (side, held) in side.iter_mut().zip(held) {
            *side = held.unwrap_or(*side);
        }
        Ok(times(&inverse(matrix)?, &side))
    }

    /// Adds this part of a load's contribution; −1 takes it out.
    pub fn take(&mut self, load: &LoadEquations, part: f64) {
        for (sum, row) in self.matrix.iter_mut().zip(&load.said.matrix) {
            for (sum, entry) in sum.iter_mut().zip(row) {
                *sum += part * entry;
            }
        }
        for (sum, entry) in self.side.iter_mut().zip(&load.said.side) {
            *sum += part * entry;
        }
    }
}

/// The equations of one load, its own unknowns eliminated.
pub struct LoadEquations {
    /// Its contribution to the equations of the unit's numbers.
    said: Normal,
    /// Derivatives of its residual by the numbers, and by its own unknowns.
    slopes: LoadSlopes,
    residual: Vec<f64>,
    /// Its own unknowns: their values, their covariance, and the right side of their equations.
    at: [f64; UNKNOWNS],
    own: Matrix,
    own_side: Vec<f64>,
    /// By number: products with the own unknowns' slopes.
    mixed: Matrix,
}

impl LoadEquations {
    /// From the residual and its slopes, and the values of the load's own unknowns.
    ///
    /// # Errors
    /// When the equations of its own unknowns have no solution.
    pub fn new(slopes: LoadSlopes, residual: &[f64], at: &[f64; UNKNOWNS]) -> Result<Self> {
        let count = slopes.numbers.len();
        let mut said = Normal {
            matrix: vec![vec![0.0; count]; count],
            side: vec![0.0; count],
        };
        said.add(&slopes.numbers, residual);
        let mut before = Normal::before(at);
        before.add(&slopes.own, residual);
        let (own, own_side) = (inverse(before.matrix)?, before.side);
        let products = |column: &Vec<f64>| slopes.own.iter().map(|own| dot(column, own)).collect();
        let mixed: Matrix = slopes.numbers.iter().map(products).collect();
        for i in 0..count {
            let taken = times(&own, &mixed[i]);
            for (entry, mixed) in said.matrix[i].iter_mut().zip(&mixed) {
                *entry -= dot(&taken, mixed);
            }
            said.side[i] -= dot(&taken, &own_side);
        }
        Ok(Self {
            said,
            slopes,
            residual: residual.to_vec(),
            at: *at,
            own,
            own_side,
            mixed,
        })
    }

    /// The step of its own unknowns when the numbers take this step.
    pub fn step(&self, numbers: &[f64]) -> [f64; UNKNOWNS] {
        let mut left = self.own_side.clone();
        for (row, step) in self.mixed.iter().zip(numbers) {
            for (left, part) in left.iter_mut().zip(row) {
                *left -= part * step;
            }
        }
        let step = times(&self.own, &left);
        std::array::from_fn(|i| step[i])
    }

    /// How far from its stated values a sensor would find the load, in parts of their
    /// uncertainties, after this step of the numbers. Uses the seen coordinates only, without the
    /// load's stated values.
    ///
    /// # Errors
    /// When the seen coordinates do not determine the load's unknowns.
    pub fn found(&self, numbers: &[f64]) -> Result<[f64; UNKNOWNS]> {
        let mut residual = self.residual.clone();
        let columns = self.slopes.numbers.iter().zip(numbers);
        let own = self.slopes.own.iter().zip(&self.at);
        let of_own = own.map(|(column, at)| (column, -at));
        for (column, part) in columns.map(|(column, part)| (column, *part)).chain(of_own) {
            for (sum, slope) in residual.iter_mut().zip(column) {
                *sum += part * slope;
            }
        }
        let row = |a: &Vec<f64>| self.slopes.own.iter().map(|b| dot(a, b)).collect();
        let known = inverse(self.slopes.own.iter().map(row).collect())?;
        let side = self.slopes.own.iter().map(|column| -dot(column, &residual));
        let found = times(&known, &side.collect::<Vec<_>>());
        Ok(std::array::from_fn(|i| found[i]))
    }
}
