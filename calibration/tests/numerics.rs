//! Tests training, import and export at extreme numbers (`docs/numerics.md`). Tests that measure
//! print a row of that document's table: `cargo test --release -p hivtac-calibration --test
//! calibration -- numerics --nocapture`.

use std::collections::HashMap;

use hivtac_calibration::data::conditions::Conditions;
use hivtac_calibration::data::range::Range;
use hivtac_calibration::data::rest::{Rest, features_from_q16, q16};
use hivtac_calibration::import::parse;
use hivtac_calibration::network::{INPUTS, Layer, Network, OUTPUTS, Standardization};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::{Options, Samples, train};
use hivtac_calibration::weights::{Training, Uncertainty, Weights};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::{Network as ChipNetwork, Output};
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use safetensors::serialize;
use safetensors::tensor::{Dtype, TensorView};

/// The markers' rest position, px; every feature is a whole multiple of 1/65,536.
const REST: [f64; INPUTS] = [
    100.0, 60.0, 220.0, 60.0, 220.0, 180.0, 100.0, 180.0, 160.0, 120.0, 14_400.0,
];

fn weights(network: Network) -> Weights {
    Weights {
        format: Weights::format(),
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
        rest: Rest {
            features_q16: REST.map(q16).into(),
            areas_px: [190; 4].into(),
        },
        range: Range::default(),
        uncertainty: Uncertainty::default(),
        training: Training::default(),
        film: None,
        network: Some(network),
    }
}

/// The chip's answer to features, in N.
fn on_the_chip(network: &Network, features: &[f64; INPUTS]) -> ([f64; 3], Output) {
    let bytes = export(&weights(network.clone())).unwrap();
    let model = Model::parse(&bytes).unwrap();
    let features = features_from_q16(&features.map(q16).into()).unwrap();
    let rest = model.rest.features;
    let output = ChipNetwork::new().run(&model, &features, &rest);
    (output.values.map(|micro| f64::from(micro) / 1e6), output)
}

fn small() -> Options {
    Options {
        hidden: vec![8, 8],
        epochs: 40,
        rounded_epochs: 20,
        batch: 64,
        learning_rate: 5e-3,
        direction_weight: None,
        ..Options::default()
    }
}

