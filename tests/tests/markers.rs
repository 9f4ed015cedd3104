//! What the marker rules let through on rendered frames: every honest frame, and no false one beyond a bound.

use hivtac_scene::{Frame, Load, Options, Paint, Patch, Preset, Scene};
use hivtac_sensing::{
    geometry::{self, Geometry},
    pipeline::{Measurement, Sensor},
    settings::Settings,
    status::Status,
    tare::TareBuilder,
    threshold::ByteOrder,
};

/// Identity of the marker that the tests spoil, and where it is on the film, mm.
const SPOILT: usize = 1;
const SPOILT_MM: [f64; 2] = [3.717, -3.717];

fn scene(preset: Preset, options: Options) -> Scene {
    let scene = Scene::preset("rest", preset, 320, 240, 7).unwrap();
    scene.with_options(options).unwrap()
}

fn press(newtons: f64) -> Load {
    Load::from_vector([0.0, 0.0, -newtons]).unwrap()
}

fn sense(sensor: &mut Sensor<'_>, frame: &Frame) -> Measurement {
    sensor.begin_frame();
    let rows = frame.pixels.chunks(frame.width as usize);
    rows.for_each(|row| sensor.push_row(row));
    sensor.finish_frame()
}

/// A sensor without a model that was tared on the nominal scene at rest.
fn tared(preset: Preset) -> Box<Sensor<'static>> {
    let lens = match preset {
        Preset::Paper => geometry::Preset::Paper,
        Preset::Ov7725 => geometry::Preset::Ov7725,
    };
    let geometry = Geometry::preset(lens, 320, 240);
    let mut sensor = Box::new(Sensor::new());
    let settings = Settings::usual(geometry, ByteOrder::Native);
    sensor.configure(settings, None).unwrap();
    let scene = scene(preset, Options::default());
    let mut builder = TareBuilder::new(4).unwrap();
    let rest = (0..4).find_map(|number| {
        let seen = sense(
            &mut sensor,
            &scene.render_load(&press(0.0), number).unwrap(),
        );
        builder.add(&seen.markers.unwrap(), &seen.features.unwrap())
    });
    sensor.set_tare(rest);
    sensor
}

/// How far the markers are off, px: the worst of them, and their mean. `None` when there may be no force.
fn trusted(sensor: &mut Sensor<'_>, frame: &Frame) -> Option<(f64, f64)> {
    let seen = sense(sensor, frame);
    // There is no model, so that this one bit is always set.
    let forbidden = seen.status.bits() & Status::NO_FORCE.bits();
    if forbidden != Status::MODEL_MISSING.bits() {
        return None;
    }
    let (mut worst, mut sum) = (0.0f64, [0.0, 0.0]);
    for (marker, truth) in seen.markers.unwrap().iter().zip(&frame.truth.markers) {
        // A marker that is not there cannot be found.
        let [x, y] = truth
            .as_ref()
            .map_or([f64::MAX; 2], |truth| truth.centroid_px);
        let (dx, dy) = (marker.x.to_f64() - x, marker.y.to_f64() - y);
        worst = worst.max(dx.hypot(dy));
        sum = [sum[0] + dx, sum[1] + dy];
    }
    Some((worst, f64::hypot(sum[0], sum[1]) / 4.0))
}

fn red_patch(centre_mm: [f64; 2], radius_mm: f64) -> Patch {
    Patch {
        centre_mm,
        radius_mm,
        paint: Paint::Red,
    }
}

/// Directions around a marker.
fn around(count: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(move |step| {
        let (sin, cos) = (f64::from(step) / f64::from(count) * std::f64::consts::TAU).sin_cos();
        (cos, sin)
    })
}

#[test]
fn every_honest_press_is_trusted() {
    for preset in [Preset::Ov7725, Preset::Paper] {
        let mut sensor = tared(preset);
        let scene = scene(preset, Options::default());
        for newtons in [0.0, 0.005, 0.02, 0.05, 0.1, 0.2, 0.3, 0.4] {
            for (x, y) in [
                (0.0, 0.0),
                (0.17, 0.0),
                (-0.17, 0.1),
                (0.1, 0.17),
                (0.3, 0.0),
                (0.0, -0.3),
            ] {
                let load = Load::from_vector([newtons * x, newtons * y, -newtons]).unwrap();
                let frame = scene.render_load(&load, 11).unwrap();
                let (worst, _) = trusted(&mut sensor, &frame)
                    .unwrap_or_else(|| panic!("{preset:?}: {newtons} N, tilted by ({x}, {y})"));
                assert!(worst < 0.4, "{preset:?}: {newtons} N: off by {worst} px");
            }
        }
    }
}

