//! Fits the range of hidden units to activations of few bits.

use super::{Arithmetic, INPUTS, Network};

/// The largest factor by which a weakly active unit is scaled up.
const MOST_STRETCHED: f64 = 32.0;
/// Part by which split units extend beyond the data's largest activation, for rows that go a little
/// further; it costs hardly any steps.
const HEADROOM: f64 = 1.0 / 32.0;

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

    /// Replaces each unit of the layers with seven-bit activations by `parts` units, one for each
    /// part of its range: 0 below its part, saturated above it. Their sum is the unit, so the
    /// network stays the same within `activation_max`. But a step of an activation is finer by the
    /// factor `parts`, and only one part of each unit is rounded at a time. With one part nothing
    /// changes.
    pub fn split(&mut self, parts: usize) {
        if parts <= 1 {
            return;
        }
        for i in 0..self.layers.len() {
            if !self.is_coarse(i) {
                continue;
            }
            let reach = self.activation_max[i] * (1.0 + HEADROOM) / parts as f64;
            let layer = &mut self.layers[i];
            layer.weights = repeated(&layer.weights, parts);
            let biases = layer.bias.iter().map(|&b| f64::from(b));
            let part = |b: f64| (0..parts).map(move |part| (b - part as f64 * reach) as f32);
            layer.bias = biases.flat_map(part).collect();
            let next = self.layers[i + 1].weights.iter_mut();
            next.for_each(|row| *row = repeated(row, parts));
            self.activation_max[i] = reach;
        }
        self.saturates = true;
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

/// Each item `times` times in a row.
fn repeated<T: Clone>(items: &[T], times: usize) -> Vec<T> {
    let copies = |item: &T| vec![item.clone(); times];
    items.iter().flat_map(copies).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::tiny;
    use super::super::{Layer, OUTPUTS};
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

    /// Two hidden layers: the first is coarse in int8.
    fn deep() -> Network {
        let mut network = tiny();
        let middle = Layer {
            weights: vec![vec![0.5, -0.25], vec![-0.125, 0.5], vec![0.25, 0.25]],
            bias: vec![0.1, 0.2, -1.0],
        };
        network.layers[1].weights = vec![vec![1.0, -0.5, 0.25]; OUTPUTS];
        network.layers.insert(1, middle);
        network.activation_max = network.activation_maxima(&rows());
        network
    }

    #[test]
    fn split_units_say_the_same_in_smaller_steps() {
        let before = deep();
        let mut network = before.clone();
        network.split(4);
        network.validate().unwrap();
        let widths = network.layers.iter().map(Layer::outputs);
        assert_eq!(widths.collect::<Vec<_>>(), [8, 3, OUTPUTS]);
        same(&network, &before, &rows());
        let finer = before.activation_max[0] / network.activation_max[0];
        assert!((3.8..4.0).contains(&finer), "{finer}");
        assert_eq!(network.activation_max[1], before.activation_max[1]);
        // At most one part of each unit is neither 0 nor saturated, and further training keeps
        // saturation.
        let limit = network.activation_max[0];
        for row in rows() {
            let parts = network.activations(0, &network.input.forward(&row));
            for parts in parts.chunks(4) {
                let between = parts.iter().filter(|&&x| x > 0.0 && x < limit);
                assert!(between.count() <= 1, "{parts:?}");
            }
        }
        let split = network.clone();
        network.equalize(&rows());
        same(&network, &split, &rows());
    }

    #[test]
    fn one_part_and_activations_of_twelve_bits_are_not_split() {
        let before = deep();
        let mut network = before.clone();
        network.split(1);
        assert_eq!(network, before);
        network.arithmetic = Arithmetic::Int16;
        network.split(4);
        assert_eq!(network.layers, before.layers);
        assert_eq!(network.activation_max, before.activation_max);
    }
}
