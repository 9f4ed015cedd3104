//! Tests of changing forces under a rolling shutter: shows the benefit of moving the markers to one
//! common time.
//!
//! `cargo test --release -p hivtac-tests moving:: -- --nocapture` prints the table of
//! `docs/firmware.md`.

use std::fs;
use std::path::Path;

use hivtac_sensor::force::Force;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::motion;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::threshold::ByteOrder;
use hivtac_twin::{Catch, Load, Motion, Preset, Scene, Shutter, Vibration};

/// Number of lines of an OV7725's frame; 240 of them are rows.
const LINES: u16 = 278;
/// The camera's rates, frames a second.
const RATES: [f64; 3] = [156.12, 78.06, 39.03];
/// Exposure time of each row, s.
const EXPOSURE_S: f64 = 0.004;
/// Number of frames per run.
const FRAMES: u64 = 60;
/// The smallest |F| for which the direction counts, N.
const FLOOR_N: f64 = 0.05;
/// Returns a motion of 0.13 ± 0.08 N at 10 Hz: up to 5 N/s.
fn fast() -> Motion {
    Motion::Vibration(Vibration {
        force_n: 0.13,
        alpha_deg: 4.0,
        beta_deg: -3.0,
        amplitude_n: 0.08,
        frequency_hz: 10.0,
        ..Vibration::default()
    })
}

/// Errors of one run.
#[derive(Clone, Copy, Debug)]
struct Errors {
    /// Mean angle to the true force, degrees.
    mean_deg: f64,
    /// Largest angle, degrees.
    most_deg: f64,
    /// Root mean square error of |F|, mN.
    magnitude_mn: f64,
    /// Frames without a force.
    refused: usize,
}

fn sensor(model: &[u8], motion: motion::Motion) -> Box<Sensor<'_>> {
    let model = Model::parse(model).unwrap();
    let mut sensor = Box::new(Sensor::<64>::new());
    let settings = model.conditions.settings(ByteOrder::Native);
    sensor.configure(settings, Some(model)).unwrap();
    sensor.set_motion(motion);
    sensor
}

/// Returns the errors for a scene at a rate, with markers as seen and moved to one time.
fn errors(model: &[u8], scene: &Scene, rate_hz: f64) -> [Errors; 2] {
    let shutter = Shutter {
        exposure_s: EXPOSURE_S,
        readout_s: 240.0 / f64::from(LINES) / rate_hz,
    };
    let motions = [motion::Motion::GLOBAL, motion::Motion::rolling(LINES)];
    let mut sensors = motions.map(|motion| sensor(model, motion));
    let mut found = [const { Vec::new() }; 2];
    let mut refused = [0; 2];
    for number in 0..FRAMES {
        let frame = scene.frame_by(&shutter, number, 0.6 + number as f64 / rate_hz);
        for (nth, sensor) in sensors.iter_mut().enumerate() {
            let force = sensor.measure_frame(&frame.pixels).force;
            let truth = frame.truth.force;
            // The first frame has no predecessor.
            if number == 0 || truth.magnitude_n() < FLOOR_N {
                continue;
            }
            let Some(force) = force else {
                refused[nth] += 1;
                continue;
            };
            let found_n = force
                .cartesian
                .map(|component| f64::from(component.0) * 1e-6);
            found[nth].push((
                angle_deg(found_n, truth.vector_n()),
                f64::from(force.magnitude.0) * 1e-3 - truth.magnitude_n() * 1e3,
            ));
        }
    }
    [0, 1].map(|nth| summed_up(&found[nth], refused[nth]))
}

fn summed_up(found: &[(f64, f64)], refused: usize) -> Errors {
    let count = found.len() as f64;
    Errors {
        mean_deg: found.iter().map(|(deg, _)| deg).sum::<f64>() / count,
        most_deg: found.iter().map(|(deg, _)| *deg).fold(0.0, f64::max),
        magnitude_mn: (found.iter().map(|(_, mn)| mn * mn).sum::<f64>() / count).sqrt(),
        refused,
    }
}

fn angle_deg(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let cross = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i]);
    let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    sine.atan2(dot).to_degrees()
}

