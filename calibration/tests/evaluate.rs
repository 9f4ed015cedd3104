//! Evaluates a model on the paper's poses and draws the paper's figures.

use hivtac_calibration::data::dataset::{Dataset, Loads, Recipe, generate};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::evaluation::Evaluation;
use hivtac_terms::conditions::CentroidEstimator;

/// A tip in the film's middle.
const MIDDLE: Range = Range {
    force_n: 0.22,
    alpha_deg: 11.0,
    beta_deg: 8.8,
    place_mm: 0.0,
};

fn data(loads: Loads, seed: u64) -> Dataset {
    let recipe = Recipe {
        loads,
        rest: 8,
        range: MIDDLE,
        seed,
        ..Recipe::default()
    };
    generate(&recipe, || ()).unwrap()
}

/// The committed model, which answers with a force and a place.
const MODEL: &[u8] = include_bytes!("../models/default.hvtm");

#[test]
fn the_report_says_what_it_is_and_needs_nothing_else() {
    let poses = data(Loads::PaperPoses(1), 2);
    let evaluation = Evaluation::of(MODEL, &poses).unwrap();
    let [(_, all), (_, weak), (_, strong)] = evaluation.groups();
    let (all, weak, strong) = (all.unwrap(), weak.unwrap(), strong.unwrap());
    assert_eq!((all.frames, weak.frames + strong.frames), (357, 357));
    assert!(strong.direction_deg.value < 0.25, "{evaluation}");
    assert!(strong.direction_deg.value < weak.direction_deg.value);
    assert!(all.force_rmse_n.value < 0.5e-3, "{evaluation}");

    let html = evaluation.to_html();
    for words in [
        "Simulated frames",
        "contact reading `force`",
        "all rows of a data set of its own",
        "paper, real sensor",
    ] {
        assert!(html.contains(words), "no `{words}`");
    }
    // Three of Figure 11, six of Figure 12, five of Figure 13.
    assert_eq!(html.matches("<svg").count(), 14);
    let outside = html.replace("http://www.w3.org/2000/svg", "");
    assert!(
        ["http", "src=", "<script", "NaN"]
            .iter()
            .all(|words| !outside.contains(words))
    );

    let random = Evaluation::of(MODEL, &data(Loads::Random(60), 3)).unwrap();
    assert_eq!(random.to_html().matches("<svg").count(), 7);
}

#[test]
fn what_does_not_fit_is_refused() {
    let recipe = Recipe {
        loads: Loads::Random(30),
        rest: 2,
        range: MIDDLE,
        centroid: CentroidEstimator::BinaryMask,
        ..Recipe::default()
    };
    let other = generate(&recipe, || ()).unwrap();
    let error = Evaluation::of(MODEL, &other).unwrap_err().to_string();
    assert!(error.contains("other conditions"), "{error}");
    let error = Evaluation::of(b"HVTM", &other).unwrap_err().to_string();
    assert!(error.contains("not a usable model file"), "{error}");
    let mut untouched = data(Loads::Random(1), 4);
    untouched.rows.truncate(8);
    let error = Evaluation::of(MODEL, &untouched).unwrap_err().to_string();
    assert!(error.contains("no accepted frame with a force"), "{error}");
}
