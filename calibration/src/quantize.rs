//! Converts a network from floats to the chip's integers (`docs/architecture.md`, model file).
//!
//! Weights become integers with a scale for each output (int8 and activations of seven bits, or
//! int16 and twelve; the first and the last layer are always int16). Biases take the accumulator's
//! unit, and the remaining factor becomes a multiplier and a shift. Only +, −, ×, ÷ and rounding of
//! `f64` are used, in a fixed order: the same weights give the same bytes on every machine.

use anyhow::{Context, Result, ensure};
use hivtac_sensor::force::features::FEATURES;
use hivtac_sensor::force::model::{self, InputScaling, OutputKind, UncertaintyKnot};
use hivtac_sensor::force::model::{encode::LayerSpec, encode::ModelSpec};
use hivtac_sensor::force::packing::{MAX_ACTIVATION8, WeightWidth};
use hivtac_terms::units::{MicroNewtons, Micrometres, MilliDegrees};

use crate::data::range::Range;
use crate::data::rest::{FeatureList, features_from_q16, q16};
use crate::forward::FilmModel;
use crate::network::{Layer, Meaning, Network, Standardization};
use crate::weights::{Uncertainty, Weights};

/// Steps of the network's input per standard deviation of a feature.
const INPUT_STEPS: f64 = 4096.0;
/// A pixel in Q16.16.
const PX: f64 = 65_536.0;
/// Bits of an input's multiplier, and of a layer's.
const INPUT_MULTIPLIER_BITS: u32 = 24;
const LAYER_MULTIPLIER_BITS: u32 = 31;
const LARGEST_SHIFT: u8 = 62;
/// Largest |accumulator|.
const LARGEST_SUM: f64 = i32::MAX as f64;
/// Largest input of the first layer, and of any other after int8 and after int16 arithmetic.
/// Twelve-bit activations leave twelve bits for weights at 512 inputs.
const LARGEST_INPUT: u16 = 1 << 15;
const LARGEST_ACTIVATION8: u16 = MAX_ACTIVATION8;
const LARGEST_ACTIVATION16: u16 = 4095;

/// The model file made from a weights file.
///
/// # Errors
/// When a number does not fit its field, or an accumulator could overflow.
pub fn export(weights: &Weights) -> Result<Vec<u8>> {
    spec(weights)?
        .encode()
        .map_err(|error| anyhow::anyhow!("the network cannot be exported: {error}"))
}

/// The content of the model file made from a weights file.
///
/// # Errors
/// When a number does not fit its field.
pub fn spec(weights: &Weights) -> Result<ModelSpec> {
    weights.check()?;
    Ok(ModelSpec {
        conditions: weights.conditions.to_model()?,
        rest: weights.rest.to_sensor()?,
        input: match &weights.network {
            Some(network) => input_scaling(&network.input)?,
            None => InputScaling::default(),
        },
        layers: match &weights.network {
            Some(network) => layers(network)?
                .into_iter()
                .map(|layer| layer.spec)
                .collect(),
            None => Vec::new(),
        },
        forward: weights.film.as_ref().map(FilmModel::spec).transpose()?,
        output: match weights.network.as_ref().map(|network| network.meaning) {
            Some(Meaning::ForceVector) => OutputKind::ForceVector,
            Some(Meaning::AnglesMagnitude) => OutputKind::AnglesMagnitude,
            Some(Meaning::ForceAndPlace) | None => OutputKind::ForceAndPlace,
        },
        range: range(&weights.range),
        uncertainty: uncertainty(&weights.uncertainty),
    })
}

fn range(range: &Range) -> model::CalibratedRange {
    model::CalibratedRange {
        magnitude: MicroNewtons((range.force_n * 1e6).round() as i32),
        alpha: MilliDegrees((range.alpha_deg * 1e3).round() as i32),
        beta: MilliDegrees((range.beta_deg * 1e3).round() as i32),
        place: micrometres(range.place_mm),
    }
}

fn micrometres(mm: f64) -> Micrometres {
    Micrometres((mm * 1e3).round() as u32)
}

fn uncertainty(uncertainty: &Uncertainty) -> model::Uncertainty {
    let micro = |n: f64| MicroNewtons((n * 1e6).round() as i32);
    model::Uncertainty {
        step_bits: uncertainty.step_bits,
        knots: std::array::from_fn(|i| UncertaintyKnot {
            across: micro(uncertainty.across_n[i]),
            along: micro(uncertainty.along_n[i]),
            place: micrometres(uncertainty.place_mm[i]),
        }),
    }
}