#[test]
fn a_force_that_changes_is_measured_as_one_that_stays() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let model = fs::read(root.join("calibration/models/default.hvtm")).unwrap();
    let preset = |name| Scene::preset(name, Preset::Ov7725, 320, 240, 5).unwrap();
    let scenes = [
        ("0", preset("static")),
        ("0.6", preset("demo")),
        ("to 5", preset("static").with_motion(fast()).unwrap()),
    ];
    println!("| N/s | frames/s | as seen | at one time |\n|---|---:|---|---|");
    for (name, scene) in &scenes {
        for rate_hz in RATES {
            let [seen, moved] = errors(&model, scene, rate_hz);
            let text = |e: Errors| {
                let Errors {
                    mean_deg,
                    most_deg,
                    magnitude_mn,
                    refused,
                } = e;
                format!(
                    "{mean_deg:.2}°, {most_deg:.1}° at most; {magnitude_mn:.2} mN; {refused} \
                     refused"
                )
            };
            println!(
                "| {name} | {rate_hz:.0} | {} | {} |",
                text(seen),
                text(moved)
            );
            let worth = match *name {
                // Two frames' noise instead of one frame's.
                "0" => moved.mean_deg < 1.25 * seen.mean_deg,
                // As seen, no single contact explains markers that moved one after the other.
                "0.6" => moved.mean_deg < 0.4 && 10 * moved.refused.max(1) <= seen.refused,
                // Four frames per period are too few to give a velocity.
                _ => rate_hz < 40.0 || moved.mean_deg < 0.8 * seen.mean_deg,
            };
            assert!(worth, "{name} N/s at {rate_hz} Hz: {seen:?} {moved:?}");
        }
    }
}

/// Hits of an object that is then held, 6 to 12 Hz: |F| changes by up to a fifth from frame to
/// frame, and so does the place.
fn hits() -> Vec<Scene> {
    let still = Scene::preset("static", Preset::Ov7725, 320, 240, 5).unwrap();
    let hit = |frequency_hz| {
        let catch = Catch {
            peak_n: 0.12,
            hold_n: 0.05,
            frequency_hz,
            start_s: 0.1,
            ..Catch::default()
        };
        still.clone().with_motion(Motion::Catch(catch)).unwrap()
    };
    [6.0, 9.0, 12.0].map(hit).into()
}

/// Whether direction, |F| and place are within three of their stated standard uncertainties; the
/// place is off along two axes.
fn is_covered(force: &Force, truth: &Load) -> bool {
    let found_n = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    let place = force.place.unwrap();
    let [x, y] = truth.offset_mm();
    let off = [
        angle_deg(found_n, truth.vector_n()) * 1e3 / f64::from(force.direction_sigma.0),
        (f64::from(force.magnitude.0) - truth.magnitude_n() * 1e6).abs()
            / f64::from(force.magnitude_sigma.0),
        (f64::from(place.x.0) - x * 1e3).hypot(f64::from(place.y.0) - y * 1e3)
            / f64::from(place.sigma.0)
            / std::f64::consts::SQRT_2,
    ];
    off.iter().all(|off| *off <= 3.0)
}

#[test]
fn forces_of_hits_are_kept_and_within_three_sigma() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let model = fs::read(root.join("calibration/models/default.hvtm")).unwrap();
    let shutter = Shutter {
        exposure_s: EXPOSURE_S,
        readout_s: 240.0 / f64::from(LINES) / RATES[0],
    };
    let [mut frames, mut refused, mut beyond] = [0; 3];
    for scene in hits() {
        let mut sensor = sensor(&model, motion::Motion::rolling(LINES));
        for number in 0..FRAMES {
            let frame = scene.frame_by(&shutter, number, number as f64 / RATES[0]);
            let force = sensor.measure_frame(&frame.pixels).force;
            let truth = frame.truth.force;
            if truth.magnitude_n() < 2e-3 {
                continue;
            }
            frames += 1;
            refused += u32::from(force.is_none());
            beyond += u32::from(force.is_some_and(|force| !is_covered(&force, &truth)));
        }
    }
    println!("{refused} of {frames} refused, {beyond} beyond three sigma");
    // Some first and last frames of a contact, in which the pattern is not square.
    assert!(
        frames > 100 && 15 * refused <= frames,
        "{refused} of {frames}"
    );
    assert!(100 * beyond <= frames, "{beyond} of {frames}");
}
