//! Floats to the chip's integers (`docs/architecture.md`, model file).
//!
//! Weights become int8 with a scale for each output, activations seven bits, biases the accumulator's unit, and what
//! is left a multiplier and a shift. Nothing here but +, −, ×, ÷ and rounding of `f64`, in a fixed order: the same
//! weights give the same bytes on every machine.

use anyhow::{Context, Result, ensure};
use hivtac_sensing::features::FEATURES;
use hivtac_sensing::model::encode::{LayerSpec, ModelSpec};
use hivtac_sensing::model::{self, InputScaling, OutputKind};
use hivtac_sensing::units::{MicroNewtons, MilliDegrees};

use crate::network::{Layer, Network, Standardization};
use crate::weights::{Range, Rest, Uncertainty, Weights, features_from_q16};

/// Weights are −127 to 127.
pub const LARGEST_WEIGHT: u8 = 127;
/// Activations are 0 to 127.
pub const LARGEST_ACTIVATION: u8 = 127;
/// Steps of the network's input in one standard deviation of a feature.
const INPUT_STEPS: f64 = 4096.0;
/// A pixel in Q16.16.
const PX: f64 = 65_536.0;
/// Bits of an input's multiplier, and of a layer's.
const INPUT_MULTIPLIER_BITS: u32 = 24;
const LAYER_MULTIPLIER_BITS: u32 = 31;
const LARGEST_SHIFT: u8 = 62;
/// Largest |bias|; leaves a quarter of the accumulator's range to the products.
const LARGEST_BIAS: f64 = 1_610_612_736.0;

/// The model file of a weights file.
///
/// # Errors
/// When a number does not fit its field, or an accumulator could overflow.
pub fn export(weights: &Weights) -> Result<Vec<u8>> {
    spec(weights)?
        .encode()
        .map_err(|error| anyhow::anyhow!("the network cannot be exported: {error}"))
}

/// What the model file of a weights file holds.
///
/// # Errors
/// When a number does not fit its field.
pub fn spec(weights: &Weights) -> Result<ModelSpec> {
    weights.network.validate()?;
    Ok(ModelSpec {
        conditions: weights.conditions.to_model()?,
        rest: rest(&weights.rest)?,
        input: input_scaling(&weights.network.input)?,
        layers: layers(&weights.network)?,
        output: OutputKind::ForceVector,
        range: range(&weights.range),
        uncertainty: uncertainty(&weights.uncertainty),
    })
}

fn rest(rest: &Rest) -> Result<model::Rest> {
    Ok(model::Rest {
        features: features_from_q16(&rest.features_q16)?,
        areas: rest.areas_px,
    })
}

fn range(range: &Range) -> model::CalibratedRange {
    model::CalibratedRange {
        magnitude: MicroNewtons((range.force_n * 1e6).round() as i32),
        alpha: MilliDegrees((range.alpha_deg * 1e3).round() as i32),
        beta: MilliDegrees((range.beta_deg * 1e3).round() as i32),
    }
}

fn uncertainty(uncertainty: &Uncertainty) -> model::Uncertainty {
    model::Uncertainty {
        lateral: MicroNewtons((uncertainty.lateral_n * 1e6).round() as i32),
        normal: MicroNewtons((uncertainty.normal_n * 1e6).round() as i32),
    }
}

fn input_scaling(input: &Standardization) -> Result<InputScaling> {
    let mut mean_q16 = [0; FEATURES];
    let (mut multipliers, mut shifts) = ([0; FEATURES], [0; FEATURES]);
    for i in 0..FEATURES {
        mean_q16[i] = (input.mean[i] * PX).round() as i64;
        let factor = INPUT_STEPS / (input.sigma[i] * PX);
        (multipliers[i], shifts[i]) = multiplier_and_shift(factor, INPUT_MULTIPLIER_BITS)
            .with_context(|| format!("scaling of feature {i}"))?;
    }
    Ok(InputScaling {
        mean: features_from_q16(&mean_q16)?,
        multipliers,
        shifts,
    })
}

/// What one step of a value stands for: at the input, after each hidden layer, and at the output in µN.
fn layers(network: &Network) -> Result<Vec<LayerSpec>> {
    let last = network.layers.len() - 1;
    let mut step = 1.0 / INPUT_STEPS;
    let mut specs = Vec::with_capacity(network.layers.len());
    for (i, layer) in network.layers.iter().enumerate() {
        let spec = if i < last {
            let next = network.activation_max[i] / f64::from(LARGEST_ACTIVATION);
            let spec = quantize_layer(layer, step, |_| Output {
                factor: 1.0 / next,
                offset: 0.0,
            });
            step = next;
            spec
        } else {
            let (mean, sigma) = (&network.output.mean, &network.output.sigma);
            quantize_layer(layer, step, |o| Output {
                factor: sigma[o] * 1e6,
                offset: mean[o] / sigma[o],
            })
        };
        specs.push(spec.with_context(|| format!("layer {i}"))?);
    }
    Ok(specs)
}

/// What becomes of y = W·x + b: (y + offset)·factor.
struct Output {
    factor: f64,
    offset: f64,
}