/// How the chip standardizes features.
pub(crate) fn input_scaling(input: &Standardization) -> Result<InputScaling> {
    let (mut multipliers, mut shifts) = ([0; FEATURES], [0; FEATURES]);
    for i in 0..FEATURES {
        let factor = INPUT_STEPS / (input.sigma[i] * PX);
        (multipliers[i], shifts[i]) = multiplier_and_shift(factor, INPUT_MULTIPLIER_BITS)
            .with_context(|| format!("scaling of feature {i}"))?;
    }
    Ok(InputScaling {
        mean: features_from_q16(&FeatureList::from_fn(FEATURES, |i| q16(input.mean[i])))?,
        multipliers,
        shifts,
    })
}

/// A layer of integers, and their scales.
pub(crate) struct QuantizedLayer {
    pub spec: LayerSpec,
    /// The value of one step of a weight, for each output.
    pub scales: Vec<f64>,
    /// The value of one step of the layer's input.
    pub step: f64,
}

/// The layers of a network as the chip holds them.
pub(crate) fn layers(network: &Network) -> Result<Vec<QuantizedLayer>> {
    let last = network.layers.len().saturating_sub(1);
    let mut form = Form {
        step: 1.0 / INPUT_STEPS,
        largest_input: LARGEST_INPUT,
        // Its inputs have 16 bits, whatever width the other layers have.
        width: WeightWidth::Int16,
    };
    // Weight width after a hidden layer, and the layer's largest activation. The output layer has
    // few rows: int16 costs hardly anything there, and avoids coarse steps in the last activations
    // and in the answer.
    let held = |layer: usize| match network.is_coarse(layer) {
        true => (WeightWidth::Int8, LARGEST_ACTIVATION8),
        false => (WeightWidth::Int16, LARGEST_ACTIVATION16),
    };
    let mut layers = Vec::with_capacity(network.layers.len());
    for (i, layer) in network.layers.iter().enumerate() {
        let quantized = if i < last {
            let (width, largest) = held(i);
            let next = network.activation_max[i] / f64::from(largest);
            let output = |_| Output {
                factor: 1.0 / next,
                offset: 0.0,
            };
            let mut quantized = quantize_layer(layer, &form, output);
            form = Form {
                step: next,
                largest_input: largest,
                width,
            };
            if let Ok(quantized) = &mut quantized {
                quantized.spec.largest_activation = largest;
            }
            quantized
        } else {
            let (mean, sigma) = (&network.output.mean, &network.output.sigma);
            let units = network.meaning.chip_units();
            let output = |o: usize| Output {
                factor: sigma[o] * units[o],
                offset: mean[o] / sigma[o],
            };
            quantize_layer(layer, &form, output)
        };
        layers.push(quantized.with_context(|| format!("layer {i}"))?);
    }
    Ok(layers)
}

/// The format of a layer.
#[derive(Clone, Copy)]
struct Form {
    /// The value of one step of the layer's input.
    step: f64,
    /// Its input's largest magnitude, in steps.
    largest_input: u16,
    width: WeightWidth,
}

/// The scaling of a layer's output y = W·x + b: (y + offset)·factor.
struct Output {
    factor: f64,
    offset: f64,
}

fn quantize_layer(
    layer: &Layer,
    form: &Form,
    output: impl Fn(usize) -> Output,
) -> Result<QuantizedLayer> {
    let mut spec = LayerSpec {
        inputs: u16::try_from(layer.inputs())?,
        outputs: u16::try_from(layer.outputs())?,
        weight_width: form.width,
        largest_activation: 0,
        weights: Vec::with_capacity(layer.inputs() * layer.outputs()),
        biases: Vec::new(),
        multipliers: Vec::new(),
        shifts: Vec::new(),
    };
    let step = form.step;
    let limit = f64::from(form.width.largest_weight());
    let mut scales = Vec::with_capacity(layer.outputs());
    for (o, (row, &bias)) in layer.weights.iter().zip(&layer.bias).enumerate() {
        let bias = f64::from(bias) + output(o).offset;
        let scale = match weight_scale(row, bias, form) {
            scale if scale > 0.0 => scale,
            // A row of zeros without bias is zero at any scale.
            _ => 1.0,
        };
        scales.push(scale);
        spec.weights
            .extend(row.iter().map(|&w| round_weight(w, scale, limit)));
        spec.biases.push((bias / (scale * step)).round() as i32);
        let (multiplier, shift) =
            multiplier_and_shift(scale * step * output(o).factor, LAYER_MULTIPLIER_BITS)
                .with_context(|| format!("scaling of output {o}"))?;
        spec.multipliers.push(multiplier);
        spec.shifts.push(shift);
    }
    Ok(QuantizedLayer { spec, scales, step })
}

