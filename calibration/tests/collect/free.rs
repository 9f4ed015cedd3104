//! Tests presses anywhere: from a hand that covers the film to a data set, with an interruption.

use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use hivtac_calibration::data::collect::simulated::SimulatedGauge;
use hivtac_calibration::data::dataset::{Dataset, Row};
use hivtac_terms::force::Place;
use hivtac_terms::units::{Micrometres, SignedMicrometres};

use super::fake::*;
use super::over_serial::pseudo_terminal;

/// Time between frames, s.
const FRAME_S: f64 = 0.04;
/// The untouched film before the first press, s.
const BEFORE_S: f64 = 1.0;
/// Places along x and along y, and the forces at each, N.
const SIDE: usize = 5;
const FORCES_N: [f64; 3] = [0.05, 0.1, 0.2];
const PRESSES: usize = SIDE * SIDE * FORCES_N.len();

/// Length of a press, s: each different.
fn length_s(press: usize) -> f64 {
    0.55 + 0.3 * (press as f64 * 0.618).fract()
}

/// Place, mm, and force, N, of a hand that passes over the film repeatedly.
fn press(time_s: f64) -> ([f64; 2], f64) {
    let (mut press, mut left_s) = (0, time_s - BEFORE_S);
    if left_s < 0.0 {
        return ([0.0; 2], 0.0);
    }
    while left_s > length_s(press) {
        left_s -= length_s(press);
        press += 1;
    }
    let at = |index: usize| -3.2 + 1.6 * index as f64;
    let (place, size) = ((press * 7) % PRESSES / 3, (press * 7) % 3);
    let rise = (left_s / 0.1).min((length_s(press) - left_s) / 0.1);
    let force_n = FORCES_N[size] * rise.clamp(0.0, 1.0);
    ([at(place % SIDE), at(place / SIDE)], force_n)
}

/// A sensor under that hand; its own model reports a fifth too little.
pub fn sensor(after: usize) -> FakeSensor {
    let mut time_s = 0.0;
    let film = move |frame, _| {
        time_s += FRAME_S;
        let (place_mm, size_n) = press(time_s);
        let [x, y] = place_mm.map(|mm| SignedMicrometres((1e3 * mm) as i32));
        let sigma = Micrometres(200);
        let felt = (8e5 * size_n) as i32;
        let place = (size_n > 0.0).then_some(Place { x, y, sigma });
        pressed(frame, time_s, size_n, (felt, place))
    };
    FakeSensor::of_film(Box::new(film), after)
}

fn gauge_file(here: &Path, span_s: f64) {
    let forces: Vec<_> = (0..(span_s * 200.0) as usize)
        .map(|i| (i as f64 / 200.0, press(i as f64 / 200.0).1))
        .collect();
    let gauge = SimulatedGauge {
        ahead_s: -5.5,
        ..SimulatedGauge::default()
    };
    std::fs::write(here.join("gauge.csv"), gauge.lines(&forces).unwrap()).unwrap();
}

pub fn record<'a>(port: &'a str, free_s: &'a str) -> Vec<&'a str> {
    let record = ["collect", "record", "--into", "unit", "--port", port];
    let more = ["--rest-seconds", "0.5", "--free", free_s, "--axis", "0,0"];
    [&record[..], &more].concat()
}

/// Without a terminal there is a line every ten seconds; with complete coverage the take ends
/// early.
#[test]
#[ignore = "15 s: renders a data set"]
fn a_hand_that_covers_the_film_is_let_go_and_its_presses_are_a_data_set() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let sensor = sensor(usize::MAX);
    let (output, said) = run(here, &record(&sensor.port, "150"), "\n\n");
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("Press the film anywhere within 4 mm"),
        "{said}"
    );
    let lines = said.matches(" s left; ").count();
    assert!((5..8).contains(&lines), "{lines} lines: {said}");
    assert!(said.contains(" of 71 covered, 140 s left; press"), "{said}");
    assert!(
        said.contains("All 71 places and forces are covered."),
        "{said}"
    );
    gauge_file(here, 66.0);
    let align: Vec<_> = "collect align --recording unit --gauge gauge.csv --holds"
        .split(' ')
        .collect();
    let more = ["--direction-deg", "4", "--out", "data.csv"];
    let report = stdout(run(here, &[&align[..], &more].concat(), ""));
    assert!(report.contains("of them anywhere)"), "{report}");
    let data = Dataset::load(&here.join("data.csv")).unwrap();
    assert_eq!(data.about.free.unwrap().direction_deg, 4.0);
    let pressed: Vec<&Row> = data.rows.iter().filter(|row| data.is_free(row)).collect();
    assert!(pressed.len() > 1000, "{}", pressed.len());
    assert!(
        pressed
            .iter()
            .all(|row| row.force_n[2] < 0.0 && row.clock_n.is_some())
    );
    let held = pressed.iter().filter(|row| {
        let near = |force_n: &f64| (row.force_n[2] + force_n).abs() < 0.003;
        FORCES_N.iter().any(near)
    });
    assert!(held.count() > pressed.len() / 2);
    // A network is not trained on presses at unknown places.
    let train = ["train", "--data", "data.csv", "--out", "unit.weights"];
    let (output, said) = run(here, &train, "");
    let left_out = String::from_utf8(output.stdout).unwrap();
    assert!(
        left_out.contains("presses anywhere are left out"),
        "{left_out}"
    );
    assert!(
        !output.status.success() && said.contains("nothing else is in data.csv"),
        "{said}"
    );
}

