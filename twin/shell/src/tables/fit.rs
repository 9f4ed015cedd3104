//! Fits terms to samples, and splines to nodes.

use faer::prelude::*;
use hivtac_twin::film::reduced::{Axis, Pose, Terms};

use crate::ShellError;

/// Weight of the derivatives by size and by tilt in the fit; the value itself has weight 1.
const SLOPES_COUNT: f64 = 0.05;

/// Smallest ratio of the least determined term to the best determined one.
const LEAST_RATIO: f64 = 1e-7;

/// The known outputs at a load: their values, and their derivatives by size and tilt if they are
/// known.
pub struct Known {
    /// The load.
    pub pose: Pose,
    /// The outputs.
    pub values: Vec<f64>,
    /// Their derivatives by size and by tilt along x and y, 1/rad.
    pub slopes: Option<[Vec<f64>; 3]>,
}

/// Returns the coefficients of terms for each output that fit the known values best, by output and
/// term.
///
/// # Errors
/// If too little is known.
pub fn nearest(terms: &Terms, known: &[Known]) -> Result<Vec<f64>, ShellError> {
    let outputs = known.first().map_or(0, |one| one.values.len());
    let (mut rows, mut sides): (Vec<Vec<f64>>, Vec<Vec<f64>>) = Default::default();
    for one in known {
        let [values, slopes @ ..] = terms.rows(&one.pose);
        if one.pose.size > 0.0 {
            rows.push(values);
            sides.push(one.values.clone());
        }
        for (row, side) in slopes.into_iter().zip(one.slopes.iter().flatten()) {
            rows.push(row.iter().map(|part| SLOPES_COUNT * part).collect());
            sides.push(side.iter().map(|part| SLOPES_COUNT * part).collect());
        }
    }
    let count = terms.count();
    if rows.len() < count {
        return Err(ShellError::Solver(format!(
            "{} equations for {count} terms: solve for more loads",
            rows.len()
        )));
    }
    let matrix = Mat::from_fn(rows.len(), count, |i, j| rows[i][j]);
    let sides = Mat::from_fn(sides.len(), outputs, |i, j| sides[i][j]);
    let factors = matrix.col_piv_qr();
    let triangle = factors.thin_R();
    if triangle[(count - 1, count - 1)].abs() < LEAST_RATIO * triangle[(0, 0)].abs() {
        return Err(ShellError::Solver(
            "the loads do not tell the terms apart: solve for more tilts".into(),
        ));
    }
    let solved = factors.solve_lstsq(sides);
    let all = (0..outputs).flat_map(|output| (0..count).map(move |term| (output, term)));
    let found: Vec<f64> = all.map(|(output, term)| solved[(term, output)]).collect();
    Ok(found)
}

/// Rows of numbers at nodes along two axes.
type Nodes = Vec<Vec<Vec<f64>>>;

/// Returns the coefficients of splines through rows of numbers at an axis' nodes, along y and,
/// within, along x.
pub fn splines(axis: &Axis, rows: Nodes) -> Nodes {
    let inverse = inverse(axis);
    turned(&inverse, &turned(&inverse, &rows))
}

/// Returns the matrix that makes coefficients of splines from values at an axis' nodes.
pub fn inverse(axis: &Axis) -> Mat<f64> {
    let count = axis.nodes().len();
    let mut matrix = Mat::<f64>::zeros(count, count);
    for (i, node) in axis.nodes().iter().enumerate() {
        let weights = axis.at(*node);
        for (k, part) in weights.values.into_iter().enumerate() {
            matrix[(i, weights.first + k)] = part;
        }
    }
    matrix
        .partial_piv_lu()
        .solve(Mat::<f64>::identity(count, count))
}

/// Solves along the inner axis, and exchanges the axes.
fn turned(inverse: &Mat<f64>, rows: &Nodes) -> Nodes {
    let mixed = |own: usize, line: &Vec<Vec<f64>>| {
        let mut sum = vec![0.0; line[0].len()];
        for (k, row) in line.iter().enumerate() {
            for (sum, value) in sum.iter_mut().zip(row) {
                *sum += inverse[(own, k)] * value;
            }
        }
        sum
    };
    let of_line = |own: usize| rows.iter().map(|line| mixed(own, line)).collect();
    (0..rows.len()).map(of_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_come_back_from_values_and_slopes() {
        let terms = Terms::up_to(3, 2, 1);
        let own: Vec<f64> = (0..terms.count()).map(|k| (k as f64).sin()).collect();
        let known_at = |k: usize| {
            let pose = Pose {
                size: 0.1 + 0.07 * (k % 6) as f64,
                tilt: [0.3 * (k as f64).sin(), 0.4 * (1.7 * k as f64).cos()],
                place_mm: [0.0; 2],
            };
            let known = terms.rows(&pose).map(|row| {
                let products = row.iter().zip(&own).map(|(a, b)| a * b);
                vec![products.sum::<f64>()]
            });
            let [values, slopes @ ..] = known;
            Known {
                pose,
                values,
                slopes: Some(slopes),
            }
        };
        let known: Vec<Known> = (0..9).map(known_at).collect();
        for (a, b) in nearest(&terms, &known).unwrap().iter().zip(&own) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        assert!(nearest(&terms, &known[..1]).is_err());
        let alike: Vec<Known> = (0..9).map(|_| known_at(1)).collect();
        assert!(nearest(&terms, &alike).is_err(), "one load, nine times");
    }

    #[test]
    fn splines_go_through_their_nodes() {
        let axis = Axis::new(&[-2.0, -1.0, 0.0, 0.5, 1.5, 3.0]);
        let value = |x: f64, y: f64| vec![x * x * y + y, x.sin() * y.cos()];
        let line = |y: &f64| axis.nodes().iter().map(|x| value(*x, *y)).collect();
        let found = splines(&axis, axis.nodes().iter().map(line).collect());
        for (x, y) in [(0.5, -1.0), (-2.0, 3.0), (1.5, 0.0)] {
            let [along_x, along_y] = [x, y].map(|part| axis.at(part));
            for (k, expected) in value(x, y).into_iter().enumerate() {
                let mut sum = 0.0;
                for j in 0..4 {
                    for i in 0..4 {
                        let part = along_x.values[i] * along_y.values[j];
                        sum += part * found[along_y.first + j][along_x.first + i][k];
                    }
                }
                assert!((sum - expected).abs() < 1e-9, "{x} {y} {k}");
            }
        }
    }
}
