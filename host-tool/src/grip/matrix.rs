//! Vectors and matrices of three rows, and the covariance of a force.

/// A vector along x, y and z.
pub type Vector = [f64; 3];
/// A matrix, row by row.
pub type Matrix = [Vector; 3];

/// The product of two vectors, a number.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The product of two vectors that is across both.
pub fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The sum of two vectors.
pub fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|row| a[row] + b[row])
}

/// A matrix times a vector.
pub fn times(matrix: &Matrix, vector: Vector) -> Vector {
    matrix.map(|row| dot(row, vector))
}

/// A matrix with rows and columns exchanged.
pub fn transposed(matrix: &Matrix) -> Matrix {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix[column][row]))
}

/// M C Mᵀ: the covariance of M v if C is that of v.
pub fn carried(matrix: &Matrix, covariance: &Matrix) -> Matrix {
    let half = matrix.map(|row| times(&transposed(covariance), row));
    half.map(|row| times(matrix, row))
}

/// The matrix that makes a × v of v.
pub fn crossing([x, y, z]: Vector) -> Matrix {
    [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
}

/// The sum of two matrices, times a factor each.
pub fn mixed(a: &Matrix, part_a: f64, b: &Matrix, part_b: f64) -> Matrix {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| part_a * a[row][column] + part_b * b[row][column])
    })
}

/// The roots of a covariance's diagonal: a standard uncertainty for each component.
pub fn sigmas(covariance: &Matrix) -> Vector {
    std::array::from_fn(|row| covariance[row][row].max(0.0).sqrt())
}

/// The covariance of a force, N², from standard uncertainties of its size, N, and its direction,
/// rad. Along the force it is that of its size. Across it, the direction's uncertainty has two
/// equal parts, one for each way.
pub fn covariance(force: Vector, size_sigma: f64, angle_sigma: f64) -> Matrix {
    let square = dot(force, force);
    let across = square * angle_sigma.powi(2) / 2.0;
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let same = if row == column { 1.0 } else { 0.0 };
            let along = match square > 0.0 {
                true => force[row] * force[column] / square,
                // Without a direction the size is uncertain every way.
                false => same,
            };
            along * size_sigma.powi(2) + (same - along) * across
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_covariance_is_that_of_size_along_and_direction_across() {
        let near = |found: Matrix, wanted: Matrix| {
            let pairs = found.as_flattened().iter().zip(wanted.as_flattened());
            for (found, wanted) in pairs {
                assert!((found - wanted).abs() < 1e-15, "{found} {wanted}");
            }
        };
        let (size, angle) = (1e-3, 0.02);
        let across = (0.1 * angle) * (0.1 * angle) / 2.0;
        let wanted = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, 1e-6]];
        near(covariance([0.0, 0.0, -0.1], size, angle), wanted);
        // Turned into x and z by 45°.
        let part = 0.1 / f64::sqrt(2.0);
        let turned = covariance([part, 0.0, -part], size, angle);
        let (sum, less) = ((across + 1e-6) / 2.0, (across - 1e-6) / 2.0);
        let wanted = [[sum, 0.0, less], [0.0, across, 0.0], [less, 0.0, sum]];
        near(turned, wanted);
        let wanted = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]];
        near(covariance([0.0; 3], size, angle), wanted);
    }

    #[test]
    fn a_carried_covariance_is_that_of_the_carried_vector() {
        let turn = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let force = [0.02, -0.01, -0.1];
        let found = carried(&turn, &covariance(force, 1e-3, 0.02));
        let wanted = covariance(times(&turn, force), 1e-3, 0.02);
        let pairs = found.as_flattened().iter().zip(wanted.as_flattened());
        for (found, wanted) in pairs {
            assert!((found - wanted).abs() < 1e-15, "{found} {wanted}");
        }
    }
}
