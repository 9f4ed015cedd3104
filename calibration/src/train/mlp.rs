//! The network in training: layers with ReLU between them, forward, and backward by the chain rule.
//!
//! Values of a batch are stored feature by feature, so that a feature's values of all rows are
//! adjacent.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::product::{product, transposed};
use crate::network::Layer;

/// One layer: y = W·x + b.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dense {
    /// W, row by row: the weights of output 0, then of output 1, …
    pub weights: Vec<f32>,
    /// b.
    pub bias: Vec<f32>,
}

/// Values of a forward pass that the backward pass needs.
#[derive(Clone, Debug, Default)]
pub(super) struct Trace {
    /// The values that entered each layer.
    pub inputs: Vec<Vec<f32>>,
    /// For each output of a hidden layer, whether ReLU passes a small change of its input.
    pub open: Vec<Vec<bool>>,
    /// The last layer's values.
    pub outputs: Vec<f32>,
}

/// The network in training.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mlp {
    pub layers: Vec<Dense>,
}

impl Dense {
    pub fn outputs(&self) -> usize {
        self.bias.len()
    }

    pub fn inputs(&self) -> usize {
        self.weights.len() / self.bias.len()
    }

    fn apply(&self, x: &[f32], rows: usize) -> Vec<f32> {
        let mut y = product(&self.weights, x, [self.outputs(), self.inputs(), rows]);
        for (values, &b) in y.chunks_mut(rows).zip(&self.bias) {
            values.iter_mut().for_each(|value| *value += b);
        }
        y
    }

    fn to_layer(&self) -> Layer {
        Layer {
            weights: self
                .weights
                .chunks(self.inputs())
                .map(<[f32]>::to_vec)
                .collect(),
            bias: self.bias.clone(),
        }
    }
}

impl Mlp {
    /// Random layers of these widths, inputs first, uniform within √(6 / inputs) (He et al. 2015).
    pub fn random(widths: &[usize], random: &mut ChaCha8Rng) -> Self {
        let layers = widths.windows(2).map(|pair| {
            let (inputs, outputs) = (pair[0], pair[1]);
            let bound = (6.0 / inputs as f32).sqrt();
            let mut weight = || random.random_range(-bound..bound);
            Dense {
                weights: (0..inputs * outputs).map(|_| weight()).collect(),
                bias: vec![0.0; outputs],
            }
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// From layers of matching widths.
    pub fn of_layers(layers: &[Layer]) -> Self {
        let dense = |layer: &Layer| Dense {
            weights: layer.weights.concat(),
            bias: layer.bias.clone(),
        };
        Self {
            layers: layers.iter().map(dense).collect(),
        }
    }

    /// The layers as files hold them.
    pub fn to_layers(&self) -> Vec<Layer> {
        self.layers.iter().map(Dense::to_layer).collect()
    }

    /// A forward pass over `rows` rows.
    pub fn forward(&self, x: Vec<f32>, rows: usize) -> Trace {
        let mut trace = Trace::default();
        let mut x = x;
        let last = self.layers.len() - 1;
        for (i, layer) in self.layers.iter().enumerate() {
            let mut y = layer.apply(&x, rows);
            trace.inputs.push(x);
            if i < last {
                trace
                    .open
                    .push(y.iter().map(|&value| value > 0.0).collect());
                y.iter_mut().for_each(|value| *value = value.max(0.0));
            }
            x = y;
        }
        trace.outputs = x;
        trace
    }

    /// The gradient of a loss by weights and biases, given its gradient `dy` by the outputs.
    pub fn backward(&self, trace: &Trace, dy: Vec<f32>, rows: usize) -> Vec<Dense> {
        let mut dy = dy;
        let mut gradients = Vec::with_capacity(self.layers.len());
        for (i, layer) in self.layers.iter().enumerate().rev() {
            let (inputs, outputs) = (layer.inputs(), layer.outputs());
            let x = transposed(&trace.inputs[i], inputs, rows);
            gradients.push(Dense {
                weights: product(&dy, &x, [outputs, rows, inputs]),
                bias: dy.chunks(rows).map(|values| values.iter().sum()).collect(),
            });
            if i > 0 {
                let back = transposed(&layer.weights, outputs, inputs);
                let dx = product(&back, &dy, [inputs, outputs, rows]);
                let open = trace.open[i - 1].iter();
                dy = dx
                    .iter()
                    .zip(open)
                    .map(|(&d, &open)| if open { d } else { 0.0 })
                    .collect();
            }
        }
        gradients.reverse();
        gradients
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    const ROWS: usize = 7;

    /// Half the sum of squares of the outputs.
    fn loss(mlp: &Mlp, x: &[f32]) -> f64 {
        let outputs = mlp.forward(x.to_vec(), ROWS).outputs;
        outputs.iter().map(|&y| f64::from(y).powi(2) / 2.0).sum()
    }

    /// Central differences in single precision: steps large enough to be seen, small enough not to
    /// cross a kink often.
    #[test]
    fn the_gradient_is_that_of_differences() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut mlp = Mlp::random(&[11, 9, 6, 3], &mut random);
        for layer in &mut mlp.layers {
            layer
                .bias
                .iter_mut()
                .for_each(|b| *b = random.random_range(-0.5..0.5));
        }
        let x: Vec<f32> = (0..11 * ROWS)
            .map(|_| random.random_range(-2.0..2.0))
            .collect();
        let trace = mlp.forward(x.clone(), ROWS);
        let gradients = mlp.backward(&trace, trace.outputs.clone(), ROWS);

        const STEP: f32 = 1.0 / 1024.0;
        let mut far = 0;
        let mut count = 0;
        for (l, gradient) in gradients.iter().enumerate() {
            for w in 0..mlp.layers[l].weights.len() + mlp.layers[l].bias.len() {
                let weights = mlp.layers[l].weights.len();
                let moved = |by: f32| {
                    let mut moved = mlp.clone();
                    let layer = &mut moved.layers[l];
                    if w < weights {
                        layer.weights[w] += by
                    } else {
                        layer.bias[w - weights] += by
                    }
                    loss(&moved, &x)
                };
                let found = if w < weights {
                    gradient.weights[w]
                } else {
                    gradient.bias[w - weights]
                };
                let difference = (moved(STEP) - moved(-STEP)) / f64::from(2.0 * STEP);
                let error = (f64::from(found) - difference).abs();
                far += usize::from(error > 2e-2 + 2e-3 * difference.abs());
                count += 1;
            }
        }
        // A step that crosses a kink of ReLU gives another difference.
        assert!(far * 50 <= count, "{far} of {count} derivatives are off");
    }

    #[test]
    fn layers_come_back() {
        let mlp = Mlp::random(&[11, 5, 3], &mut ChaCha8Rng::seed_from_u64(1));
        assert_eq!(Mlp::of_layers(&mlp.to_layers()), mlp);
    }
}
