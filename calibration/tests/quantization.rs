//! Compares the exported network with its floats: the difference never exceeds the sum of its
//! roundings.

use hivtac_calibration::data::conditions::Conditions;
use hivtac_calibration::data::range::Range;
use hivtac_calibration::data::rest::{Rest, features_from_q16, q16};
use hivtac_calibration::network::{
    Arithmetic, INPUTS, Layer, Meaning, Network, OUTPUTS, Standardization,
};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::{Training, Uncertainty, Weights};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network as ChipNetwork;
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use proptest::collection::vec;
use proptest::prelude::*;

const INPUT_STEP: f64 = 1.0 / 4096.0;

fn layer(inputs: usize, outputs: usize) -> impl Strategy<Value = Layer> {
    let weights = vec(vec(-1.0..1.0_f32, inputs), outputs);
    (weights, vec(-0.5..0.5_f32, outputs)).prop_map(|(weights, bias)| Layer { weights, bias })
}

fn network() -> impl Strategy<Value = Network> {
    let input = (vec(0.0..300.0, INPUTS), vec(0.5..20.0, INPUTS));
    let output = (vec(-0.1..0.1, OUTPUTS), vec(0.001..0.1, OUTPUTS));
    (
        input,
        output,
        layer(INPUTS, 9),
        layer(9, 6),
        layer(6, OUTPUTS),
    )
        .prop_map(|(i, o, a, b, c)| Network {
            meaning: Meaning::ForceVector,
            arithmetic: Arithmetic::Int8PerChannel,
            input: Standardization {
                mean: i.0,
                sigma: i.1,
            },
            output: Standardization {
                mean: o.0,
                sigma: o.1,
            },
            activation_max: Vec::new(),
            layers: vec![a, b, c],
        })
}

fn weights(network: Network) -> Weights {
    Weights {
        format: Weights::format(),
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
        rest: Rest {
            features_q16: [q16(16.0); INPUTS].into(),
            areas_px: [200; 4].into(),
        },
        range: Range::default(),
        uncertainty: Uncertainty::default(),
        training: Training::default(),
        film: None,
        network: Some(network),
    }
}

/// Features within two deviations of the means, on the 1/65,536 px grid.
fn rows(network: &Network, unit: &[[f64; INPUTS]]) -> Vec<[Q<16, i64>; INPUTS]> {
    let (mean, sigma) = (&network.input.mean, &network.input.sigma);
    let px = |row: &[f64; INPUTS], i: usize| (mean[i] + 2.0 * sigma[i] * row[i]).max(0.0);
    unit.iter()
        .map(|row| std::array::from_fn(|i| q16(px(row, i))))
        .collect()
}

/// The largest change of a layer's outputs due to the rounding of weights, bias and inputs; `x` are
/// its inputs, `e` their errors.
fn layer_error(layer: &Layer, x: &[f64], e: &[f64], step: f64) -> Vec<f64> {
    let one = |row: &Vec<f32>| {
        let scale = row.iter().map(|w| f64::from(w.abs())).fold(0.0, f64::max) / 127.0;
        let products = row.iter().zip(x).zip(e);
        let sum: f64 = products
            .map(|((w, x), e)| f64::from(w.abs()) * e + scale / 2.0 * (x.abs() + e))
            .sum();
        sum + scale * step / 2.0
    };
    layer.weights.iter().map(one).collect()
}

fn apply(layer: &Layer, x: &[f64]) -> Vec<f64> {
    let dot = |row: &Vec<f32>| -> f64 { row.iter().zip(x).map(|(w, x)| f64::from(*w) * x).sum() };
    layer
        .weights
        .iter()
        .zip(&layer.bias)
        .map(|(row, b)| dot(row) + f64::from(*b))
        .collect()
}

/// The bound for each output, N.
fn bound(network: &Network, features_px: &[f64; INPUTS]) -> Vec<f64> {
    let mut x = network.input.forward(features_px);
    let grid = |sigma: &f64| 0.5 / 65_536.0 / sigma;
    let mut e: Vec<f64> = network
        .input
        .sigma
        .iter()
        .map(|s| INPUT_STEP / 2.0 + grid(s))
        .collect();
    let mut step = INPUT_STEP;
    let (last, hidden) = network.layers.split_last().unwrap();
    for (layer, max) in hidden.iter().zip(&network.activation_max) {
        let next = max / 127.0;
        e = layer_error(layer, &x, &e, step)
            .iter()
            .map(|e| e + next / 2.0)
            .collect();
        x = apply(layer, &x).iter().map(|v| v.max(0.0)).collect();
        step = next;
    }
    let e = layer_error(last, &x, &e, step);
    e.iter()
        .zip(&network.output.sigma)
        .map(|(e, sigma)| e * sigma + 0.5e-6)
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn forces_stay_within_what_rounding_explains(
        mut network in network(),
        unit in vec(prop::array::uniform11(-1.0..1.0), 20),
    ) {
        let rows = rows(&network, &unit);
        let px: Vec<[f64; INPUTS]> = rows
            .iter()
            .map(|row| row.map(|number| number.to_f64()))
            .collect();
        network.activation_max = network.activation_maxima(&px);
        let weights = weights(network);
        let network = weights.network().unwrap();
        let bytes = export(&weights).unwrap();
        let model = Model::parse(&bytes).unwrap();
        let mut chip = ChipNetwork::new();
        for (row, px) in rows.iter().zip(&px) {
            let output = chip.run(&model, &features_from_q16(&(*row).into()).unwrap(), &model.rest.features);
            let (float, bound) = (network.predict(px), bound(network, px));
            for i in 0..OUTPUTS {
                let error = (f64::from(output.values[i]) / 1e6 - float[i]).abs();
                // A thousandth for multipliers, which have 23 bits and more.
                prop_assert!(error <= bound[i] * 1.001 + 1e-9, "{error} N is above {} N", bound[i]);
            }
        }
    }
}

#[test]
fn networks_that_the_chip_cannot_hold_are_refused() {
    let ones = |n: usize| Standardization {
        mean: vec![0.0; n],
        sigma: vec![1.0; n],
    };
    let flat = |inputs: usize, outputs: usize| Layer {
        weights: vec![vec![0.1; inputs]; outputs],
        bias: vec![0.0; outputs],
    };
    let wide = Network {
        meaning: Meaning::ForceVector,
        arithmetic: Arithmetic::Int8PerChannel,
        input: ones(INPUTS),
        output: ones(OUTPUTS),
        activation_max: vec![1.0],
        layers: vec![flat(INPUTS, 513), flat(513, OUTPUTS)],
    };
    let error = export(&weights(wide.clone())).unwrap_err().to_string();
    assert!(error.contains("512"), "{error}");

    let mut narrow = Network {
        layers: vec![flat(INPUTS, 4), flat(4, OUTPUTS)],
        ..wide
    };
    assert!(export(&weights(narrow.clone())).is_ok());
    narrow.input.sigma[3] = 1e-9;
    let error = format!("{:#}", export(&weights(narrow)).unwrap_err());
    assert!(error.contains("feature 3"), "{error}");
}
