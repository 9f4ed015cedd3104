//! Fits sums of terms to samples, and splines through nodes, in plain loops: the same numbers on
//! every machine.

use anyhow::{Result, ensure};
use hivtac_twin::film::reduced::Axis;

/// Terms whose remainder after Gram–Schmidt is below this fraction of the largest cannot be
/// distinguished.
const LEAST_LENGTH: f64 = 1e-9;

/// Fits coefficients of terms to samples at fixed loads.
pub struct LeastSquares {
    /// Orthonormal columns, by term.
    units: Vec<Vec<f64>>,
    /// Each column in parts of the units up to its own, by term.
    parts: Vec<Vec<f64>>,
}

impl LeastSquares {
    /// From the terms' values, a row for each sample.
    ///
    /// # Errors
    /// When the samples do not distinguish the terms.
    pub fn new(rows: &[Vec<f64>]) -> Result<Self> {
        let terms = rows.first().map_or(0, Vec::len);
        let (mut units, mut parts) = (Vec::<Vec<f64>>::new(), Vec::new());
        let mut largest = 0.0_f64;
        for term in 0..terms {
            let mut column: Vec<f64> = rows.iter().map(|row| row[term]).collect();
            let mut of = vec![0.0; term + 1];
            // Gram–Schmidt, twice: the second pass removes rounding errors.
            for _ in 0..2 {
                for (unit, part) in units.iter().zip(&mut of) {
                    let along = dot(unit, &column);
                    *part += along;
                    add(&mut column, unit, -along);
                }
            }
            let own = dot(&column, &column).sqrt();
            largest = largest.max(own);
            ensure!(
                own > LEAST_LENGTH * largest,
                "the samples do not tell the terms apart"
            );
            of[term] = own;
            column.iter_mut().for_each(|part| *part /= own);
            units.push(column);
            parts.push(of);
        }
        Ok(Self { units, parts })
    }

    /// The coefficients with the least squared differences from these samples.
    pub fn coefficients(&self, samples: &[f64]) -> Vec<f64> {
        let mut left = samples.to_vec();
        let mut along = Vec::with_capacity(self.units.len());
        for unit in &self.units {
            let part = dot(unit, &left);
            add(&mut left, unit, -part);
            along.push(part);
        }
        for term in (0..along.len()).rev() {
            along[term] /= self.parts[term][term];
            let found = along[term];
            for (k, part) in self.parts[term][..term].iter().enumerate() {
                along[k] -= part * found;
            }
        }
        along
    }
}

/// The coefficients of splines through rows of numbers at the nodes of axes along x and y. By node
/// along y and, within, along x.
pub fn splines([x, y]: [&Axis; 2], rows: &[Vec<Vec<f64>>]) -> Result<Vec<Vec<Vec<f64>>>> {
    let [x, y] = [x, y].map(|axis| LeastSquares::new(&collocation(axis)));
    Ok(turned(&y?, &turned(&x?, rows)))
}

/// The splines' values at each node.
fn collocation(axis: &Axis) -> Vec<Vec<f64>> {
    let count = axis.nodes().len();
    let row = |node: &f64| {
        let weights = axis.at(*node);
        let mut row = vec![0.0; count];
        row[weights.first..weights.first + weights.values.len()].copy_from_slice(&weights.values);
        row
    };
    axis.nodes().iter().map(row).collect()
}

/// Solves along the inner axis and makes the outer axis the inner one.
fn turned(through: &LeastSquares, rows: &[Vec<Vec<f64>>]) -> Vec<Vec<Vec<f64>>> {
    let (outer, inner, numbers) = (rows.len(), rows[0].len(), rows[0][0].len());
    let mut all = vec![vec![vec![0.0; numbers]; outer]; inner];
    for (outer, line) in rows.iter().enumerate() {
        for number in 0..numbers {
            let samples: Vec<f64> = line.iter().map(|at| at[number]).collect();
            for (inner, value) in through.coefficients(&samples).into_iter().enumerate() {
                all[inner][outer][number] = value;
            }
        }
    }
    all
}

/// a · b.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], other: &[f64], part: f64) {
    for (to, other) in to.iter_mut().zip(other) {
        *to += part * other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_come_back() {
        let row = |k: usize| {
            (0..6)
                .map(|i| ((k * (i + 1)) as f64 * 0.37).sin())
                .collect()
        };
        let rows: Vec<Vec<f64>> = (0..30).map(row).collect();
        let own = [1.0, -2.0, 0.5, 3.0, -0.25, 1.5];
        let samples: Vec<f64> = rows.iter().map(|row| dot(row, &own)).collect();
        let found = LeastSquares::new(&rows).unwrap().coefficients(&samples);
        assert!(found.iter().zip(own).all(|(a, b)| (a - b).abs() < 1e-12));
        let alike: Vec<Vec<f64>> = rows.iter().map(|row| vec![row[0], 2.0 * row[0]]).collect();
        assert!(LeastSquares::new(&alike).is_err());
    }

    #[test]
    fn splines_go_through_their_nodes() {
        let x_axis = Axis::new(&[-2.0, -1.0, 0.0, 0.5, 1.5, 3.0]);
        let y_axis = Axis::new(&[-1.5, -1.0, 0.0, 0.5, 1.0, 2.0, 3.0]);
        let value = |x: f64, y: f64| vec![x * x * y + y, x.sin() * y.cos()];
        let line = |y: &f64| x_axis.nodes().iter().map(|x| value(*x, *y)).collect();
        let rows: Vec<_> = y_axis.nodes().iter().map(line).collect();
        let found = splines([&x_axis, &y_axis], &rows).unwrap();
        for (x, y) in [(0.5, -1.0), (-2.0, 3.0), (1.5, 0.0)] {
            let (along_x, along_y) = (x_axis.at(x), y_axis.at(y));
            for (k, expected) in value(x, y).into_iter().enumerate() {
                let mut sum = 0.0;
                for (j, down) in along_y.values.iter().enumerate() {
                    for (i, right) in along_x.values.iter().enumerate() {
                        sum += down * right * found[along_y.first + j][along_x.first + i][k];
                    }
                }
                assert!((sum - expected).abs() < 1e-9, "{x} {y} {k}");
            }
        }
    }
}