/// The value of one step of a row's weights. It is as small as the weights' width and the proof
/// against overflow allow; rounding may increase each weight by up to half a step.
fn weight_scale(row: &[f32], bias: f64, form: &Form) -> f64 {
    let sizes = || row.iter().map(|&w| f64::from(w.abs()));
    let largest = sizes().fold(0.0, f64::max);
    let input = f64::from(form.largest_input);
    let sum = sizes().sum::<f64>() * input + bias.abs() / form.step;
    let room = LARGEST_SUM - 0.5 * row.len() as f64 * input - 1.0;
    (largest / f64::from(form.width.largest_weight())).max(sum / room)
}

fn round_weight(weight: f32, scale: f64, limit: f64) -> i16 {
    (f64::from(weight) / scale).round().clamp(-limit, limit) as i16
}

/// m and s with m / 2^s nearest to `factor`; m as large as `bits` allows, and s at most 62.
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
    // A factor too small even for 2^-62 gives 0 on the chip; the smallest multiplier does the same.
    Ok((scaled.round().max(1.0) as u32, shift))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_sensor::force::model::ModelError;
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

    /// A device would compare five markers' motion with four rest positions.
    #[test]
    fn a_film_of_more_markers_than_rest_is_refused() {
        let models = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
        let weights = Weights::load(&models.join("default.weights")).unwrap();
        let mut spec = spec(&weights).unwrap();
        let film = spec.forward.as_mut().unwrap();
        (film.own, film.other, film.weight) = (None, None, None);
        film.tables.dots.push(film.tables.dots[0].clone());
        for places in [
            &mut film.rest_image.at,
            &mut film.rest_image.film_mm,
            &mut film.noise.rest_px,
        ] {
            places.push(places[0]);
        }
        let alone = film.to_bytes();
        assert!(hivtac_sensor::force::forward::Forward::parse(&alone).is_ok());
        let refused = spec.encode().unwrap_err();
        let is_it = |error: &ModelError| {
            matches!(
                error,
                ModelError::Field {
                    name: "markers",
                    ..
                }
            )
        };
        assert!(is_it(&refused), "{refused}");
    }

    fn form(width: WeightWidth) -> Form {
        Form {
            step: 1.0 / 4096.0,
            largest_input: 127,
            width,
        }
    }

    const ONE: Output = Output {
        factor: 1.0,
        offset: 0.0,
    };

    #[test]
    fn the_largest_weight_of_each_row_is_127() {
        let layer = Layer {
            weights: vec![vec![0.5, -1.0, 0.25], vec![0.125, 0.0, 0.25]],
            bias: vec![0.5, 0.0],
        };
        let spec = quantize_layer(&layer, &form(WeightWidth::Int8), |_| ONE)
            .unwrap()
            .spec;
        assert_eq!(spec.weights, [64, -127, 32, 64, 0, 127]);
        assert_eq!(spec.biases, [260_096, 0]);
        let spec = quantize_layer(&layer, &form(WeightWidth::Int16), |_| ONE)
            .unwrap()
            .spec;
        assert_eq!(spec.weights, [16_384, -32_767, 8192, 16_384, 0, 32_767]);
    }

    #[test]
    fn wide_rows_keep_within_the_accumulator() {
        let layer = Layer {
            weights: vec![vec![0.3; 512]],
            bias: vec![-3.0],
        };
        let form = Form {
            largest_input: 4095,
            ..form(WeightWidth::Int16)
        };
        let spec = quantize_layer(&layer, &form, |_| ONE).unwrap().spec;
        let products: i64 = spec.weights.iter().map(|&w| i64::from(w) * 4095).sum();
        let bound = products + i64::from(spec.biases[0]).abs();
        assert!(
            bound <= i64::from(i32::MAX) && bound > i64::from(i32::MAX) / 1000 * 998,
            "{bound}"
        );
    }

    #[test]
    fn rows_without_weights_keep_their_bias() {
        let layer = Layer {
            weights: vec![vec![0.0; 3]; 2],
            bias: vec![0.0, 7.0],
        };
        let output = |_| Output {
            factor: 1000.0,
            offset: 0.0,
        };
        let spec = quantize_layer(&layer, &form(WeightWidth::Int8), output)
            .unwrap()
            .spec;
        assert_eq!(spec.biases[0], 0);
        let (m, s) = (f64::from(spec.multipliers[1]), i32::from(spec.shifts[1]));
        let y = f64::from(spec.biases[1]) * m / 2_f64.powi(s);
        assert!((y - 7000.0).abs() < 1e-3, "{y}");
    }

    proptest! {
        #[test]
        fn multiplier_and_shift_stand_for_the_factor(
            exponent in -30_i32..20,
            mantissa in 1.0..2.0_f64,
        ) {
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
