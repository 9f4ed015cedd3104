//! Whitens the features, so that the optimizer finds directions quickly.
//!
//! Nearly all variance of the eleven features is one number: how far the film was pressed.
//! Directions are in small differences of the features, which Adam, stepping along features, would
//! learn slowly. So the first layer is trained on the features' principal components, with weak
//! ones scaled up to a feature's size (after LeCun et al. 1998, "Efficient BackProp"). It is folded
//! back afterwards, which does not change the network. The strong component keeps its size. If it
//! were scaled down, rapid variation along it, such as the pixel grid's effect on a centroid, would
//! be learnt late.

use super::mlp::Mlp;
use crate::forward::eigenvectors;
use crate::network::INPUTS;

/// Part of the whole variance that is added to each component's variance, so that noise is not
/// amplified.
const FLOOR: f64 = 1e-4;

/// Maps standardized features to components of variance 1 or more: row k holds the weights of
/// component k.
#[derive(Clone, Debug)]
pub(super) struct Whitening {
    rows: [[f32; INPUTS]; INPUTS],
    /// The inverse map: row k holds the features of a unit of component k.
    back: [[f32; INPUTS]; INPUTS],
}

impl Whitening {
    /// The whitening of these standardized features.
    pub fn of(features: &[[f32; INPUTS]]) -> Self {
        let mut covariance = vec![vec![0.0; INPUTS]; INPUTS];
        for row in features {
            for (i, j) in pairs() {
                covariance[i][j] += f64::from(row[i]) * f64::from(row[j]) / features.len() as f64;
            }
        }
        let all = eigenvectors(covariance);
        let whole: f64 = all.iter().map(|(variance, _)| variance).sum();
        if whole <= 0.0 {
            // Features that never vary have no components.
            let one = |i| std::array::from_fn(|j| f32::from(u8::from(i == j)));
            let same = std::array::from_fn(one);
            return Self {
                rows: same,
                back: same,
            };
        }
        let size = |k: usize| (all[k].0.clamp(0.0, 1.0) + FLOOR * whole).sqrt();
        let rows = |k: usize| std::array::from_fn(|i| (all[k].1[i] / size(k)) as f32);
        let back = |k: usize| std::array::from_fn(|i| (all[k].1[i] * size(k)) as f32);
        Self {
            rows: std::array::from_fn(rows),
            back: std::array::from_fn(back),
        }
    }

    /// The components of standardized features.
    pub fn components(&self, x: &[f32; INPUTS]) -> [f32; INPUTS] {
        self.rows.map(|row| dot(&row, x))
    }

    /// Converts a network whose first layer takes components into the same network taking features.
    pub fn fold(&self, mlp: &mut Mlp) {
        let folded = |row: &[f32]| -> [f32; INPUTS] {
            std::array::from_fn(|i| row.iter().zip(&self.rows).map(|(w, own)| w * own[i]).sum())
        };
        let rows = mlp.layers[0].weights.chunks(INPUTS);
        mlp.layers[0].weights = rows.flat_map(folded).collect();
    }

    /// The inverse of [`Self::fold`].
    pub fn unfold(&self, mlp: &mut Mlp) {
        let rows = mlp.layers[0].weights.chunks(INPUTS);
        let unfolded = rows.flat_map(|row| self.back.map(|own| dot(&own, row)));
        mlp.layers[0].weights = unfolded.collect();
    }

    /// Converts the gradient by weights of features into that by weights of components.
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Features that are nearly proportional, with small differences of three kinds.
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
        // The other eight depend linearly on these; in real data they would be noise.
        assert_eq!(strong, 3);
    }

    #[test]
    fn folding_does_not_change_what_the_network_says() {
        let features = features(50);
        let whitening = Whitening::of(&features);
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

    /// W by features is W by components times the rows: so the gradient is multiplied by them.
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
