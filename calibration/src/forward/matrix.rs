//! Small symmetric matrices in plain loops: the same numbers on every machine.

/// Sweeps of Jacobi's rotations; eight bring a hundred rows to rounding.
const SWEEPS: usize = 12;
/// A row whose remainder after elimination of those before it is below this part of it counts as
/// dependent on them.
const LEAST_LEFT: f64 = 1e-14;

/// A square matrix, by rows.
pub type Matrix = Vec<Vec<f64>>;

/// The lower Cholesky factor of a positive semidefinite matrix. A row that depends on those before
/// it has zeros on the diagonal and below.
pub fn cholesky(mut matrix: Matrix) -> Matrix {
    let count = matrix.len();
    for i in 0..count {
        let whole = matrix[i][i];
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            let left = matrix[i][j] - known;
            matrix[i][j] = match i == j {
                true if left > LEAST_LEFT * whole => left.sqrt(),
                true => 0.0,
                false if matrix[j][j] > 0.0 => left / matrix[j][j],
                false => 0.0,
            };
        }
        matrix[i][i + 1..].fill(0.0);
    }
    matrix
}

/// Eigenvalues and eigenvectors of a symmetric matrix; the largest first.
pub fn principal(matrix: Matrix) -> Vec<(f64, Vec<f64>)> {
    let mut all = eigenvectors(matrix);
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all
}

/// Eigenvalues and eigenvectors of a symmetric matrix by Jacobi's rotations, in the order of its
/// rows.
pub fn eigenvectors(mut matrix: Matrix) -> Vec<(f64, Vec<f64>)> {
    let count = matrix.len();
    let one = |i: usize| (0..count).map(|j| f64::from(u8::from(i == j))).collect();
    let mut directions: Matrix = (0..count).map(one).collect();
    for _ in 0..SWEEPS {
        for i in 0..count {
            for j in i + 1..count {
                if matrix[i][j] == 0.0 {
                    continue;
                }
                let theta = (matrix[j][j] - matrix[i][i]) / (2.0 * matrix[i][j]);
                let tan = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let cos = 1.0 / (tan * tan + 1.0).sqrt();
                let parts = [cos, tan * cos];
                for row in &mut matrix {
                    (row[i], row[j]) = turned(parts, row[i], row[j]);
                }
                rotate(&mut matrix, [i, j], parts);
                rotate(&mut directions, [i, j], parts);
            }
        }
    }
    let values = (0..count).map(|k| matrix[k][k]);
    values.zip(directions).collect()
}

fn turned([cos, sin]: [f64; 2], a: f64, b: f64) -> (f64, f64) {
    (cos * a - sin * b, sin * a + cos * b)
}

/// Rotates two rows of a matrix.
fn rotate(matrix: &mut Matrix, [i, j]: [usize; 2], parts: [f64; 2]) {
    let (before, after) = matrix.split_at_mut(j);
    for (a, b) in before[i].iter_mut().zip(&mut after[0]) {
        (*a, *b) = turned(parts, *a, *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five rows, rank 3.
    fn matrix() -> Matrix {
        let part = |i: usize, k: usize| (((3 * i + 1) * (k + 2)) as f64 * 0.83).sin();
        let entry = |i: usize, j: usize| (0..3).map(|k| part(i, k) * part(j, k)).sum();
        (0..5)
            .map(|i| (0..5).map(|j| entry(i, j)).collect())
            .collect()
    }

    fn assert_is(found: impl Fn(usize, usize) -> f64) {
        for (i, row) in matrix().iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                assert!((found(i, j) - entry).abs() < 1e-12, "{i}, {j}");
            }
        }
    }

    #[test]
    fn a_factors_square_is_the_matrix_whatever_its_rank_is() {
        let factor = cholesky(matrix());
        assert_is(|i, j| (0..5).map(|k| factor[i][k] * factor[j][k]).sum());
        assert!((0..5).all(|i| factor[i][i + 1..].iter().all(|entry| *entry == 0.0)));
    }

    #[test]
    fn a_matrix_is_the_sum_of_its_directions() {
        let all = principal(matrix());
        assert!(all.windows(2).all(|pair| pair[0].0 >= pair[1].0));
        assert!(all[2].0 > 0.01 && all[3].0.abs() < 1e-12);
        assert_is(|i, j| all.iter().map(|(value, of)| value * of[i] * of[j]).sum());
    }
}