/// `step` is what one step of the layer's input stands for.
fn quantize_layer(layer: &Layer, step: f64, output: impl Fn(usize) -> Output) -> Result<LayerSpec> {
    let mut spec = LayerSpec {
        inputs: u16::try_from(layer.inputs())?,
        outputs: u16::try_from(layer.outputs())?,
        weights: Vec::new(),
        biases: Vec::new(),
        multipliers: Vec::new(),
        shifts: Vec::new(),
    };
    for (o, (row, &bias)) in layer.weights.iter().zip(&layer.bias).enumerate() {
        let Output { factor, offset } = output(o);
        let bias = f64::from(bias) + offset;
        let scale = weight_scale(row, bias, step);
        spec.weights
            .extend(row.iter().map(|&w| round_weight(w, scale)));
        spec.biases.push((bias / (scale * step)).round() as i32);
        let (multiplier, shift) =
            multiplier_and_shift(scale * step * factor, LAYER_MULTIPLIER_BITS)
                .with_context(|| format!("scaling of output {o}"))?;
        spec.multipliers.push(multiplier);
        spec.shifts.push(shift);
    }
    Ok(spec)
}

/// What one step of a row's int8 weights stands for: the largest weight becomes ±127, and the bias must fit.
fn weight_scale(row: &[f32], bias: f64, step: f64) -> f64 {
    let largest = row.iter().map(|&w| f64::from(w.abs())).fold(0.0, f64::max);
    let scale = (largest / f64::from(LARGEST_WEIGHT)).max(bias.abs() / (step * LARGEST_BIAS));
    // A row of zeros without bias is zero at any scale.
    if scale > 0.0 { scale } else { 1.0 }
}

fn round_weight(weight: f32, scale: f64) -> i8 {
    let limit = f64::from(LARGEST_WEIGHT);
    (f64::from(weight) / scale).round().clamp(-limit, limit) as i8
}

/// m and s with m / 2^s nearest to `factor`, m as large as `bits` allow and s at most 62.
fn multiplier_and_shift(factor: f64, bits: u32) -> Result<(u32, u8)> {
    let limit = (1_u64 << bits) as f64;
    ensure!(
        factor.is_finite() && factor > 0.0,
        "a factor is {factor}: it must be above zero"
    );
    ensure!(
        factor < limit / 4.0,
        "a factor is {factor}: the most is 2^{}",
        bits - 2
    );
    let (mut scaled, mut shift) = (factor, 0);
    while shift < LARGEST_SHIFT && (scaled * 2.0).round() < limit {
        scaled *= 2.0;
        shift += 1;
    }
    // What is too small even for 2^-62 rounds to nothing on the chip: the smallest multiplier does the same.
    Ok((scaled.round().max(1.0) as u32, shift))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn one_is_the_largest_power_of_two_that_fits() {
        assert_eq!(multiplier_and_shift(1.0, 24).unwrap(), (1 << 23, 23));
        assert_eq!(multiplier_and_shift(0.75, 31).unwrap(), (3 << 29, 31));
    }

    #[test]
    fn factors_that_cannot_be_are_refused() {
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e9] {
            assert!(multiplier_and_shift(factor, 24).is_err(), "{factor}");
        }
        assert_eq!(multiplier_and_shift(1e-30, 24).unwrap(), (1, 62));
    }

    #[test]
    fn the_largest_weight_of_each_row_is_127() {
        let layer = Layer {
            weights: vec![vec![0.5, -1.0, 0.25], vec![0.125, 0.0, 0.25]],
            bias: vec![0.5, 0.0],
        };
        let output = |_| Output {
            factor: 1.0,
            offset: 0.0,
        };
        let spec = quantize_layer(&layer, 1.0 / 4096.0, output).unwrap();
        assert_eq!(spec.weights, [64, -127, 32, 64, 0, 127]);
        assert_eq!(spec.biases, [260_096, 0]);
    }

    #[test]
    fn rows_without_weights_keep_their_bias() {
        let layer = Layer {
            weights: vec![vec![0.0; 3]; 2],
            bias: vec![0.0, 7.0],
        };
        let spec = quantize_layer(&layer, 0.01, |_| Output {
            factor: 1000.0,
            offset: 0.0,
        })
        .unwrap();
        assert_eq!(spec.biases[0], 0);
        let (m, s) = (f64::from(spec.multipliers[1]), i32::from(spec.shifts[1]));
        let y = f64::from(spec.biases[1]) * m / 2_f64.powi(s);
        assert!((y - 7000.0).abs() < 1e-3, "{y}");
    }

    proptest! {
        #[test]
        fn multiplier_and_shift_stand_for_the_factor(exponent in -30_i32..20, mantissa in 1.0..2.0_f64) {
            let factor = mantissa * 2_f64.powi(exponent);
            for bits in [24, 31] {
                let (m, s) = multiplier_and_shift(factor, bits).unwrap();
                prop_assert!(m >= 1 && u64::from(m) < 1 << bits && (1..=62).contains(&s));
                let error = (f64::from(m) / 2_f64.powi(i32::from(s)) / factor - 1.0).abs();
                prop_assert!(error <= 1.0 / (1_u64 << (bits - 1)) as f64, "{error:e}");
            }
        }
    }
}
