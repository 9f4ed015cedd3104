//! Tests `unit --into`: guided from the untouched film to a unit's own model, with an interruption.

use std::path::Path;
use std::sync::{Arc, Mutex};

use hivtac_calibration::data::collect::simulated::SimulatedGauge;
use hivtac_calibration::forward::layout_scene;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::force::{ContactList, Force};
use hivtac_terms::status::Status;
use hivtac_terms::units::{MicroNewtons, MilliDegrees, UnsignedMicroNewtons, UnsignedMilliDegrees};
use hivtac_twin::Load;
use hivtac_twin::film::Layout;
use hivtac_wire::message::Sample;

use super::fake::*;
use crate::layouts;

/// α and β in degrees, x and y in mm; each pressed with 0.1 N.
const LOADS: [[f64; 4]; 6] = [
    [0.0, 0.0, 0.0, 0.0],
    [8.0, 0.0, 0.0, 0.0],
    [-8.0, 0.0, 0.0, 0.0],
    [0.0, 8.0, 0.0, 0.0],
    [0.0, 0.0, 3.0, 0.0],
    [0.0, 0.0, 0.0, -3.0],
];
const FORCE_N: f64 = 0.1;
/// The load that the hand presses after each start of samples, if any. The hand at first forgets
/// the second load.
const HAND: [Option<usize>; 9] = [
    None,
    Some(0),
    None,
    Some(1),
    Some(2),
    None,
    Some(3),
    Some(4),
    Some(5),
];
/// Time between frames, s.
const FRAME_S: f64 = 0.04;

/// The force of a press, N, at this time after the take began: held for over a second, each
/// differently.
fn press_n(load: usize, time_s: f64) -> f64 {
    let begin = 0.3 + 0.1 * ((3 * load) % 7) as f64;
    let end = begin + 1.3 + 0.07 * load as f64;
    let rise = ((time_s - begin) / 0.3).min((end - time_s) / 0.3);
    FORCE_N * rise.clamp(0.0, 1.0)
}

/// Time and force of the presses: s, N.
type Pressed = Arc<Mutex<Vec<(f64, f64)>>>;

/// The simulated sensor's film, measured by the sensing in rendered frames.
fn film(pressed: Pressed, layout: Layout, mut sensor: Box<Sensor<'static>>) -> Film {
    let scene = layout_scene(layout).unwrap();
    let (mut time_s, mut begun_s, mut last_start) = (0.0, 0.0, 0);
    Box::new(move |frame, start| {
        time_s += FRAME_S;
        if start != last_start {
            (begun_s, last_start) = (time_s, start);
        }
        let pressing = HAND[start as usize - 1];
        let force_n = pressing.map_or(0.0, |load| press_n(load, time_s - begun_s));
        pressed.lock().unwrap().push((time_s, force_n));
        let [alpha, beta, x, y] = pressing.map_or([0.0; 4], |load| LOADS[load]);
        let load = match force_n > 0.0 {
            true => Load::from_angles(force_n, alpha, beta)
                .unwrap()
                .with_offset_mm([x, y])
                .unwrap(),
            false => Load::REST,
        };
        let rendered = scene.render_load(&load, frame.into()).unwrap();
        sensor.forget_frame();
        let seen = sensor.measure_frame(&rendered.to_rgb565());
        Sample {
            sequence: frame,
            frame,
            time_us: (time_s * 1e6) as u64,
            status: Status::NOT_CALIBRATED,
            force: Some(felt(force_n)),
            contacts: ContactList::default(),
            markers: seen.markers.unwrap(),
        }
    })
}

/// The answer of the sensor's own model: only the size matters here.
fn felt(force_n: f64) -> Force {
    let size = (1e6 * force_n) as i32;
    Force {
        alpha: MilliDegrees(0),
        beta: MilliDegrees(0),
        magnitude: MicroNewtons(size),
        cartesian: [0, 0, -size].map(MicroNewtons),
        direction_sigma: UnsignedMilliDegrees(10_000),
        magnitude_sigma: UnsignedMicroNewtons(20_000),
        place: None,
        torque: None,
    }
}

/// The number that follows these words.
fn number(text: &str, words: &str) -> f64 {
    let (_, rest) = text
        .split_once(words)
        .unwrap_or_else(|| panic!("no {words}: {text}"));
    let end = rest
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(rest.len());
    rest[..end].parse().unwrap()
}

