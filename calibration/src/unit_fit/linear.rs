//! Small dense linear algebra for a fit.

use anyhow::{Result, ensure};

use crate::forward;
pub(crate) use crate::forward::{Matrix, dot};

/// The factor L of a symmetric matrix L·Lᵀ; 0 above its diagonal.
///
/// # Errors
/// When the matrix is not positive definite.
pub fn cholesky(matrix: Matrix) -> Result<Matrix> {
    let factor = forward::cholesky(matrix);
    ensure!(
        (factor.iter().enumerate()).all(|(i, row)| row[i] > 0.0),
        "the loads do not tell the unit's numbers"
    );
    Ok(factor)
}

/// The inverse of a symmetric matrix.
///
/// # Errors
/// When the matrix is not positive definite.
pub fn inverse(matrix: Matrix) -> Result<Matrix> {
    let (count, factor) = (matrix.len(), cholesky(matrix)?);
    // Columns of the factor's inverse, then their products.
    let mut columns = vec![vec![0.0; count]; count];
    for (k, column) in columns.iter_mut().enumerate() {
        for i in k..count {
            let known = dot(&factor[i][k..i], &column[k..i]);
            column[i] = (f64::from(u8::from(i == k)) - known) / factor[i][i];
        }
    }
    let product = |i: usize, j: usize| dot(&columns[i], &columns[j]);
    Ok((0..count)
        .map(|i| (0..count).map(|j| product(i, j)).collect())
        .collect())
}

/// The product of a symmetric matrix and a vector.
pub fn times(matrix: &Matrix, vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, vector)).collect()
}
