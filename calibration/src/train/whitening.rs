//! Directions that the optimizer walks along.
//!
//! The eleven features nearly all say the same: how far the film was pressed. What tells directions
//! is small differences of them, which Adam, walking along features, would take long to find. So
//! the first layer is trained on the features' principal components, weak ones made as large as a
//! feature (after LeCun et al. 1998, "Efficient BackProp"), and folded back afterwards: the network
//! is the same. The strong one stays as it is: made smaller, what varies quickly along it, such as
//! the pixel grid's part in a centroid, would be learnt late.

use super::mlp::Mlp;
use crate::network::INPUTS;

/// A part of the whole variance that is added to each component's, so that noise is not blown up.
const FLOOR: f64 = 1e-4;
/// Jacobi's sweeps; six reach the last bit.
const SWEEPS: usize = 12;

type Matrix = [[f64; INPUTS]; INPUTS];

/// Standardized features to components of variance 1 or more: row k holds the weights of component
/// k.
#[derive(Clone, Debug)]
pub(super) struct Whitening {
    rows: [[f32; INPUTS]; INPUTS],
    /// The way back: row k is what a unit of component k is made of.
    back: [[f32; INPUTS]; INPUTS],
}

impl Whitening {
    /// Features as they are.
    pub fn none() -> Self {
        let one = identity().map(|row| row.map(|part| part as f32));
        Self {
            rows: one,
            back: one,
        }
    }

    /// That of these standardized features.
    pub fn of(features: &[[f32; INPUTS]]) -> Self {
        let mut covariance = [[0.0; INPUTS]; INPUTS];
        for row in features {
            for (i, j) in pairs() {
                covariance[i][j] += f64::from(row[i]) * f64::from(row[j]) / features.len() as f64;
            }
        }
        let (variances, directions) = principal(covariance);
        let whole: f64 = variances.iter().sum();
        if whole <= 0.0 {
            // Features that never vary have no components.
            return Self::none();
        }
        let size = |k: usize| (variances[k].clamp(0.0, 1.0) + FLOOR * whole).sqrt();
        let rows = |k: usize| directions[k].map(|part| (part / size(k)) as f32);
        let back = |k: usize| directions[k].map(|part| (part * size(k)) as f32);
        Self {
            rows: std::array::from_fn(rows),
            back: std::array::from_fn(back),
        }
    }

    /// The components of standardized features.
    pub fn components(&self, x: &[f32; INPUTS]) -> [f32; INPUTS] {
        self.rows.map(|row| dot(&row, x))
    }

    /// A network whose first layer takes components becomes the same one that takes features.
    pub fn fold(&self, mlp: &mut Mlp) {
        let folded = |row: &[f32]| -> [f32; INPUTS] {
            std::array::from_fn(|i| row.iter().zip(&self.rows).map(|(w, own)| w * own[i]).sum())
        };
        let rows = mlp.layers[0].weights.chunks(INPUTS);
        mlp.layers[0].weights = rows.flat_map(folded).collect();
    }

    /// The way back.
    pub fn unfold(&self, mlp: &mut Mlp) {
        let rows = mlp.layers[0].weights.chunks(INPUTS);
        let unfolded = rows.flat_map(|row| self.back.map(|own| dot(&own, row)));
        mlp.layers[0].weights = unfolded.collect();
    }

    /// The gradient by weights by components, from that by weights by features.
    pub fn gradient(&self, gradient: &[f32]) -> Vec<f32> {
        let rows = gradient.chunks(INPUTS);
        rows.flat_map(|row| self.rows.map(|own| dot(&own, row)))
            .collect()
    }
}

fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..INPUTS).flat_map(|i| (0..INPUTS).map(move |j| (i, j)))
}

/// Eigenvalues and eigenvectors (as rows) of a symmetric matrix, by Jacobi's rotations.
fn principal(mut matrix: Matrix) -> ([f64; INPUTS], Matrix) {
    let mut directions = identity();
    for _ in 0..SWEEPS {
        for (i, j) in pairs().filter(|(i, j)| i < j) {
            if matrix[i][j] == 0.0 {
                continue;
            }
            let theta = (matrix[j][j] - matrix[i][i]) / (2.0 * matrix[i][j]);
            let tan = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cos = 1.0 / (tan * tan + 1.0).sqrt();
            let sin = tan * cos;
            for row in &mut matrix {
                (row[i], row[j]) = (cos * row[i] - sin * row[j], sin * row[i] + cos * row[j]);
            }
            rotate(&mut matrix, [i, j], [cos, sin]);
            rotate(&mut directions, [i, j], [cos, sin]);
        }
    }
    (std::array::from_fn(|k| matrix[k][k]), directions)
}

