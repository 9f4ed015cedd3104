//! The quantized network: the portable definition that every other kernel must match bit for bit.
//!
//! Every number is an integer and every rescaling rounds once, half up:
//! `rescale(a, m, s) = (a·m + 2^(s−1)) >> s`.
//!
//! 1. Input: `x_i = sat16(rescale(f_i − tare_i + rest_i − mean_i, m_i, s_i))`. The difference is limited to
//!    ±(2³⁸ − 1) first, which no two frames of up to 800 × 800 px exceed; with m < 2²⁴ the product stays below 2⁶².
//! 2. Hidden layer: `acc_j = bias_j + Σ w_ji·x_i`, `a_j = clamp(rescale(acc_j, m_j, s_j), 0, 127)`.
//! 3. Output layer: `y_j = sat32(rescale(acc_j, m_j, s_j))`.
//!
//! [`Model::parse`] has proven that `acc_j` fits `i32`; with m < 2³¹ the product stays below 2⁶².

use crate::{
    features::{FEATURES, Features},
    model::{InputScaling, Layer, MAX_WIDTH, Model, OUTPUTS},
};

/// Largest difference of features that enters the rescaling.
const LARGEST_DIFFERENCE: i64 = (1 << 38) - 1;
/// Largest activation of a hidden layer: seven bits.
const LARGEST_ACTIVATION: i64 = 127;

/// Room for the activations of two layers.
#[derive(Clone, Debug)]
pub struct Network {
    /// What the layer before gave.
    current: [u8; MAX_WIDTH],
    /// What this layer gives.
    next: [u8; MAX_WIDTH],
}

/// What the network makes of one set of features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Output {
    /// The three outputs, in the units of the model's output kind.
    pub values: [i32; OUTPUTS],
    /// True when an input met the limits of `i16` (8 σ): far from all that the model was trained on.
    pub input_saturated: bool,
}

impl Network {
    /// Buffers for any model.
    pub const fn new() -> Network {
        Network {
            current: [0; MAX_WIDTH],
            next: [0; MAX_WIDTH],
        }
    }

    /// Runs `model` on `features`, measured from the rest position `tare`.
    pub fn run(&mut self, model: &Model<'_>, features: &Features, tare: &Features) -> Output {
        let inputs = scale_inputs(&model.input, features, tare, &model.rest.features);
        let mut values = [0; OUTPUTS];
        // A parsed model has at least one layer.
        if let Some((last, hidden)) = model.layers().split_last() {
            match hidden.split_first() {
                None => output_layer(last, &inputs, &mut values),
                Some((first, others)) => {
                    hidden_layer(first, &inputs, &mut self.current);
                    for layer in others {
                        hidden_layer(layer, &self.current, &mut self.next);
                        core::mem::swap(&mut self.current, &mut self.next);
                    }
                    output_layer(last, &self.current, &mut values);
                }
            }
        }
        Output {
            values,
            input_saturated: inputs.iter().any(|&x| x == i16::MIN || x == i16::MAX),
        }
    }
}

impl Default for Network {
    fn default() -> Self {
        Network::new()
    }
}

/// Step 1: standardized inputs in units of σ / 4096.
pub fn scale_inputs(
    scaling: &InputScaling,
    features: &Features,
    tare: &Features,
    rest: &Features,
) -> [i16; FEATURES] {
    let (features, tare) = (features.to_array(), tare.to_array());
    let (rest, mean) = (rest.to_array(), scaling.mean.to_array());
    core::array::from_fn(|i| {
        let moved = features[i].saturating_sub(tare[i]);
        let difference = moved.saturating_add(rest[i]).saturating_sub(mean[i]);
        let limited = difference.clamp(-LARGEST_DIFFERENCE, LARGEST_DIFFERENCE);
        let scaled = rescale(limited, scaling.multipliers[i], scaling.shifts[i]);
        scaled.clamp(i64::from(i16::MIN), i64::from(i16::MAX)) as i16
    })
}

/// Step 2, for one layer. `inputs` may be longer than the layer asks for.
fn hidden_layer<X: Copy + Into<i32>>(layer: &Layer<'_>, inputs: &[X], outputs: &mut [u8]) {
    for (value, output) in rescaled_rows(layer, inputs).zip(outputs) {
        *output = value.clamp(0, LARGEST_ACTIVATION) as u8;
    }
}

/// Step 3.
fn output_layer<X: Copy + Into<i32>>(layer: &Layer<'_>, inputs: &[X], outputs: &mut [i32]) {
    for (value, output) in rescaled_rows(layer, inputs).zip(outputs) {
        *output = value.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
    }
}

fn rescaled_rows<X: Copy + Into<i32>>(
    layer: &Layer<'_>,
    inputs: &[X],
) -> impl Iterator<Item = i64> {
    layer.rows().map(move |row| {
        let products = row
            .weights
            .iter()
            .zip(inputs)
            .map(|(&w, &x)| i32::from(w as i8) * x.into());
        let sum = products.fold(row.bias, |sum, product| sum + product);
        rescale(i64::from(sum), row.multiplier, row.shift)
    })
}

/// value · multiplier / 2^shift, rounded once, half up. `shift` ≥ 1.
fn rescale(value: i64, multiplier: u32, shift: u8) -> i64 {
    (value * i64::from(multiplier) + (1 << (shift - 1))) >> shift
}
