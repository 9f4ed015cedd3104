//! Checks the model embedded in firmware and host tool: the committed weights give it byte for
//! byte, and its errors are those in `docs/training.md`.

use std::fs;
use std::path::PathBuf;

use hivtac_calibration::data::dataset::{Loads, Recipe, generate, measure};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::evaluation::check::{check, recipe, sensor};
use hivtac_calibration::evaluation::{Coverage, Covered, Evaluation, Judged, by_place, coverage};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::{Model, Origin, OutputKind};
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};

fn models() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("models")
}

fn committed() -> Vec<u8> {
    fs::read(models().join("default.hvtm")).unwrap()
}

/// The model for cameras that send YUV422.
fn committed_for_yuv422() -> Vec<u8> {
    fs::read(models().join("yuv422/default.hvtm")).unwrap()
}

/// The model for an MT9V034 with its lens of 1.2 mm and black markers.
fn committed_for_mt9v034() -> Vec<u8> {
    fs::read(models().join("mt9v034/default.hvtm")).unwrap()
}

/// The tip within ±4 mm of the middle, by rings of a millimetre.
#[test]
fn it_measures_force_and_place_wherever_the_tip_presses() {
    let recipe = Recipe {
        loads: Loads::Random(1_500),
        rest: 32,
        seed: 79,
        range: Range {
            force_n: 0.25,
            alpha_deg: 10.0,
            beta_deg: 10.0,
            place_mm: 4.0,
        },
        ..Recipe::default()
    };
    let dataset = generate(&recipe, || ()).unwrap();
    let evaluation = Evaluation::of(&committed(), &dataset).unwrap();
    let parts = by_place(&evaluation.judged);
    assert!(parts.len() >= 8, "{parts:?}");
    for part in &parts {
        let place = part.place.unwrap();
        assert!(part.direction_deg < 0.7, "{part:?}");
        assert!(part.magnitude_n < 0.2e-3, "{part:?}");
        assert!(place.each_mm < 0.02 && place.within > 0.93, "{part:?}");
    }
}

/// The model refuses hardly any frames, even of loads too weak for a direction or a place.
#[test]
fn the_weakest_presses_are_measured() {
    let weak = Recipe {
        loads: Loads::Random(1_000),
        seed: 81,
        range: Range {
            force_n: 2e-3,
            alpha_deg: 10.0,
            beta_deg: 10.0,
            place_mm: 4.0,
        },
        ..Recipe::default()
    };
    let dataset = generate(&weak, || ()).unwrap();
    let evaluation = Evaluation::of(&committed(), &dataset).unwrap();
    assert!(evaluation.judged.len() >= 995, "{evaluation}");
    let off = |judged: &Judged| (judged.found_polar[2] - judged.truth_polar[2]).abs();
    let worst = evaluation.judged.iter().map(off).fold(0.0, f64::max);
    assert!(worst < 0.5e-3, "{worst} N");
}

#[test]
fn committed_weights_give_the_committed_models() {
    for (weights, committed) in [
        ("default.weights", committed()),
        ("yuv422/default.weights", committed_for_yuv422()),
        ("mt9v034/default.weights", committed_for_mt9v034()),
    ] {
        let bytes = export(&Weights::load(&models().join(weights)).unwrap()).unwrap();
        assert!(
            bytes == committed,
            "run `hivtac-calibrate export` on the committed {weights} and commit the result"
        );
    }
}

#[test]
fn the_model_for_yuv422_is_made_for_the_same_unit_and_measures_its_frames() {
    let (bytes, usual) = (committed_for_yuv422(), committed());
    let conditions = Model::parse(&bytes).unwrap().conditions;
    let mut expected = Model::parse(&usual).unwrap().conditions;
    expected.threshold = Threshold::red(PixelFormat::Yuv422);
    assert_eq!(conditions, expected);
    let report = check(&bytes, 400, 77, || ()).unwrap();
    let errors = &report.errors;
    assert!(errors.count() >= 380, "{report}");
    // In colour, such a camera has half as many columns.
    assert!(errors.mean_strong_direction_deg() < 0.3, "{report}");
    assert!(errors.magnitude_rmse_n() < 0.1e-3, "{report}");
}