#[test]
fn light_that_eats_edges_is_refused_before_it_moves_markers() {
    let mut sensor = tared(Preset::Ov7725);
    for gain in [
        1.0, 0.6, 0.5, 0.4, 0.36, 0.34, 0.32, 0.3, 0.28, 0.26, 0.24, 0.2,
    ] {
        for gradient in [
            [0.0, 0.0],
            [0.3, 0.0],
            [0.3, 0.3],
            [0.6, 0.0],
            [0.6, -0.6],
            [0.9, 0.9],
        ] {
            for newtons in [0.0, 0.2] {
                let options = Options {
                    gain,
                    gradient,
                    ..Options::default()
                };
                let frame = scene(Preset::Ov7725, options)
                    .render_load(&press(newtons), 5)
                    .unwrap();
                let seen = trusted(&mut sensor, &frame);
                if let Some((worst, mean)) = seen {
                    let case = format!("gain {gain}, gradient {gradient:?}, {newtons} N");
                    assert!(
                        worst < 0.5 && mean < 0.15,
                        "{case}: off by {worst}, {mean} px"
                    );
                    assert!(gain > 0.28, "{case}: too dark");
                }
                assert!(
                    seen.is_some() || gain < 1.0 || gradient[0] > 0.3,
                    "{gain} {gradient:?}"
                );
            }
        }
    }
}

#[test]
fn a_covered_marker_is_refused_before_it_moves() {
    let mut sensor = tared(Preset::Ov7725);
    for radius_mm in [0.3, 0.6, 2.0] {
        for (cos, sin) in around(12) {
            for depth_mm in (0..18).map(|step| f64::from(step) * 0.05) {
                let distance = 0.5 + radius_mm - depth_mm;
                let [x, y] = SPOILT_MM;
                let cover = Patch {
                    centre_mm: [x + distance * cos, y + distance * sin],
                    radius_mm,
                    paint: Paint::Film,
                };
                let options = Options {
                    patches: vec![cover],
                    ..Options::default()
                };
                let frame = scene(Preset::Ov7725, options)
                    .render_load(&press(0.1), 5)
                    .unwrap();
                if let Some((worst, _)) = trusted(&mut sensor, &frame) {
                    assert!(
                        worst < 0.8,
                        "{depth_mm} mm of {radius_mm} mm: off by {worst} px"
                    );
                    assert!(depth_mm < 0.31, "{depth_mm} mm of {radius_mm} mm hidden");
                }
            }
        }
    }
}

#[test]
fn red_that_grows_on_a_marker_is_refused_before_it_moves() {
    let mut sensor = tared(Preset::Ov7725);
    for radius_mm in [0.2, 0.5, 1.0] {
        for (cos, sin) in around(8) {
            for distance in (0..18).map(|step| f64::from(step) * 0.1) {
                let [x, y] = SPOILT_MM;
                let patch = red_patch([x + distance * cos, y + distance * sin], radius_mm);
                let options = Options {
                    patches: vec![patch],
                    ..Options::default()
                };
                let frame = scene(Preset::Ov7725, options)
                    .render_load(&press(0.1), 5)
                    .unwrap();
                if let Some((worst, _)) = trusted(&mut sensor, &frame) {
                    assert!(
                        worst < 1.0,
                        "{radius_mm} mm at {distance} mm: off by {worst} px"
                    );
                }
            }
        }
    }
}

#[test]
fn a_disc_in_place_of_a_marker_is_refused() {
    let mut sensor = tared(Preset::Ov7725);
    let mut missing = [false; 4];
    missing[SPOILT] = true;
    let steps = || (-10..=10).map(|step| f64::from(step) * 0.21);
    for radius_mm in [0.4, 0.5, 0.6, 1.0] {
        for (dx, dy) in steps().flat_map(|dx| steps().map(move |dy| (dx, dy))) {
            let [x, y] = SPOILT_MM;
            let options = Options {
                missing,
                patches: vec![red_patch([x + dx, y + dy], radius_mm)],
                ..Options::default()
            };
            let frame = scene(Preset::Ov7725, options)
                .render_load(&press(0.05), 5)
                .unwrap();
            if trusted(&mut sensor, &frame).is_some() {
                let distance = dx.hypot(dy);
                assert!(
                    distance < 0.55,
                    "{radius_mm} mm, {distance} mm from where the marker was"
                );
                assert!((0.41..0.59).contains(&radius_mm), "{radius_mm} mm");
            }
        }
    }
}

#[test]
fn a_fifth_disc_never_takes_a_markers_place() {
    let mut sensor = tared(Preset::Ov7725);
    let mut told_apart = 0;
    for radius_mm in [0.3, 0.5, 0.7, 1.2] {
        for (x, y) in (-7..=7).flat_map(|x| (-7..=7).map(move |y| (f64::from(x), f64::from(y)))) {
            let options = Options {
                patches: vec![red_patch([x + 0.2, y + 0.1], radius_mm)],
                ..Options::default()
            };
            let load = Load::from_vector([0.01, 0.0, -0.1]).unwrap();
            let frame = scene(Preset::Ov7725, options)
                .render_load(&load, 5)
                .unwrap();
            if let Some((worst, _)) = trusted(&mut sensor, &frame) {
                assert!(
                    worst < 1.5,
                    "{radius_mm} mm at ({x}, {y}) mm: off by {worst} px"
                );
                told_apart += 1;
            }
        }
    }
    assert!(
        told_apart > 700,
        "only {told_apart} of 900 frames were trusted"
    );
}