fn trained(features: Vec<[f64; INPUTS]>, answers: Vec<[f64; OUTPUTS]>) -> Network {
    let samples = Samples {
        features,
        answers,
        ..Samples::default()
    };
    train(&samples, &Samples::default(), &small(), |_| ()).unwrap()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// Features of markers that move by multiples of `px`.
fn moved(px: f64) -> [f64; INPUTS] {
    std::array::from_fn(|i| REST[i] + px * [1.0, -1.0, 0.5][i % 3])
}

fn row(stage: &str, tried: &str, bound: &str, worst: String) {
    println!("| {stage} | {tried} | {bound} | {worst} |");
}

#[test]
fn a_feature_that_never_varies_says_nothing() {
    // All rows with the same features; then only one feature that varies.
    let constant = Standardization::of(&vec![REST; 100_000]).unwrap();
    assert_eq!(constant.mean, REST);
    assert_eq!(constant.sigma, [1.0; INPUTS]);
    let features: Vec<_> = (0..200)
        .map(|i| {
            let mut features = REST;
            features[0] += f64::from(i % 20) / 4.0;
            features
        })
        .collect();
    let answers = features
        .iter()
        .map(|f| [0.0, 0.0, -0.02 * (f[0] - REST[0])])
        .collect();
    let network = trained(features.clone(), answers);
    assert!(network.input.sigma[1..].iter().all(|&sigma| sigma == 1.0));
    let mut worst = 0.0_f64;
    for features in &features {
        let (found, output) = on_the_chip(&network, features);
        assert!(!output.input_saturated);
        worst = worst.max(apart(found, network.predict(features)));
    }
    assert!(worst < 0.002, "{worst}");
    row(
        "a data set in which ten of eleven features never vary",
        "200 rows, 11-8-8-3 int8, chip against float",
        "2 mN",
        format!("{:.3} mN", 1e3 * worst),
    );
}

/// A deviation below a feature's step of 1/65,536 px is a mistake that must be reported, not
/// exported.
#[test]
fn deviations_are_exported_or_refused() {
    let network = |sigma: f64| {
        let mut network = trained(
            vec![moved(0.0), moved(1.0)],
            vec![[0.0; 3], [0.0, 0.0, -0.1]],
        );
        network.input.sigma[3] = sigma;
        weights(network)
    };
    for sigma in [1.6e-8, 1e-6, 1.0, 1e3, 1e9, 1e30, 1e300] {
        let bytes = export(&network(sigma)).unwrap_or_else(|error| panic!("{sigma}: {error:#}"));
        let model = Model::parse(&bytes).unwrap();
        let (m, s) = (model.input.multipliers[3], model.input.shifts[3]);
        let factor = 4096.0 / (sigma * 65_536.0);
        let found = f64::from(m) / 2_f64.powi(s.into());
        // A factor too small for 2⁻⁶² keeps the smallest value: it moves no input.
        let least = 2_f64.powi(-62) * f64::from(1 << 23);
        assert!(
            (found / factor - 1.0).abs() < 1.0 / f64::from(1 << 23) || factor < least,
            "{sigma}"
        );
    }
    for sigma in [
        1.4e-8,
        1e-300,
        f64::MIN_POSITIVE / 4.0,
        0.0,
        -1.0,
        f64::NAN,
        f64::INFINITY,
    ] {
        let error = format!("{:#}", export(&network(sigma)).unwrap_err());
        assert!(
            error.contains("feature 3") || error.contains("above zero"),
            "{sigma}: {error}"
        );
    }
    row(
        "standard deviation of a feature, px",
        "1.6e-8 to 1e300 exported; 1.4e-8 and less, NaN and ∞ refused",
        "exported: 2⁻²³ of its factor",
        "as the bound".into(),
    );
}

#[test]
fn one_sample_and_duplicates_train_to_what_they_say() {
    let label = [0.01, -0.02, -0.15];
    let mut worst = 0.0_f64;
    let alone = trained(vec![moved(3.0)], vec![label]);
    worst = worst.max(apart(alone.predict(&moved(3.0)), label));
    worst = worst.max(apart(on_the_chip(&alone, &moved(3.0)).0, label));
    let same = trained(vec![moved(3.0); 500], vec![label; 500]);
    worst = worst.max(apart(on_the_chip(&same, &moved(3.0)).0, label));
    // The same label for all features.
    let features: Vec<_> = (0..300).map(|i| moved(f64::from(i % 30) / 5.0)).collect();
    let constant = trained(features.clone(), vec![label; 300]);
    for features in &features {
        worst = worst.max(apart(on_the_chip(&constant, features).0, label));
    }
    assert!(worst < 1e-4, "{worst}");
    let two = trained(
        (0..400).map(|i| moved(f64::from(i % 2) * 4.0)).collect(),
        (0..400)
            .map(|i| if i % 2 == 0 { [0.0; 3] } else { label })
            .collect(),
    );
    let reported = apart(on_the_chip(&two, &moved(4.0)).0, label)
        .max(apart(on_the_chip(&two, &moved(0.0)).0, [0.0; 3]));
    assert!(reported < 0.01, "{reported}");
    row(
        "one sample, 500 copies of one, a constant label",
        "11-8-8-3, float and chip, error of a component",
        "0.1 mN",
        format!("{:.4} mN", 1e3 * worst),
    );
    row(
        "200 copies of each of two samples",
        "the same",
        "10 mN",
        format!("{:.2} mN", 1e3 * reported),
    );
}

/// Imports a network from a safetensors file. The first unit of its first layer has this weight
/// from every input and this bias; its first input has this sigma.
fn imported(weight: f64, bias: f64, sigma: f64) -> anyhow::Result<Network> {
    let layer = |inputs: usize, outputs: usize| {
        (0..inputs * outputs)
            .map(|i| 0.02 * ((i % 7) as f64 - 3.0))
            .collect::<Vec<_>>()
    };
    let mut tensors: Vec<(&str, Vec<usize>, Vec<f64>)> = vec![
        ("input.mean", vec![INPUTS], REST.to_vec()),
        ("input.sigma", vec![INPUTS], vec![2.0; INPUTS]),
        ("output.mean", vec![OUTPUTS], vec![0.0, 0.0, -0.1]),
        ("output.sigma", vec![OUTPUTS], vec![0.05; OUTPUTS]),
        ("0.weight", vec![8, INPUTS], layer(INPUTS, 8)),
        ("0.bias", vec![8], vec![0.1; 8]),
        ("2.weight", vec![OUTPUTS, 8], layer(8, OUTPUTS)),
        ("2.bias", vec![OUTPUTS], vec![0.0; OUTPUTS]),
    ];
    tensors[4].2[..INPUTS].fill(weight);
    tensors[5].2[0] = bias;
    tensors[1].2[0] = sigma;
    let bytes: Vec<(&str, Vec<usize>, Vec<u8>)> = tensors
        .into_iter()
        .map(|(name, shape, values)| {
            (
                name,
                shape,
                values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            )
        })
        .collect();
    let views = bytes.iter().map(|(name, shape, data)| {
        (
            *name,
            TensorView::new(Dtype::F64, shape.clone(), data).unwrap(),
        )
    });
    let metadata = HashMap::from([("meaning".to_owned(), "force-vector".to_owned())]);
    parse(&serialize(views, Some(metadata))?)
}

#[test]
fn imported_numbers_that_are_none_are_refused() {
    for (weight, bias, sigma) in [
        (f64::NAN, 0.0, 1.0),
        (f64::INFINITY, 0.0, 1.0),
        (1e39, 0.0, 1.0),
        (0.1, f64::NAN, 1.0),
        (0.1, f64::NEG_INFINITY, 1.0),
        (0.1, 0.0, f64::NAN),
        (0.1, 0.0, f64::INFINITY),
        (0.1, 0.0, 0.0),
    ] {
        let error = format!("{:#}", imported(weight, bias, sigma).unwrap_err());
        assert!(
            error.contains("finite") || error.contains("above zero"),
            "{weight} {bias} {sigma}: {error}"
        );
    }
}

/// A row of weights that single precision holds only as denormals, or as 0, counts as a row of
/// zeros, with any bias.
#[test]
fn denormal_weights_are_as_none() {
    let mut worst = 0.0_f64;
    for bias in [0.0, 1e-40, -0.3, 0.3] {
        let without = imported(0.0, bias, 2.0).unwrap();
        for weight in [1e-40, -1.4e-45, 1e-310, f64::from(f32::MIN_POSITIVE) / 2.0] {
            let network = imported(weight, bias, 2.0).unwrap();
            let network = Network {
                activation_max: vec![1.5],
                ..network
            };
            let without = Network {
                activation_max: vec![1.5],
                ..without.clone()
            };
            for px in [-8.0, 0.0, 3.0] {
                let found = on_the_chip(&network, &moved(px)).0;
                worst = worst.max(apart(found, on_the_chip(&without, &moved(px)).0));
            }
        }
    }
    assert!(worst <= 2e-6, "{worst}");
    row(
        "denormal float32 weights",
        "four sizes beside four biases, chip against the same without them",
        "2 µN",
        format!("{:.1} µN", 1e6 * worst),
    );
    let layer = Layer {
        weights: vec![vec![f32::MIN_POSITIVE / 4.0; INPUTS]; OUTPUTS],
        bias: vec![0.0; OUTPUTS],
    };
    let alone = Network {
        layers: vec![layer],
        activation_max: Vec::new(),
        ..imported(0.1, 0.0, 2.0).unwrap()
    };
    assert_eq!(on_the_chip(&alone, &moved(5.0)).0, [0.0, 0.0, -0.1]);
}