fn newtons(micronewtons: i32) -> f64 {
    f64::from(micronewtons) * 1e-6
}

/// A press in a corner for which the network's first guess leads to a bend of the film's tables. No
/// step from there lowers the residual, 0.3 mm and 7 mN off.
#[test]
fn steps_that_find_no_way_on_begin_anew_from_the_middle() {
    let bytes = committed_for_mt9v034();
    let model = Model::parse(&bytes).unwrap();
    let recipe = recipe(&model, 4_000, 1_000_001).unwrap();
    let row = 3_782;
    let load = recipe.load(row).unwrap();
    let [x, y] = load.offset_mm();
    assert!((x + 3.940).abs() < 1e-3 && (y - 3.875).abs() < 1e-3);
    let frame = recipe.scene(0).unwrap().render_load(&load, row as u64);
    let mut sensor = sensor(&model).unwrap();
    let force = measure(&mut sensor, &frame.unwrap()).force.unwrap();
    let [found_n, sigma_n] = [force.magnitude.0, force.magnitude_sigma.0 as i32].map(newtons);
    let off_n = found_n - load.magnitude_n();
    assert!(
        off_n.abs() < 3.0 * sigma_n && sigma_n < 1e-3,
        "{off_n} ± {sigma_n}"
    );
    let place = force.place.unwrap();
    assert!((place.x.0 + 3_940).abs() < 30 && (place.y.0 - 3_875).abs() < 30);
}

/// All markers stay within the rows that are read out, wherever the tip presses.
#[test]
fn the_model_for_an_mt9v034_measures_its_frames() {
    let bytes = committed_for_mt9v034();
    let model = Model::parse(&bytes).unwrap();
    let conditions = model.conditions;
    assert_eq!(
        conditions.geometry,
        Geometry::preset(Preset::Mt9v034, 160, 152)
    );
    assert_eq!(conditions.threshold, Threshold::red(PixelFormat::Mono));
    let usual = committed();
    assert_eq!(model.range, Model::parse(&usual).unwrap().range);
    let report = check(&bytes, 1000, 77, || ()).unwrap();
    let errors = &report.errors;
    assert!(errors.count() >= 990, "{report}");
    assert!(errors.mean_strong_direction_deg() < 0.3, "{report}");
    assert!(errors.magnitude_rmse_n() < 0.13e-3, "{report}");
}

#[test]
fn it_is_made_for_the_firmware() {
    let bytes = committed();
    let model = Model::parse(&bytes).unwrap();
    let conditions = model.conditions;
    assert_eq!(
        conditions.geometry,
        Geometry::preset(Preset::Ov7725, 320, 240)
    );
    assert_eq!(conditions.threshold, HsvBox::RED.into());
    assert_eq!(conditions.dilations, 1);
    assert_eq!(conditions.contact, ContactReading::Force);
    assert_eq!(conditions.origin, Origin::Simulated);
    assert_eq!(model.output, OutputKind::ForceAndPlace);
    assert_eq!(conditions.centroid, CentroidEstimator::RednessWeighted);
    assert_eq!(model.name().as_str(), "11-64-64-5 ov7725");
}

#[test]
fn it_measures_frames_that_no_training_saw() {
    let report = check(&committed(), 1000, 77, || ()).unwrap();
    let errors = &report.errors;
    // Strong presses far from the middle move a marker out of the picture.
    let hidden = report.rejected.get("markers_missing").copied();
    assert!(errors.count() + hidden.unwrap_or(0) >= 997, "{report}");
    assert!(errors.count() >= 930, "{report}");
    // A tilted force hardly moves the markers sideways: 0.2 px per degree at 0.2 N and 800×600.
    assert!(errors.mean_strong_direction_deg() < 0.2, "{report}");
    assert!(errors.magnitude_rmse_n() < 0.1e-3, "{report}");
    assert!(errors.place_rmse_mm().unwrap() < 0.01, "{report}");
}

