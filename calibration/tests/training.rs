//! Tests small trainings: they learn, are repeatable, and report data from which they cannot learn.

use hivtac_calibration::data::dataset::{Dataset, Loads, Recipe, generate};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::evaluation::{Evaluation, by_place};
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::{INPUTS, Meaning, OUTPUTS};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::{DirectionWeight, Options, Samples, train};

/// A tip in the film's middle.
const MIDDLE: Range = Range {
    force_n: 0.22,
    alpha_deg: 11.0,
    beta_deg: 8.8,
    place_mm: 0.0,
};

fn data() -> Dataset {
    let recipe = Recipe {
        loads: Loads::Random(392),
        rest: 8,
        range: MIDDLE,
        ..Recipe::default()
    };
    generate(&recipe, || ()).unwrap()
}

fn small() -> Options {
    Options {
        hidden: vec![16, 16],
        epochs: 60,
        rounded_epochs: 30,
        learning_rate: 5e-3,
        direction_weight: None,
        ..Options::default()
    }
}

#[test]
fn a_few_hundred_frames_teach_the_force() {
    let mut losses = Vec::new();
    let fitted = fit(&data(), &small(), |progress| losses.push(progress)).unwrap();
    assert_eq!(losses.len(), 90);
    assert_eq!(losses.iter().filter(|p| p.rounded).count(), 30);
    // Standardized forces: answering always their mean has a loss of 1.
    let last = losses.last().unwrap();
    assert!(last.loss < 0.1, "{last:?}");
    // Answering always the mean force has an error of 58 mN in |F| (0.2 N / √12).
    assert!(
        fitted.quantized.magnitude_rmse_n() < 0.012,
        "{:?}",
        fitted.quantized.magnitude_rmse_n()
    );
    assert!(fitted.quantized.mean_strong_direction_deg() < 3.0);
    assert_eq!(fitted.weights.training.rows, 360);
}

/// As [`data`], with the tip anywhere within 4.2 mm.
fn data_of_places() -> Dataset {
    let range = Range {
        force_n: 0.25,
        place_mm: 4.2,
        ..MIDDLE
    };
    let recipe = Recipe {
        loads: Loads::Random(1_492),
        rest: 8,
        range,
        ..Recipe::default()
    };
    generate(&recipe, || ()).unwrap()
}

#[test]
fn frames_of_places_teach_the_place() {
    let data = data_of_places();
    let options = Options {
        meaning: Meaning::ForceAndPlace,
        ..small()
    };
    let fitted = fit(&data, &options, |_| ()).unwrap();
    // Answering always the middle has an error of 2.4 mm.
    let place_mm = fitted.quantized.place_rmse_mm().unwrap();
    assert!(place_mm < 1.2, "{place_mm}");
    assert!(fitted.quantized.magnitude_rmse_n() < 0.012);
    let weights = &fitted.weights;
    assert!(
        (weights.range.place_mm - 4.0).abs() < 1e-9,
        "{:?}",
        weights.range
    );
    assert!(weights.uncertainty.place_mm.iter().all(|&mm| mm > 0.0));

    let model = export(weights).unwrap();
    let evaluation = Evaluation::of(&model, &data).unwrap();
    let parts = by_place(&evaluation.judged);
    assert_eq!(parts.len(), 8, "five distances and three sizes");
    let places = parts.iter().filter_map(|part| part.place);
    assert!(places.clone().all(|place| place.each_mm < 1.0));
    assert_eq!(places.count(), 8);
    assert!(evaluation.to_html().contains("Off the middle"));
    assert!(evaluation.to_string().contains("µm along x and y each"));

    // A network without the place among its outputs gives forces only.
    let force = Options {
        epochs: 2,
        rounded_epochs: 1,
        ..small()
    };
    let fitted = fit(&data, &force, |_| ()).unwrap();
    assert_eq!(fitted.quantized.place_rmse_mm(), None);
    assert_eq!(fitted.weights.range.place_mm, 0.0);
}

#[test]
fn what_no_data_tell_cannot_be_learnt() {
    let options = Options {
        meaning: Meaning::ForceAndPlace,
        ..small()
    };
    assert!(fit(&data(), &options, |_| ()).is_err());
}

#[test]
fn the_same_seed_gives_the_same_weights() {
    let data = data();
    let options = Options {
        epochs: 2,
        rounded_epochs: 1,
        ..small()
    };
    let weights = |options: &Options| fit(&data, options, |_| ()).unwrap().weights;
    assert_eq!(weights(&options), weights(&options));
    let other = Options {
        seed: 2,
        ..options.clone()
    };
    assert_ne!(weights(&options).network, weights(&other).network);
}

#[test]
fn constant_data_trains_to_the_constant() {
    let samples = Samples {
        features: vec![[100.0; INPUTS]; 50],
        answers: vec![[0.01, 0.0, -0.1]; 50],
        ..Samples::default()
    };
    let network = train(&samples, &Samples::default(), &small(), |_| ()).unwrap();
    let force = network.predict(&[100.0; INPUTS]);
    for (found, truth) in force.iter().zip([0.01, 0.0, -0.1]) {
        assert!((found - truth).abs() < 1e-4, "{force:?}");
    }
}

fn options_that_do_not_fit(refused: &dyn Fn(&Options, &str)) {
    let weight = |mean, floor_n| Some(DirectionWeight { mean, floor_n });
    let weighed = Options {
        direction_weight: weight(1.0, 0.01),
        ..small()
    };
    refused(&weighed, "0 of forces");
    for weight in [weight(0.0, 0.01), weight(1.0, 0.0), weight(1.0, f64::NAN)] {
        let nothing = Options {
            direction_weight: weight,
            ..weighed.clone()
        };
        refused(&nothing, "weight of directions");
    }
}

#[test]
fn what_cannot_be_trained_on_is_said() {
    let refused = |samples: &Samples, options: &Options, words: &str| {
        let error = format!(
            "{:#}",
            train(samples, &Samples::default(), options, |_| ()).unwrap_err()
        );
        assert!(error.contains(words), "{error}");
    };
    let some = Samples {
        features: (0..5).map(|i| [f64::from(i); INPUTS]).collect(),
        answers: (0..5).map(|i| [f64::from(i); OUTPUTS]).collect(),
        ..Samples::default()
    };
    refused(&Samples::default(), &small(), "no usable row");
    refused(
        &Samples {
            answers: Vec::new(),
            ..some.clone()
        },
        &small(),
        "5 rows of features",
    );
    refused(
        &some,
        &Options {
            batch: 0,
            ..small()
        },
        "batch",
    );
    refused(
        &some,
        &Options {
            hidden: vec![513],
            ..small()
        },
        "512 wide",
    );
    refused(
        &some,
        &Options {
            learning_rate: 0.0,
            ..small()
        },
        "learning rate",
    );
    refused(
        &some,
        &Options {
            learning_rate: 1e30,
            ..small()
        },
        "diverged",
    );

    options_that_do_not_fit(&|options, words| refused(&some, options, words));

    let mut untouched_missing = data();
    untouched_missing.rows.drain(..8);
    let error = fit(&untouched_missing, &small(), |_| ())
        .unwrap_err()
        .to_string();
    assert!(error.contains("without force"), "{error}");
}
