//! The network as burn sees it, with or without the rounding that the chip will do.

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData, activation::relu};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::network::Layer;
use crate::quantize::{LARGEST_ACTIVATION, LARGEST_WEIGHT};

/// One layer; weights as \[input\]\[output\].
#[derive(Module, Debug)]
struct Dense {
    weights: Param<Tensor<2>>,
    bias: Param<Tensor<1>>,
}

/// Layers with ReLU between them.
#[derive(Module, Debug)]
pub(super) struct Mlp {
    layers: Vec<Dense>,
}

impl Mlp {
    /// Random layers of these widths, inputs first, uniform within √(6 / inputs) (He et al. 2015). The numbers
    /// come from `random` and not from burn's global generator, so that nothing else can disturb them.
    pub(super) fn random(widths: &[usize], random: &mut ChaCha8Rng, device: &Device) -> Self {
        let layers = widths.windows(2).map(|pair| {
            let (inputs, outputs) = (pair[0], pair[1]);
            let bound = (6.0 / inputs as f32).sqrt();
            let weights = (0..inputs * outputs)
                .map(|_| random.random_range(-bound..bound))
                .collect();
            Dense::new(weights, vec![0.0; outputs], inputs, device)
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// The layers in plain floats.
    pub(super) fn to_layers(&self) -> Vec<Layer> {
        self.layers.iter().map(Dense::to_layer).collect()
    }

    /// Standardized features `[batch, 11]` to standardized forces `[batch, 3]`, in floats.
    pub(super) fn forward(&self, x: Tensor<2>) -> Tensor<2> {
        let (last, hidden) = self
            .layers
            .split_last()
            .expect("random() gives at least one layer");
        let x = hidden
            .iter()
            .fold(x, |x, layer| relu(layer.apply(x, layer.weights.val())));
        last.apply(x, last.weights.val())
    }

    /// The same as the chip will compute it: weights rounded to eight bits with a scale for each output,
    /// activations to seven bits of `activation_max`.
    pub(super) fn forward_rounded(&self, x: Tensor<2>, activation_max: &[f64]) -> Tensor<2> {
        let (last, hidden) = self
            .layers
            .split_last()
            .expect("random() gives at least one layer");
        let x = hidden
            .iter()
            .zip(activation_max)
            .fold(x, |x, (layer, &max)| {
                round_activations(layer.apply(x, round_weights(layer.weights.val())), max)
            });
        last.apply(x, round_weights(last.weights.val()))
    }
}

impl Dense {
    fn new(weights: Vec<f32>, bias: Vec<f32>, inputs: usize, device: &Device) -> Self {
        let outputs = bias.len();
        Self {
            weights: Param::from_data(TensorData::new(weights, [inputs, outputs]), device),
            bias: Param::from_data(TensorData::new(bias, [outputs]), device),
        }
    }

    fn apply(&self, x: Tensor<2>, weights: Tensor<2>) -> Tensor<2> {
        x.matmul(weights) + self.bias.val().unsqueeze()
    }

    fn to_layer(&self) -> Layer {
        let [inputs, outputs] = self.weights.dims();
        let weights = floats(self.weights.val().into_data());
        let row = |o: usize| (0..inputs).map(|i| weights[i * outputs + o]).collect();
        Layer {
            weights: (0..outputs).map(row).collect(),
            bias: floats(self.bias.val().into_data()),
        }
    }
}

fn floats(data: TensorData) -> Vec<f32> {
    data.iter::<f32>().collect()
}

/// q(x) in the forward pass, the identity in the backward pass (straight-through estimator).
fn straight_through(x: Tensor<2>, rounded: Tensor<2>) -> Tensor<2> {
    x.clone() + (rounded - x).detach()
}

fn round_weights(weights: Tensor<2>) -> Tensor<2> {
    let largest = weights.clone().detach().abs().max_dim(0);
    let step = largest.clamp_min(1e-12) / f64::from(LARGEST_WEIGHT);
    let rounded = (weights.clone() / step.clone()).round() * step;
    straight_through(weights, rounded)
}

/// ReLU, then 7 bits. Beyond `max` the activation saturates, as on the chip, and passes no gradient.
fn round_activations(x: Tensor<2>, max: f64) -> Tensor<2> {
    let step = max / f64::from(LARGEST_ACTIVATION);
    let clipped = x.clamp(0.0, max);
    let rounded = (clipped.clone() / step).round() * step;
    straight_through(clipped, rounded)
}