/// Presses within ±4 mm, the same number in each session.
fn presses(each: usize, sessions: usize) -> Evaluation {
    let recipe = Recipe {
        loads: Loads::Random(each),
        rest: 32,
        sessions,
        seed: 78,
        range: Range {
            place_mm: 4.0,
            ..Range::default()
        },
        ..Recipe::default()
    };
    let dataset = generate(&recipe, || ()).unwrap();
    Evaluation::of(&committed(), &dataset).unwrap()
}

/// A differently mounted camera and differently glued dots give the same picture: the stated
/// uncertainty covers both.
#[test]
fn its_uncertainties_are_not_too_small_in_sessions_that_it_does_not_know() {
    let evaluation = presses(50, 40);
    for part in coverage(&evaluation.judged) {
        let least = part.direction.within.min(part.magnitude.within);
        assert!(least >= 0.95, "{evaluation}");
    }
}

/// Each tenth of the frames by |F| holds 200; of these, 95 to 97 in a hundred lie within their
/// bounds, give or take 1.5. Of |F|, more do: its uncertainty also covers the film's brightness
/// next to the dots, which these frames do not vary.
#[test]
fn its_uncertainties_hold() {
    let evaluation = presses(2_000, 1);
    let parts = coverage(&evaluation.judged);
    assert_eq!(parts.len(), 10);
    type Kind = fn(&Coverage) -> Covered;
    let kinds: [(Kind, f64); 2] = [(|part| part.direction, 0.98), (|part| part.magnitude, 1.0)];
    for (of, most) in kinds {
        let within: Vec<f64> = parts.iter().map(|part| of(part).within).collect();
        assert!(within.iter().all(|&part| part >= 0.9), "{evaluation}");
        let mean = within.iter().sum::<f64>() / 10.0;
        assert!((0.94..most).contains(&mean), "{mean}: {evaluation}");
    }
    let narrow = |part: &Coverage| part.direction.bound <= 3.0 * part.direction.error;
    assert!(parts.iter().all(narrow), "{evaluation}");
}

#[test]
fn damaged_models_are_not_checked() {
    let mut bytes = committed();
    bytes[300] ^= 1;
    let error = check(&bytes, 10, 1, || ()).unwrap_err().to_string();
    assert!(error.contains("not a usable model file"), "{error}");
}

#[test]
fn unusable_weights_are_refused_with_the_reason() {
    let text = fs::read_to_string(models().join("default.weights")).unwrap();
    // Replaces a key's number, or the first of its numbers.
    let with = |key: &str, number: &str| {
        let at = text.find(key).unwrap() + key.len();
        let end = at + text[at..].find([',', '}']).unwrap();
        format!("{}{number}{}", &text[..at], &text[end..])
    };
    let refused = |bad: String, words: &str| {
        assert_ne!(bad, text);
        let error = format!("{:#}", Weights::parse(&bad).unwrap_err());
        assert!(error.contains(words), "{error}");
    };
    refused(
        text.replace("hivtac-weights 2", "hivtac-weights 1"),
        "hivtac-weights 1",
    );
    refused(with("\"force_n\":", "-0.2"), "range.force_n");
    refused(with("\"alpha_deg\":", "100.0"), "range.alpha_deg");
    refused(with("\"across_n\":[", "-1.0"), "uncertainty.across_n");
    refused(with("\"steps\":", "4"), "film.steps");
    refused(
        text.replace("\"contact\":\"force\"", "\"contact\":\"feel\""),
        "feel",
    );
    refused(text[..text.len() / 2].to_owned(), "EOF");
}
