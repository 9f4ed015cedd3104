//! Tests recordings with a gauge that records by itself, with a clock of its own.

use std::path::Path;

use hivtac_calibration::data::collect::simulated::SimulatedGauge;
use hivtac_calibration::data::dataset::{Dataset, Loads};

use hivtac_wire::message::Outcome;

use super::fake::*;

/// 100 frames per second, however fast the computer is.
fn clock() -> Clock {
    let mut time = 0.0;
    Box::new(move || {
        time += 0.01;
        time
    })
}

/// The gauge's file of the first `span_s` seconds.
fn gauge_file(here: &Path, span_s: f64) {
    let forces: Vec<_> = (0..(span_s * 200.0) as usize)
        .map(|i| (i as f64 / 200.0, press_n(i as f64 / 200.0)))
        .collect();
    let gauge = SimulatedGauge {
        ahead_s: 17.25,
        drift_ppm: 100.0,
        rate_hz: 100.0,
        noise_n: 0.000_3,
        zero_n: -0.004,
        damaged_every: 97,
        seed: 3,
    };
    std::fs::write(here.join("gauge.csv"), gauge.lines(&forces).unwrap()).unwrap();
}

fn record<'a>(port: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let common = [
        "collect",
        "record",
        "--into",
        "unit",
        "--port",
        port,
        "--rest-seconds",
        "0.5",
        "--seconds",
        "8",
    ];
    [&common[..], more].concat()
}

/// Every force of a unit depends on its rest position.
#[test]
fn a_film_that_cannot_be_tared_is_not_recorded() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let sensor = FakeSensor::start(clock(), usize::MAX);
    sensor.answers.lock().unwrap().tare = Outcome::MarkersImplausible;
    let (output, said) = run(here, &record(&sensor.port, &[]), "\n0, 0\n");
    assert!(!output.status.success(), "{said}");
    let why = "not those of four whole, equal markers";
    assert!(said.contains(why) && !said.contains("samples ("), "{said}");
}

#[test]
#[ignore = "24 s: as a unit is led from presses anywhere, from a recording"]
fn from_a_recording_to_a_model_for_the_unit() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    for pose in ["8, -4", "-8, 4", "0, 8"] {
        // Restarted each time, and its clock as well.
        let sensor = FakeSensor::start(clock(), usize::MAX);
        let angles = pose.split(", ").map(|angle| angle.parse().unwrap());
        *sensor.pose.lock().unwrap() = angles.collect::<Vec<f64>>().try_into().unwrap();
        let lines = format!("\nnonsense\n{pose}\n");
        let said = run(here, &record(&sensor.port, &[]), &lines).1;
        assert!(said.contains("`nonsense` is no pose"), "{said}");
        assert!(said.contains("samples ("), "{said}");
    }
    gauge_file(here, 12.0);
    let align: Vec<_> = "collect align --recording unit --gauge gauge.csv --out data.csv"
        .split(' ')
        .collect();
    let report = stdout(run(here, &align, ""));
    for words in [
        "ahead",
        "rejected by the sensor and kept: markers_missing",
        "rejected by the sensor and kept: markers_implausible",
        "gauge at rest -4.0",
        "gauge lines were not used (no reading",
    ] {
        assert!(report.contains(words), "no `{words}` in:\n{report}");
    }
    let data = Dataset::load(&here.join("data.csv")).unwrap();
    assert_eq!(
        (data.about.loads, data.about.sessions),
        (Loads::Measured(3), 3)
    );
    assert_eq!(data.about.down, Some([0.0, 0.0, -1.0]));
    // Where the gauge's force is known, the film's formula gives exactly the features.
    let rest = data.rest().unwrap();
    let mut pressed = 0;
    for (seen, force) in data.accepted().filter(|(_, force)| *force != [0.0; 3]) {
        let expected = markers(force);
        let off_px = (seen.features_q16[4] - expected[2].x.into()).to_f64();
        assert!(off_px.abs() < 0.5, "{force:?}: {off_px} px");
        assert!(seen.features_q16[4] >= rest.features_q16[4]);
        pressed += 1;
    }
    assert!(pressed > 1500, "{pressed}");

    let train = ["train", "--data", "data.csv", "--out", "unit.weights"];
    let fast = ["--hidden", "16", "--epochs", "10", "--rounded-epochs", "2"];
    stdout(run(here, &[&train[..], &fast].concat(), ""));
    stdout(run(
        here,
        &["export", "--weights", "unit.weights", "--out", "unit.hvtm"],
        "",
    ));
    let evaluate: Vec<_> = "evaluate --model unit.hvtm --data data.csv --out report.html"
        .split(' ')
        .collect();
    let judged = stdout(run(here, &evaluate, ""));
    assert!(judged.contains("Frames of a real unit"), "{judged}");
    let check = run(here, &["check", "--model", "unit.hvtm"], "").1;
    assert!(check.contains("use `evaluate`"), "{check}");
}

#[test]
#[ignore = "20 s: a second recording"]
fn an_interrupted_recording_goes_on_with_the_poses_that_are_left() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    std::fs::write(here.join("poses.csv"), "alpha,beta\n0,0\n8,0\n0,8\n").unwrap();
    // The sensor disappears in the middle of the second take.
    let sensor = FakeSensor::start(clock(), 1400);
    let arguments = record(&sensor.port, &["--poses", "poses.csv"]);
    let (output, said) = run(here, &arguments, "\n\n\n\n");
    assert!(
        !output.status.success() && said.contains("the same command goes on"),
        "{said}"
    );
    let kept = || {
        std::fs::read_to_string(here.join("unit/samples.csv"))
            .unwrap()
            .lines()
            .count()
    };
    let before = kept();
    assert!(before > 1390, "{before}: what came is kept");
    // Ended by the person.
    let said = run(here, &arguments, "\ndone\n").1;
    assert!(said.contains("2 of 3 poses are left"), "{said}");
    let (output, said) = run(here, &arguments, "\n\n");
    assert!(
        output.status.success() || said.contains("goes on"),
        "{said}"
    );
    assert!(kept() > before + 800, "{}", kept());
    let takes = std::fs::read_to_string(here.join("unit/takes.csv")).unwrap();
    assert!(
        takes.contains(",0,0,") && takes.contains(",8,0,"),
        "{takes}"
    );
}

#[test]
fn a_stranger_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let sensor = FakeSensor::start(clock(), usize::MAX);
    stdout(run(here, &record(&sensor.port, &[]), "\ndone\n"));
    let file = here.join("unit/unit.json");
    let text = std::fs::read_to_string(&file)
        .unwrap()
        .replace("0101", "0201");
    std::fs::write(&file, text).unwrap();
    let (output, said) = run(here, &record(&sensor.port, &[]), "\ndone\n");
    assert!(
        !output.status.success() && said.contains("another unit"),
        "{said}"
    );
    let align: Vec<_> = "collect align --recording unit --out data.csv"
        .split(' ')
        .collect();
    let said = run(here, &align, "").1;
    assert!(said.contains("no frame in a pose"), "{said}");
}
