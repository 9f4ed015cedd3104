//! How well the markers tell the parts of a load.

use hivtac_sensor::force::forward::{Estimate, Forward, UNKNOWNS};

/// Jacobi's rotations sweep so often at most: four or five bring five rows to rounding.
const SWEEPS: usize = 12;

/// The condition of the weighted Jacobian at a load, with unknowns in parts of |F|, radians and
/// millimetres: its largest singular value over its smallest. `None` where the markers do not tell
/// the load's parts.
pub fn condition(forward: &Forward<'_>, estimate: &Estimate) -> Option<f64> {
    let solved = estimate.solved.as_ref()?;
    let size = estimate.pose.size;
    let per_size = forward.stiffness.per_size_n(size) / forward.stiffness.magnitude_n(size);
    let scales = [f64::from(per_size), 1.0, 1.0, 1.0, 1.0];
    // The covariance is the inverse of the Jacobian's square.
    let covariance = std::array::from_fn(|a| {
        std::array::from_fn(|b| scales[a] * scales[b] * f64::from(solved.covariance(a, b)))
    });
    let values = eigenvalues(covariance);
    let largest = values.iter().copied().fold(f64::MIN, f64::max);
    let smallest = values.iter().copied().fold(f64::MAX, f64::min);
    (smallest > 0.0).then(|| (largest / smallest).sqrt())
}

/// Of a symmetric matrix, by Jacobi's rotations.
fn eigenvalues(mut a: [[f64; UNKNOWNS]; UNKNOWNS]) -> [f64; UNKNOWNS] {
    for _ in 0..SWEEPS {
        for p in 0..UNKNOWNS {
            for q in p + 1..UNKNOWNS {
                rotate(&mut a, p, q);
            }
        }
    }
    std::array::from_fn(|k| a[k][k])
}

/// Turns rows and columns p and q so that they have nothing in common.
fn rotate(a: &mut [[f64; UNKNOWNS]; UNKNOWNS], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cosine = 1.0 / tangent.hypot(1.0);
    let sine = tangent * cosine;
    for row in a.iter_mut() {
        (row[p], row[q]) = (
            cosine * row[p] - sine * row[q],
            sine * row[p] + cosine * row[q],
        );
    }
    let (from, to) = (a[p], a[q]);
    for k in 0..UNKNOWNS {
        a[p][k] = cosine * from[k] - sine * to[k];
        a[q][k] = sine * from[k] + cosine * to[k];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_known_matrices() {
        // 2 on the diagonal, −1 beside it: 2 − 2 cos(kπ/6).
        let band = std::array::from_fn(|i: usize| {
            std::array::from_fn(|j: usize| match i.abs_diff(j) {
                0 => 2.0,
                1 => -1.0,
                _ => 0.0,
            })
        });
        let mut values = eigenvalues(band);
        values.sort_by(f64::total_cmp);
        for (k, value) in (1..).zip(values) {
            let expected = 2.0 - 2.0 * (f64::from(k) * std::f64::consts::PI / 6.0).cos();
            assert!((value - expected).abs() < 1e-12, "{value} {expected}");
        }
    }
}
