//! Ten known loads do nearly as well as thousands.

use hivtac_calibration::dataset::{Dataset, Loads, Recipe, Split, generate};
use hivtac_calibration::evaluate::{Evaluation, Numbers};
use hivtac_calibration::fit::fit_closed_form;
use hivtac_calibration::fit::quick::quick;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::{Range, Weights};

fn data(loads: Loads, force_n: f64, seed: u64) -> Dataset {
    let range = Range {
        force_n,
        ..Recipe::default().range
    };
    let recipe = Recipe {
        loads,
        range,
        rest: 64,
        seed,
        ..Recipe::default()
    };
    generate(&recipe, || ()).unwrap()
}

fn judged(weights: &Weights, test: &Dataset) -> [Numbers; 2] {
    let evaluation = Evaluation::of(&export(weights).unwrap(), test, None).unwrap();
    let [(_, all), _, (_, strong)] = evaluation.groups();
    [all.unwrap(), strong.unwrap()]
}

#[test]
fn ten_loads_are_within_twice_the_error_of_the_full_set() {
    let test = data(Loads::PaperPoses(4), 0.2, 77);
    let full = fit_closed_form(&data(Loads::Random(4000), 0.22, 1), Split::WithinPose, 1).unwrap();
    let few = quick(&data(Loads::Known(32), 0.205, 5)).unwrap();
    assert_eq!(few.loads.len(), 10);
    let [full_all, full_strong] = judged(&full.weights, &test);
    let [few_all, few_strong] = judged(&few.weights, &test);
    let ratios = [
        few_all.direction_deg.value / full_all.direction_deg.value,
        few_strong.direction_deg.value / full_strong.direction_deg.value,
        few_all.force_rmse_n.value / full_all.force_rmse_n.value,
    ];
    assert!(ratios.iter().all(|&ratio| ratio <= 2.0), "{ratios:?}");

    // What it says of itself is neither wild nor flattering.
    let said = few.weights.uncertainty;
    let (across_mn, along_mn) = (said.across_n[0] * 1e3, said.along_n[0] * 1e3);
    assert!(
        (0.14..1.4).contains(&across_mn) && (0.04..1.0).contains(&along_mn),
        "{said:?}"
    );
    let report = few.to_string();
    assert!(
        report.contains("205.0 mN, 32 frames") && report.contains("expect forces within"),
        "{report}"
    );
}

#[test]
fn too_few_loads_are_refused() {
    let mut three = data(Loads::Known(2), 0.2, 5);
    three.rows.truncate(64 + 6);
    let error = quick(&three).unwrap_err().to_string();
    assert!(error.contains("3 loads are too few"), "{error}");
}
