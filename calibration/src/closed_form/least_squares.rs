//! Small linear least squares.

use anyhow::{Result, ensure};

/// The x that makes Σ w·(a·x − b)² least over rows (a, b, w), by the normal equations; columns should be of like size.
///
/// # Errors
/// When the rows do not determine x.
pub(crate) fn solve(rows: &[(Vec<f64>, f64, f64)]) -> Result<Vec<f64>> {
    let n = rows.first().map_or(0, |row| row.0.len());
    let mut system = vec![vec![0.0; n + 1]; n];
    for (a, b, weight) in rows {
        for i in 0..n {
            for j in 0..n {
                system[i][j] += weight * a[i] * a[j];
            }
            system[i][n] += weight * a[i] * b;
        }
    }
    eliminate(&mut system)?;
    let mut x = vec![0.0; n];
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| system[i][j] * x[j]).sum();
        x[i] = (system[i][n] - known) / system[i][i];
    }
    Ok(x)
}

/// Gauss with pivots on the diagonal's column.
fn eliminate(system: &mut [Vec<f64>]) -> Result<()> {
    let n = system.len();
    let scale = (0..n).map(|i| system[i][i]).fold(0.0, f64::max);
    for column in 0..n {
        let by_size =
            |&a: &usize, &b: &usize| system[a][column].abs().total_cmp(&system[b][column].abs());
        let pivot = (column..n).max_by(by_size).unwrap_or(column);
        system.swap(column, pivot);
        let diagonal = system[column][column];
        ensure!(
            diagonal.abs() > 1e-13 * scale && diagonal.is_finite(),
            "the loads do not determine the curves: use more of them, small and large, straight and tilted"
        );
        let (done, below) = system.split_at_mut(column + 1);
        let pivot = &done[column];
        for row in below {
            let factor = row[column] / diagonal;
            let pairs = row.iter_mut().zip(pivot).skip(column);
            pairs.for_each(|(value, top)| *value -= factor * top);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_found() {
        let row = |i: i32| {
            let x = f64::from(i) / 10.0;
            let y = 0.5 - 2.0 * x + 3.0 * x * x * x;
            (vec![1.0, x, x * x, x * x * x], y, 1.0 + x)
        };
        let rows: Vec<_> = (0..11).map(row).collect();
        for (found, expected) in solve(&rows).unwrap().iter().zip([0.5, -2.0, 0.0, 3.0]) {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn what_is_not_determined_is_said() {
        let rows = vec![(vec![1.0, 2.0], 1.0, 1.0), (vec![2.0, 4.0], 2.0, 1.0)];
        assert!(
            solve(&rows)
                .unwrap_err()
                .to_string()
                .contains("more of them")
        );
    }
}