fn identity() -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

/// Turns two rows of a matrix.
fn rotate(matrix: &mut Matrix, [i, j]: [usize; 2], [cos, sin]: [f64; 2]) {
    let (a, b) = (matrix[i], matrix[j]);
    matrix[i] = std::array::from_fn(|k| cos * a[k] - sin * b[k]);
    matrix[j] = std::array::from_fn(|k| sin * a[k] + cos * b[k]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Features that nearly all say the same, with small differences of three kinds.
    fn features(rows: usize) -> Vec<[f32; INPUTS]> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let row = |_| {
            let [all, a, b, c] =
                [1.0, 0.3, 0.1, 0.05].map(|size| size * random.random_range(-1.7..1.7));
            std::array::from_fn(|i| match i % 3 {
                0 => all + a + b,
                1 => all - a + c,
                _ => all - b - c,
            })
        };
        (0..rows).map(row).collect()
    }

    #[test]
    fn components_are_independent_and_none_is_small() {
        let features = features(2000);
        let whitening = Whitening::of(&features);
        let rows: Vec<_> = features
            .iter()
            .map(|row| whitening.components(row))
            .collect();
        let mut strong = 0;
        for (i, j) in pairs().filter(|(i, j)| i <= j) {
            let sum: f64 = rows.iter().map(|row| f64::from(row[i] * row[j])).sum();
            let covariance = sum / rows.len() as f64;
            if i == j {
                assert!(!(0.01..0.9).contains(&covariance), "{i}: {covariance}");
                strong += usize::from(covariance > 0.9);
            } else {
                assert!(covariance.abs() < 1e-3, "{i}, {j}: {covariance}");
            }
        }
        // The other eight are linear in these: noise, were there any.
        assert_eq!(strong, 3);
    }

    #[test]
    fn folding_does_not_change_what_the_network_says() {
        let features = features(50);
        for whitening in [Whitening::of(&features), Whitening::none()] {
            let mut random = ChaCha8Rng::seed_from_u64(6);
            let inner = Mlp::random(&[INPUTS, 7, 3], &mut random);
            let mut outer = inner.clone();
            whitening.fold(&mut outer);
            for row in &features {
                let by_components = inner.forward(whitening.components(row).to_vec(), 1).outputs;
                let by_features = outer.forward(row.to_vec(), 1).outputs;
                for (a, b) in by_components.iter().zip(by_features) {
                    assert!((a - b).abs() < 1e-3, "{a} {b}");
                }
            }
            whitening.unfold(&mut outer);
            let pairs = inner.layers[0].weights.iter().zip(&outer.layers[0].weights);
            for (a, b) in pairs {
                assert!((a - b).abs() < 1e-3, "{a} {b}");
            }
        }
    }

    /// W by features is W by components times the rows: so the gradient is taken along them.
    #[test]
    fn gradients_follow_the_chain_rule() {
        let whitening = Whitening::of(&features(50));
        let by_features: [f32; INPUTS] = std::array::from_fn(|i| 0.3 - 0.1 * i as f32);
        let mut mlp = Mlp::random(&[INPUTS, 1], &mut ChaCha8Rng::seed_from_u64(7));
        let loss = |mlp: &Mlp| {
            let mut outer = mlp.clone();
            whitening.fold(&mut outer);
            dot(&outer.layers[0].weights, &by_features)
        };
        let gradient = whitening.gradient(&by_features);
        for (k, expected) in gradient.into_iter().enumerate() {
            let before = loss(&mlp);
            mlp.layers[0].weights[k] += 1.0;
            let found = loss(&mlp) - before;
            assert!(
                (found - expected).abs() < 1e-2 * expected.abs().max(1.0),
                "{k}: {found} {expected}"
            );
        }
    }
}
