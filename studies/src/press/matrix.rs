//! Small symmetric matrices.

use anyhow::{Result, ensure};

/// L with A = L·Lᵀ, zero above its diagonal.
///
/// # Errors
/// When A is not positive definite.
pub fn cholesky<const N: usize>(a: &[[f64; N]; N]) -> Result<[[f64; N]; N]> {
    let mut l = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let left = a[i][j] - known;
            if i == j {
                ensure!(
                    left > 0.0,
                    "a matrix of covariances or information is singular"
                );
                l[i][i] = left.sqrt();
            } else {
                l[i][j] = left / l[j][j];
            }
        }
    }
    Ok(l)
}

/// The x with L·x = b.
pub fn forward<const N: usize>(l: &[[f64; N]; N], b: [f64; N]) -> [f64; N] {
    let mut x = [0.0; N];
    for i in 0..N {
        let known: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
        x[i] = (b[i] - known) / l[i][i];
    }
    x
}

/// A⁻¹.
///
/// # Errors
/// When A is not positive definite.
pub fn inverse<const N: usize>(a: &[[f64; N]; N]) -> Result<[[f64; N]; N]> {
    let l = cholesky(a)?;
    let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(k == i)));
    let columns: [[f64; N]; N] = std::array::from_fn(|i| forward(&l, unit(i)));
    // A⁻¹ = L⁻ᵀ·L⁻¹.
    Ok(std::array::from_fn(|i| {
        std::array::from_fn(|j| dot(&columns[i], &columns[j]))
    }))
}

/// Σ a·b.
pub fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_times_its_matrix_is_one() {
        let a = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.25], [0.5, -0.25, 2.0]];
        let b = inverse(&a).unwrap();
        // Both are symmetric: their rows are their columns.
        for (i, row) in a.iter().enumerate() {
            for (j, column) in b.iter().enumerate() {
                let off = dot(row, column) - f64::from(u8::from(i == j));
                assert!(off.abs() < 1e-12, "{off:e}");
            }
        }
        assert!(inverse(&[[1.0, 2.0], [2.0, 1.0]]).is_err());
    }
}
