//! Tests `unit --into`: guided from the untouched film to a unit's own model, with an interruption.

use std::path::Path;
use std::sync::{Arc, Mutex};

use hivtac_calibration::data::collect::simulated::SimulatedGauge;
use hivtac_calibration::forward::{self, layout_scene, rest_of};
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::down::Direction;
use hivtac_terms::force::{ContactList, Force};
use hivtac_terms::status::Status;
use hivtac_terms::units::{MicroNewtons, MilliDegrees, UnsignedMicroNewtons, UnsignedMilliDegrees};
use hivtac_twin::film::Layout;
use hivtac_twin::{Load, Scene};
use hivtac_wire::message::Sample;

use super::fake::*;
use crate::layouts;

/// α and β in degrees, x and y in mm.
const LOADS: [[f64; 4]; 6] = [
    [0.0, 0.0, 0.0, 0.0],
    [8.0, 0.0, 0.0, 0.0],
    [-8.0, 0.0, 0.0, 0.0],
    [0.0, 8.0, 0.0, 0.0],
    [0.0, 0.0, 3.0, 0.0],
    [0.0, 0.0, 0.0, -3.0],
];
/// The hand's forces, N: as it is asked for them, and where it has weights of one size only.
const AS_ASKED: [f64; 6] = [0.2, 0.1, 0.1, 0.1, 0.1, 0.1];
const OF_ONE_SIZE: [f64; 6] = [0.1; 6];
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

/// The part of a press's force at this time after the take began: held for over a second, each
/// differently.
fn pressed_part(load: usize, time_s: f64) -> f64 {
    let begin = 0.3 + 0.1 * ((3 * load) % 7) as f64;
    let end = begin + 1.3 + 0.07 * load as f64;
    let rise = ((time_s - begin) / 0.3).min((end - time_s) / 0.3);
    rise.clamp(0.0, 1.0)
}

/// Time and force of the presses: s, N.
type Pressed = Arc<Mutex<Vec<(f64, f64)>>>;

/// The simulated sensor's film under these forces, N, measured by the sensing in rendered frames.
fn film(
    pressed: Pressed,
    scene: Scene,
    forces_n: [f64; 6],
    mut sensor: Box<Sensor<'static>>,
) -> Film {
    let (mut time_s, mut begun_s, mut last_start) = (0.0, 0.0, 0);
    Box::new(move |frame, start| {
        time_s += FRAME_S;
        if start != last_start {
            (begun_s, last_start) = (time_s, start);
        }
        let pressing = HAND[start as usize - 1];
        let force_n = pressing.map_or(0.0, |load| {
            forces_n[load] * pressed_part(load, time_s - begun_s)
        });
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

/// The film has its weight, and the sensor knows which way it is held. The loads are of two sizes.
#[test]
#[ignore = "slow: 900 rendered frames and a fit"]
fn a_person_is_led_to_a_units_own_model() {
    let scene = layout_scene(Layout::default()).unwrap();
    let mut options = scene.options().clone();
    options.film.down = Some(ABOVE_THE_CAMERA.to_unit().map(f64::from));
    let held = scene.with_options(options).unwrap();
    let stdout = is_led_to_its_model(held, AS_ASKED, layouts::of_four());
    assert!(!stdout.contains("other forces are not judged"), "{stdout}");
    assert!(
        stdout.contains("holds when the sensor is turned"),
        "{stdout}"
    );
}

/// The film weighs nothing, and nobody said which way the sensor is held. All loads are of one
/// size.
#[test]
#[ignore = "slow: 900 rendered frames and a fit"]
fn a_person_is_led_to_the_model_of_a_unit_of_eight_dots() {
    let stdout = is_led_to_its_model(layouts::nominal(), OF_ONE_SIZE, layouts::untared());
    assert!(stdout.contains("other forces are not judged"), "{stdout}");
}

/// Returns what was said at the end.
fn is_led_to_its_model(scene: Scene, forces_n: [f64; 6], sensor: Box<Sensor<'static>>) -> String {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let poses = LOADS.map(|[alpha, beta, x, y]| format!("{alpha},{beta},{x},{y}\n"));
    std::fs::write(here.join("poses.csv"), poses.concat()).unwrap();
    let pressed = Pressed::default();
    let sensor = FakeSensor::of_film(
        film(pressed.clone(), scene.clone(), forces_n, sensor),
        usize::MAX,
    );
    *sensor.answers.lock().unwrap() = Answers {
        markers: Some(scene.options().layout.count() as u8),
        down: (scene.options().film.down)
            .map(|down| Direction::of_unit(down.map(|part| part as f32))),
        ..Answers::default()
    };
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
    for mn in [100, 200] {
        let asked = format!("press down to about {mn} mN");
        assert!(said.contains(&asked), "{said}");
    }
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
    measures(&here.join("unit/unit.hvtm"), &scene);
    stdout
}

/// Presses that are not among the loads: N, α and β in degrees, x and y in mm.
const OTHERS: [[f64; 5]; 13] = [
    [0.1, 0.0, 0.0, 0.0, 0.0],
    [0.1, 8.0, 0.0, 0.0, 0.0],
    [0.1, 0.0, 0.0, 3.0, 0.0],
    [0.1, 0.0, 0.0, 0.0, -3.0],
    [0.1, 0.0, 0.0, 1.0, -2.0],
    [0.07, 0.0, 0.0, 0.0, 0.0],
    [0.07, 0.0, 0.0, 1.0, -2.0],
    [0.05, 0.0, 0.0, 0.0, 0.0],
    [0.15, 0.0, 0.0, 0.0, 0.0],
    [0.15, 0.0, 0.0, 1.0, -2.0],
    [0.07, 3.0, -5.0, 1.0, -2.0],
    [0.1, -6.0, 2.0, -2.5, 1.5],
    [0.15, 0.0, 4.0, 0.5, 0.5],
];

/// Checks the forces of the kept model, after a tare, under other presses.
fn measures(model: &Path, scene: &Scene) {
    let bytes = std::fs::read(model).unwrap();
    let model = Model::parse(&bytes).unwrap();
    let mut sensor = forward::untared(&model).unwrap();
    let rest = rest_of(&mut sensor, scene, 100_000).unwrap();
    sensor.set_tare(Some(rest), Drift::NONE);
    for (number, [force_n, alpha, beta, x, y]) in (200_000..).zip(OTHERS) {
        let load = Load::from_angles(force_n, alpha, beta).unwrap();
        let load = load.with_offset_mm([x, y]).unwrap();
        let frame = scene.render_load(&load, number).unwrap();
        sensor.forget_frame();
        let seen = sensor.measure_frame(&frame.to_rgb565());
        assert!(!seen.status.contains(Status::NOT_CALIBRATED), "{seen:?}");
        let (errors, limits) = layouts::errors_and_limits(&seen.force.unwrap(), &load);
        // The limits are those of 95 %; half as much again is 3 σ.
        for (error, limit) in errors.into_iter().zip(limits) {
            assert!(
                error < 1.5 * limit,
                "{errors:?}, stated {limits:?}, under {load:?}"
            );
        }
    }
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
