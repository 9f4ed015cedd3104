//! Runs the forward pass as the chip does: the exporter's integers, the chip's arithmetic, with
//! every rounding.
//!
//! The backward pass treats each rounding as the identity and differentiates each limit as it is
//! (straight-through estimator, Bengio et al. 2013).

use anyhow::Result;

use super::mlp::{Dense, Mlp, Trace};
use super::product::product;
use crate::network::Network;
use crate::quantize::{QuantizedLayer, layers};

/// The result of a forward pass on the chip's integers.
pub(super) struct Rounded {
    /// The chip's outputs for each row: µN, or m°.
    #[cfg(test)]
    pub values: Vec<i64>,
    /// The values as floats, for the backward pass; its outputs are standardized.
    pub trace: Trace,
    /// The layers in floats that the chip's integers represent.
    pub mlp: Mlp,
}

/// Runs the integers of `network`, whose layers are those in training, on standardized inputs in
/// the chip's steps.
pub(super) fn forward(network: &Network, inputs: Vec<f64>, rows: usize) -> Result<Rounded> {
    let quantized = layers(network)?;
    let mlp = Mlp {
        layers: quantized.iter().map(dequantized).collect(),
    };
    let (mut trace, mut values) = (Trace::default(), Vec::new());
    let mut x = inputs;
    for (i, layer) in quantized.iter().enumerate() {
        trace
            .inputs
            .push(x.iter().map(|&x| (x * layer.step) as f32).collect());
        let results = rescaled(layer, &x, rows);
        if i + 1 < quantized.len() {
            let largest = i64::from(layer.spec.largest_activation);
            trace
                .open
                .push(results.iter().map(|r| (0..=largest).contains(r)).collect());
            x = results
                .iter()
                .map(|&r| r.clamp(0, largest) as f64)
                .collect();
        } else {
            values = results;
        }
    }
    trace.outputs = standardized(network, &values, rows);
    Ok(Rounded {
        #[cfg(test)]
        values,
        trace,
        mlp,
    })
}

/// The rows of a layer after its rescaling, before any limit. `f64` holds every sum exactly.
fn rescaled(layer: &QuantizedLayer, x: &[f64], rows: usize) -> Vec<i64> {
    let spec = &layer.spec;
    let weights: Vec<f64> = spec.weights.iter().map(|&w| f64::from(w)).collect();
    let sums = product(&weights, x, [spec.outputs.into(), spec.inputs.into(), rows]);
    let mut results = Vec::with_capacity(sums.len());
    for (o, sums) in sums.chunks(rows).enumerate() {
        let (bias, shift) = (i64::from(spec.biases[o]), spec.shifts[o]);
        let multiplier = i64::from(spec.multipliers[o]);
        let rescale = |&sum: &f64| ((sum as i64 + bias) * multiplier + (1 << (shift - 1))) >> shift;
        results.extend(sums.iter().map(rescale));
    }
    results
}

fn dequantized(layer: &QuantizedLayer) -> Dense {
    let inputs = usize::from(layer.spec.inputs);
    let rows = layer.spec.weights.chunks(inputs).zip(&layer.scales);
    let weights =
        rows.flat_map(|(row, &scale)| row.iter().map(move |&w| (f64::from(w) * scale) as f32));
    let biases = layer.spec.biases.iter().zip(&layer.scales);
    Dense {
        weights: weights.collect(),
        bias: biases
            .map(|(&b, &scale)| (f64::from(b) * scale * layer.step) as f32)
            .collect(),
    }
}

fn standardized(network: &Network, values: &[i64], rows: usize) -> Vec<f32> {
    let (output, units) = (&network.output, network.meaning.chip_units());
    let component = |(o, values): (usize, &[i64])| -> Vec<f32> {
        let of_value = |&v: &i64| ((v as f64 / units[o] - output.mean[o]) / output.sigma[o]) as f32;
        values.iter().map(of_value).collect()
    };
    values
        .chunks(rows)
        .enumerate()
        .flat_map(component)
        .collect()
}