#[test]
fn an_interrupted_hand_goes_on_with_the_time_that_is_left() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    // The sensor disappears after some 13 s of the second conversation.
    let sensor = sensor(345);
    let arguments = record(&sensor.port, "20");
    let (output, said) = run(here, &arguments, "\n\n");
    assert!(
        !output.status.success() && said.contains("the same command goes on"),
        "{said}"
    );
    let covered = || std::fs::read_to_string(here.join("unit/covered.csv")).unwrap();
    let before = covered().lines().count();
    assert!(before > 5, "{}", covered());
    let (output, said) = run(here, &arguments, "\n\n");
    assert!(output.status.success(), "{said}");
    assert!(said.contains("13 s of 20 s were recorded before"), "{said}");
    assert!(covered().lines().count() > before, "{}", covered());
    assert!(said.contains("covered; missing: "), "{said}");
    let takes = std::fs::read_to_string(here.join("unit/takes.csv")).unwrap();
    assert!(
        takes.contains("1,0,0,") && takes.trim_end().ends_with(",0,,"),
        "{takes}"
    );
    // Once the take is done, no time of it is left.
    let (output, said) = run(here, &arguments, "\n\n");
    assert!(
        output.status.success() && !said.contains("Press the film"),
        "{said}"
    );
}

/// The guided command does both and writes the loads. The test does not wait for its fit, which is
/// long for a film that is a formula.
#[test]
#[ignore = "13 s"]
fn a_unit_is_led_from_presses_anywhere_to_its_loads() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let sensor = sensor(usize::MAX);
    let unit = ["unit", "--into", "unit", "--free", "60"];
    let bench = ["--port", &sensor.port, "--rest-seconds", "0.5"];
    let (_, said) = run(here, &[&unit[..], &bench].concat(), "\n\n");
    assert!(said.contains("name the file that it recorded"), "{said}");
    gauge_file(here, 64.0);
    let mut fitting = start(here, &[&unit[..], &["--gauge", "gauge.csv"]].concat());
    let begun = Instant::now();
    let data = loop {
        match Dataset::load(&here.join("unit/loads.csv")) {
            Ok(data) => break data,
            Err(error) => assert!(begun.elapsed().as_secs() < 60, "{error:#}"),
        }
        assert!(fitting.try_wait().unwrap().is_none(), "it ended before");
        std::thread::sleep(Duration::from_millis(20));
    };
    fitting.kill().unwrap();
    fitting.wait().unwrap();
    assert_eq!(data.about.free.unwrap().direction_deg, 3.0);
}

#[test]
fn what_cannot_be_pressed_is_refused_before_anything_is_recorded() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let refused = |arguments: &[&str], words: &str| {
        let (output, said) = run(here, arguments, "");
        assert!(!output.status.success() && said.contains(words), "{said}");
    };
    let unit = ["unit", "--into", "unit", "--free"];
    refused(&[&unit[..], &["19"]].concat(), "from 20 to 1800");
    refused(&[&unit[..], &["60", "--axis", "0"]].concat(), "is no pose");
    refused(
        &[&unit[..], &["60", "--axis", "70,0"]].concat(),
        "angles are within",
    );
    refused(
        &[&unit[..], &["60", "--direction-deg", "0"]].concat(),
        "up to 45",
    );
    assert!(!here.join("unit").exists());
}

/// On a terminal there is a map, drawn over itself.
#[test]
fn a_terminal_shows_a_map() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let sensor = sensor(usize::MAX);
    let (mut person, terminal, _) = pseudo_terminal();
    let mut child = Command::new(env!("CARGO_BIN_EXE_hivtac-calibrate"))
        .current_dir(here)
        .args(record(&sensor.port, "20"))
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::from(terminal))
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"\n\n").unwrap();
    let mut shown = Vec::new();
    // Ends with an error once the terminal is closed.
    let _ = person.read_to_end(&mut shown);
    assert!(child.wait().unwrap().success());
    let shown = String::from_utf8(shown).unwrap();
    assert!(shown.matches("\x1b[8A").count() > 3, "{shown}");
    for words in [
        "20–70 mN     70–140 mN",
        "█ ",
        "○ ",
        " mN at x ",
        "covered; missing",
    ] {
        assert!(shown.contains(words), "no {words}: {shown}");
    }
}
