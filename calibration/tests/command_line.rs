//! Runs the program as a user does.

use std::path::Path;
use std::process::{Command, Output};

use hivtac_calibration::data::dataset::{Loads, Recipe, generate_file};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::weights::Weights;
use hivtac_twin::Contact;

fn run(directory: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_hivtac-calibrate");
    Command::new(program)
        .current_dir(directory)
        .args(arguments)
        .output()
        .unwrap()
}

fn stdout(output: &Output) -> String {
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr_of_failure(output: &Output) -> String {
    assert!(!output.status.success());
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A user's mistake is reported in one line, whatever the environment asks of panics.
#[test]
fn a_mistake_is_reported_without_a_backtrace() {
    let directory = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_hivtac-calibrate"))
        .current_dir(directory.path())
        .env("RUST_BACKTRACE", "1")
        .args("evaluate --model none.hvtm --data none.csv --out x.html".split(' '))
        .output()
        .unwrap();
    let error = stderr_of_failure(&output);
    assert!(
        error.starts_with("hivtac-calibrate: ") && error.contains("none."),
        "{error}"
    );
    assert_eq!(error.lines().count(), 1, "{error}");
}

#[test]
fn from_data_to_a_checked_model() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let made = run(
        here,
        &"dataset --samples 136 --seed 4 --reach-mm 0 --out data.csv"
            .split(' ')
            .collect::<Vec<_>>(),
    );
    assert!(stdout(&made).contains("200 frames, 0 rejected"));
    let fast = ["--hidden", "8", "--epochs", "2", "--rounded-epochs", "1"];
    let train = [
        &["train", "--data", "data.csv", "--out", "a.weights"],
        &fast[..],
    ]
    .concat();
    assert!(stdout(&run(here, &train)).contains("held-out rows, quantized"));
    stdout(&run(
        here,
        &["export", "--weights", "a.weights", "--out", "a.hvtm"],
    ));
    let report = stdout(&run(
        here,
        &["check", "--model", "a.hvtm", "--samples", "20"],
    ));
    for words in [
        "11-8-3 ov7725",
        "simulated",
        "contact reading `force`",
        "forces                20",
    ] {
        assert!(report.contains(words), "no `{words}` in:\n{report}");
    }

    // Training that starts from a network and makes no pass changes nothing.
    let again = ["train", "--data", "data.csv", "--start", "a.weights"];
    let none = ["--epochs", "0", "--rounded-epochs", "0"];
    stdout(&run(
        here,
        &[&again[..], &none, &["--out", "b.weights"]].concat(),
    ));
    let network = |name: &str| {
        let weights = Weights::load(&here.join(name)).unwrap();
        weights.network().unwrap().clone()
    };
    assert_eq!(network("a.weights").layers, network("b.weights").layers);
}

/// The meaning of the labels passes from the data set into the model and every report.
#[test]
fn the_contact_reading_is_carried_through() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let words = |arguments: &[&str], reading: &str| {
        let said = stdout(&run(here, arguments));
        assert!(
            said.contains(&format!("contact reading `{reading}`")),
            "no {reading} in:\n{said}"
        );
        said
    };
    let recipe = Recipe {
        contact: Contact::Slip { mu: 0.7 },
        loads: Loads::PaperPoses(1),
        rest: 9,
        range: Range::default(),
        ..Recipe::default()
    };
    generate_file(&recipe, &here.join("slip.csv"), |_| ()).unwrap();
    let train = ["train", "--data", "slip.csv", "--out", "slip.weights"];
    let fast = ["--hidden", "8", "--epochs", "40", "--rounded-epochs", "4"];
    words(&[&train[..], &fast].concat(), "slip:0.7");
    let export = ["export", "--weights", "slip.weights", "--out", "slip.hvtm"];
    stdout(&run(here, &export));
    let judge = ["evaluate", "--model", "slip.hvtm", "--data", "slip.csv"];
    let said = words(&[&judge[..], &["--out", "slip.html"]].concat(), "slip:0.7");
    assert!(said.contains("pressing direction"), "{said}");
    let check = run(here, &["check", "--model", "slip.hvtm"]);
    let error = stderr_of_failure(&check);
    assert!(
        error.contains("friction") && error.contains("`evaluate`"),
        "{error}"
    );

    let force = ["dataset", "--samples", "30", "--reach-mm", "0"];
    words(&[&force[..], &["--out", "force.csv"]].concat(), "force");
    let judge: Vec<_> = "evaluate --model slip.hvtm --data force.csv --out x.html"
        .split(' ')
        .collect();
    let error = stderr_of_failure(&run(here, &judge));
    assert!(error.contains("other conditions"), "{error}");
}

#[test]
fn mistakes_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let fails = |arguments: &[&str], words: &[&str]| {
        let error = stderr_of_failure(&run(directory.path(), arguments));
        words
            .iter()
            .for_each(|word| assert!(error.contains(word), "no `{word}` in:\n{error}"));
    };
    fails(
        &["check", "--model", "none.hvtm"],
        &["cannot read none.hvtm"],
    );
    fails(
        &["export", "--weights", "none.weights", "--out", "a"],
        &["cannot read none.weights"],
    );
    fails(
        &["dataset", "--width", "321", "--out", "a.csv"],
        &["321×240"],
    );
    fails(
        &["dataset", "--samples", "many", "--out", "a.csv"],
        &["'many'", "a number"],
    );
    fails(
        &"train --data a.csv --start b.weights --out c"
            .split(' ')
            .collect::<Vec<_>>(),
        &["--start", "cannot read b.weights"],
    );
    std::fs::write(directory.path().join("a.weights"), "{}").unwrap();
    fails(
        &["export", "--weights", "a.weights", "--out", "a"],
        &["a.weights is not a usable weights file"],
    );
}
