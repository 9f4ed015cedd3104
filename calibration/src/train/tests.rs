use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network as ChipNetwork;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::mlp::Mlp;
use super::*;
use crate::data::conditions::Conditions;
use crate::data::range::Range;
use crate::data::rest::{Rest, features_from_q16};
use crate::network::{Arithmetic, Meaning};
use crate::quantize::export;
use crate::weights::{Training, Uncertainty, Weights};
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;

const ROWS: usize = 200;

fn weights(network: Network) -> Weights {
    Weights {
        format: Weights::format(),
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
        rest: Rest {
            features_q16: [Q::from_int(16); INPUTS].into(),
            areas_px: [200; 4].into(),
        },
        range: Range::default(),
        uncertainty: Uncertainty::default(),
        training: Training::default(),
        film: None,
        network: Some(network),
    }
}

/// Options in which every row has the same weight.
fn plain() -> Options {
    Options {
        direction_weight: None,
        ..Options::default()
    }
}

/// Features on the chip's grid.
fn features(random: &mut ChaCha8Rng) -> [Q<16, i64>; INPUTS] {
    std::array::from_fn(|_| Q::from_bits(random.random_range(90 << 16..110_i64 << 16)))
}

/// Training's forward pass and the exported model on the chip give exactly the same integers.
fn same_integers(meaning: Meaning, arithmetic: Arithmetic) {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let q16: Vec<_> = (0..ROWS).map(|_| features(&mut random)).collect();
    let samples = Samples {
        features: q16
            .iter()
            .map(|row| row.map(|number| number.to_f64()))
            .collect(),
        answers: vec![[0.01, 0.02, -0.1]; ROWS],
        ..Samples::default()
    };
    let options = Options {
        meaning,
        arithmetic,
        ..plain()
    };
    let mlp = Mlp::random(&[INPUTS, 16, 16, OUTPUTS], &mut random);
    let [input, _] = scaling(&samples, Meaning::ForceVector).unwrap();
    let output = Standardization {
        mean: vec![0.1; OUTPUTS],
        sigma: vec![0.05; OUTPUTS],
    };
    let mut network = Network {
        meaning,
        arithmetic,
        input,
        output,
        activation_max: Vec::new(),
        layers: mlp.to_layers(),
    };
    // Slightly below the largest, so that some saturate.
    network.activation_max = network
        .activation_maxima(&samples.features)
        .iter()
        .map(|max| 0.8 * max)
        .collect();

    let state = State::new(&samples, &Samples::default(), &options).unwrap();
    let steps = state.chip_inputs();
    let seen = rounded::forward(&network, steps, ROWS).unwrap();
    let bytes = export(&weights(network)).unwrap();
    let model = Model::parse(&bytes).unwrap();
    let mut chip = ChipNetwork::new();
    for (i, q16) in q16.iter().enumerate() {
        let features = features_from_q16(&(*q16).into()).unwrap();
        let values = chip.run(&model, &features, &model.rest.features).values;
        for (o, &value) in values.iter().enumerate() {
            assert_eq!(
                i64::from(value),
                seen.values[o * ROWS + i],
                "row {i}, output {o}"
            );
        }
    }
    assert!(seen.trace.open.iter().any(|layer| layer.contains(&false)));
}

#[test]
fn training_rounds_as_the_chip_does() {
    for meaning in [Meaning::ForceVector, Meaning::AnglesMagnitude] {
        for arithmetic in [Arithmetic::Int8PerChannel, Arithmetic::Int16] {
            same_integers(meaning, arithmetic);
        }
    }
}

/// Rows whose answers are simple functions of the features.
fn easy(rows: usize, seed: u64) -> Samples {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let features: Vec<[f64; INPUTS]> = (0..rows)
        .map(|_| features(&mut random).map(|number| number.to_f64()))
        .collect();
    let answer = |f: &[f64; INPUTS]| [f[0] - f[1], (f[2] - 100.0).abs(), f[3] * f[4] / 100.0];
    Samples {
        answers: features.iter().map(answer).collect(),
        forces_n: features.iter().map(answer).collect(),
        features,
        ..Samples::default()
    }
}

#[test]
fn rounding_costs_little_after_training_with_it() {
    let (training, held_out) = (easy(1500, 1), easy(300, 2));
    let options = Options {
        hidden: vec![32],
        batch: 64,
        epochs: 60,
        rounded_epochs: 30,
        ..plain()
    };
    let mut losses = Vec::new();
    train(&training, &held_out, &options, |p| losses.push(p)).unwrap();
    let [float, rounded] = [losses[59].held_out, losses[89].held_out];
    assert!(float < 0.1 && rounded < 1.5 * float, "{float} {rounded}");
}

#[test]
fn the_best_pass_is_kept() {
    let (training, mut held_out) = (easy(200, 1), easy(100, 2));
    // The better the training rows are learnt, the larger the error on these.
    let mean = Standardization::of_answers(&held_out.answers).unwrap().mean;
    for answers in &mut held_out.answers {
        *answers = std::array::from_fn(|o| 2.0 * mean[o] - answers[o]);
    }
    let options = Options {
        hidden: vec![64],
        epochs: 40,
        rounded_epochs: 0,
        learning_rate: 0.02,
        ..plain()
    };
    let mut losses = Vec::new();
    let network = train(&training, &held_out, &options, |p| losses.push(p.held_out)).unwrap();
    let best = losses.iter().copied().fold(f64::MAX, f64::min);
    assert!(losses[39] > 1.01 * best, "the last pass is the best");
    let square = |(features, answers): (&[f64; INPUTS], &[f64; OUTPUTS])| -> f64 {
        let predicted = network.predict(features);
        let error = |o: usize| (predicted[o] - answers[o]) / network.output.sigma[o];
        (0..OUTPUTS).map(|o| error(o).powi(2)).sum()
    };
    let rows = held_out.features.iter().zip(&held_out.answers);
    let loss = rows.map(square).sum::<f64>() / (held_out.answers.len() * OUTPUTS) as f64;
    assert!((loss / best - 1.0).abs() < 1e-3, "{loss} {best}");
}

#[test]
fn a_network_can_be_gone_on_from() {
    let training = easy(500, 1);
    let options = Options {
        hidden: vec![16],
        epochs: 10,
        rounded_epochs: 0,
        ..plain()
    };
    let start = train(&training, &Samples::default(), &options, |_| ()).unwrap();
    let more = Options {
        start: Some(start.clone()),
        hidden: vec![3],
        epochs: 0,
        ..options.clone()
    };
    assert_eq!(
        train(&training, &Samples::default(), &more, |_| ()).unwrap(),
        start
    );
}

#[test]
fn numbers_that_are_not_finite_are_refused_with_the_row() {
    let mut training = easy(10, 1);
    training.features[4][2] = f64::NAN;
    let error = train(&training, &Samples::default(), &Options::default(), |_| ()).unwrap_err();
    assert!(
        format!("{error:#}").contains("training data: row 4"),
        "{error:#}"
    );
}