#[test]
#[ignore = "slow: 900 rendered frames and a fit"]
fn a_person_is_led_to_a_units_own_model() {
    is_led_to_its_model(Layout::default(), layouts::of_four());
}

#[test]
#[ignore = "slow: 900 rendered frames and a fit"]
fn a_person_is_led_to_the_model_of_a_unit_of_eight_dots() {
    is_led_to_its_model(layouts::layout(), layouts::untared());
}

fn is_led_to_its_model(layout: Layout, sensor: Box<Sensor<'static>>) {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let poses = LOADS.map(|[alpha, beta, x, y]| format!("{alpha},{beta},{x},{y}\n"));
    std::fs::write(here.join("poses.csv"), poses.concat()).unwrap();
    let pressed = Pressed::default();
    let sensor = FakeSensor::of_film(film(pressed.clone(), layout, sensor), usize::MAX);
    *sensor.markers.lock().unwrap() = Some(layout.count() as u8);
    let unit = ["unit", "--into", "unit", "--poses", "poses.csv"];
    let with_sensor = [
        &unit[..],
        &[
            "--port",
            &sensor.port,
            "--seconds",
            "3.2",
            "--rest-seconds",
            "0.6",
        ],
    ]
    .concat();
    // The untouched film, the first load, the second load twice, and the third.
    let (begun, said) = run(here, &with_sensor, "\n\n\n\n\ndone\n");
    assert!(
        said.contains("Load 1 of 6: the film level, the tip over its middle"),
        "{said}"
    );
    assert!(said.contains("press down to about 100 mN"), "{said}");
    assert_eq!(
        said.matches("Nothing pressed the film: once more.").count(),
        1,
        "{said}"
    );
    assert_eq!(
        said.matches("Load 2 of 6: the film tilted by α = 8°")
            .count(),
        2,
        "{said}"
    );
    let stdout = String::from_utf8(begun.stdout).unwrap();
    assert!(stdout.contains("3 of 6 loads are left"), "{stdout}: {said}");
    // The untouched film again, and the three remaining loads; then a gauge is missing.
    let (gone_on, said) = run(here, &with_sensor, "\n\n\n\n");
    assert!(
        said.contains("Load 6 of 6") && !said.contains("Load 3 of 6"),
        "{said}"
    );
    assert!(!gone_on.status.success(), "no gauge: {said}");
    assert!(
        said.contains("name the file that it recorded with --gauge"),
        "{said}"
    );
    let gauge = SimulatedGauge {
        ahead_s: -3.5,
        ..SimulatedGauge::default()
    };
    let lines = gauge.lines(&pressed.lock().unwrap()).unwrap();
    std::fs::write(here.join("gauge.csv"), lines).unwrap();
    // A sensor is no longer needed.
    let (done, said) = run(here, &[&unit[..], &["--gauge", "gauge.csv"]].concat(), "");
    let stdout = String::from_utf8(done.stdout).unwrap();
    assert!(done.status.success(), "{stdout}: {said}");
    assert_good(here, &stdout);
}

/// Checks the verdict on loads left out, and the model's file.
fn assert_good(here: &Path, stdout: &str) {
    let verdict = stdout
        .lines()
        .find(|line| line.starts_with("on each of the 6 loads, left out of the fit"));
    let verdict = verdict.unwrap_or_else(|| panic!("no verdict: {stdout}"));
    let used = stdout
        .lines()
        .filter(|line| line.contains(" under a force"));
    let frames: f64 = used.map(|line| number(line, "at rest, ")).sum();
    assert!(frames > 100.0, "frames: {stdout}");
    let direction_deg = number(verdict, "direction ");
    let force_mn = number(verdict, "|F| ");
    let place_um = number(verdict, "the place ");
    println!("{verdict}");
    assert!(
        direction_deg < 1.0 && force_mn < 3.0 && place_um < 150.0,
        "{verdict}"
    );
    let bytes = std::fs::read(here.join("unit/unit.hvtm")).unwrap();
    let model = Model::parse(&bytes).unwrap();
    let origin = format!("{:?}", model.conditions.origin);
    assert!(origin.contains("Unit"), "{origin}");
    assert!(
        stdout.contains("hivtac update model unit/unit.hvtm"),
        "{stdout}"
    );
}
