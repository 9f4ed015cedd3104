//! Fits the range of hidden units to activations of few bits.

use super::{Arithmetic, INPUTS, Network};

/// The largest factor by which a weakly active unit is scaled up.
const MOST_STRETCHED: f64 = 32.0;

impl Network {
    /// Whether the chip holds a hidden layer's activations in seven bits: those followed by int8
    /// weights.
    pub(crate) fn is_coarse(&self, layer: usize) -> bool {
        self.arithmetic != Arithmetic::Int16 && layer + 2 < self.layers.len()
    }

    /// Scales each unit of the hidden layers, and inversely the weights after it, so that all units
    /// of a layer have the same largest output over `rows`. The network stays the same, and each
    /// unit uses all steps of an activation (Nagel et al. 2019, "Data-Free Quantization Through
    /// Weight Equalization and Bias Correction").
    pub fn equalize(&mut self, rows: &[[f64; INPUTS]]) {
        for i in 0..self.layers.len().saturating_sub(1) {
            let maxima = self.unit_maxima(i + 1, rows).swap_remove(i);
            let most = maxima.iter().copied().fold(0.0, f64::max);
            if most == 0.0 {
                continue;
            }
            for (unit, max) in maxima.into_iter().enumerate() {
                let factor = (most / max.max(most / MOST_STRETCHED)) as f32;
                let layer = &mut self.layers[i];
                layer.weights[unit].iter_mut().for_each(|w| *w *= factor);
                layer.bias[unit] *= factor;
                let next = self.layers[i + 1].weights.iter_mut();
                next.for_each(|row| row[unit] /= factor);
            }
        }
    }

    /// The largest output over `rows` of each unit of the first `few` layers, all hidden ones.
    fn unit_maxima(&self, few: usize, rows: &[[f64; INPUTS]]) -> Vec<Vec<f64>> {
        let layers = &self.layers[..few];
        let mut maxima: Vec<_> = layers.iter().map(|it| vec![0.0; it.outputs()]).collect();
        for row in rows {
            let mut x = self.input.forward(row);
            for (layer, maxima) in maxima.iter_mut().enumerate() {
                x = self.activations(layer, &x);
                for (max, x) in maxima.iter_mut().zip(&x) {
                    *max = x.max(*max);
                }
            }
        }
        maxima
    }

    /// The largest output of each hidden layer over `rows`. At least a tiny positive number, so
    /// that a layer without any activity can still be scaled.
    pub fn activation_maxima(&self, rows: &[[f64; INPUTS]]) -> Vec<f64> {
        let of_layer = |units: Vec<f64>| units.into_iter().fold(1e-6, f64::max);
        let hidden = self.layers.len().saturating_sub(1);
        let maxima = self.unit_maxima(hidden, rows);
        maxima.into_iter().map(of_layer).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::tiny;
    use super::*;

    fn rows() -> Vec<[f64; INPUTS]> {
        let row = |x| std::array::from_fn(|i| f64::from(x) + 0.1 * f64::from(i as u8));
        (-8..=8).map(row).collect()
    }

    fn same(a: &Network, b: &Network, rows: &[[f64; INPUTS]]) {
        for row in rows {
            for (a, b) in a.predict(row).iter().zip(b.predict(row)) {
                assert!((a - b).abs() < 1e-4, "{a} {b}");
            }
        }
    }

    #[test]
    fn equalized_units_reach_as_far_and_say_the_same() {
        let mut network = tiny();
        network.layers[0].weights[1].fill(-0.25);
        let rows = rows();
        let before = network.clone();
        network.equalize(&rows);
        let [a, b] = [0, 1].map(|unit| network.unit_maxima(1, &rows)[0][unit]);
        assert!((a - b).abs() < 1e-4 * a && a == before.unit_maxima(1, &rows)[0][0]);
        same(&network, &before, &rows);
        // An inactive unit, and a layer of such units.
        network.layers[0].bias.fill(-1e3);
        let silent = network.clone();
        network.equalize(&rows);
        assert_eq!(network, silent);
    }
}
