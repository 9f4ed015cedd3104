//! Tests of the marker rules on rendered frames: every undisturbed frame passes, and no false one
//! has an error beyond a bound.

use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::threshold::PixelFormat;
use hivtac_tests::tared::{Detection, TaredSensor, View, views};
use hivtac_twin::{Contact, Frame, Load, Options, Paint, Patch, Preset, Scene};

/// Largest remaining errors of a partly covered marker, px: a small spot covers up to 0.2 mm of its
/// edge.
const COVERED_WEIGHTED: f64 = 0.3;
const COVERED_BINARY: f64 = 0.6;
/// Largest remaining errors of a marker with red added, px: a disc of its own size beneath it.
const GROWN_WEIGHTED: f64 = 0.3;
const GROWN_BINARY: f64 = 0.85;

/// Identity of the marker that the tests damage, and its place on the film, mm.
const SPOILT: usize = 1;
const SPOILT_MM: [f64; 2] = [3.717, -3.717];

const WEIGHTED: View = view(CentroidEstimator::RednessWeighted);
const BINARY: View = view(CentroidEstimator::BinaryMask);

const fn view(estimator: CentroidEstimator) -> View {
    View {
        preset: Preset::Ov7725,
        size: [320, 240],
        format: PixelFormat::Rgb565,
        estimator,
        contact: Contact::Force,
    }
}

fn scene(preset: Preset, options: Options) -> Scene {
    let scene = Scene::preset("rest", preset, 320, 240, 7).unwrap();
    scene.with_options(options).unwrap()
}

fn press(newtons: f64) -> Load {
    Load::from_vector([0.0, 0.0, -newtons]).unwrap()
}

/// Returns the markers' errors, px: the largest of them, and their mean. Returns `None` if there
/// may be no force.
fn trusted(sensor: &mut TaredSensor, frame: &Frame) -> Option<(f64, f64)> {
    match sensor.detect(frame) {
        Detection::Trusted { worst_px, mean_px } => Some((worst_px, mean_px)),
        Detection::Refused(_) => None,
    }
}

/// Returns the largest error in the accepted frames of a sweep, px, and the number of accepted
/// frames.
fn sweep(view: View, load: &Load, options: impl IntoIterator<Item = Options>) -> (f64, usize) {
    let mut sensor = view.sensor().unwrap();
    let (mut worst, mut accepted) = (0.0f64, 0);
    for (number, options) in (0..).zip(options) {
        let frame = scene(view.preset, options)
            .render_load(load, number)
            .unwrap();
        if let Some((error, _)) = trusted(&mut sensor, &frame) {
            worst = worst.max(error);
            accepted += 1;
        }
    }
    println!("{view:?}: {accepted} accepted, worst {worst:.3} px");
    (worst, accepted)
}

fn red_patch(centre_mm: [f64; 2], radius_mm: f64) -> Patch {
    Patch {
        centre_mm,
        radius_mm,
        paint: Paint::Red,
    }
}

/// Iterates over directions around a marker.
fn around(count: u32) -> impl Iterator<Item = (f64, f64)> {
    (0..count).map(move |step| {
        let (sin, cos) = (f64::from(step) / f64::from(count) * std::f64::consts::TAU).sin_cos();
        (cos, sin)
    })
}

#[test]
fn every_undisturbed_press_is_trusted() {
    for views in views(Contact::Force, &[[320, 240]]) {
        let mut sensors = views.map(|view| (view, view.sensor().unwrap()));
        let scene = scene(views[0].preset, Options::default());
        for newtons in [0.0, 0.005, 0.02, 0.05, 0.1, 0.2, 0.24] {
            for (x, y) in [
                (0.0, 0.0),
                (0.17, 0.0),
                (-0.17, 0.1),
                (0.1, 0.17),
                (0.2, 0.0),
                (0.0, -0.2),
            ] {
                let load = Load::from_vector([newtons * x, newtons * y, -newtons]).unwrap();
                let frame = scene.render_load(&load, 11).unwrap();
                for (view, sensor) in &mut sensors {
                    let (worst, _) = trusted(sensor, &frame)
                        .unwrap_or_else(|| panic!("{view:?}: {newtons} N, tilted by ({x}, {y})"));
                    let limit = view.tolerance_px();
                    assert!(worst < limit, "{view:?}: {newtons} N: off by {worst} px");
                }
            }
        }
    }
}

/// Iterates over options with light, everywhere or on one side, below the value threshold's need.
fn dim() -> impl Iterator<Item = Options> {
    let gains = [0.6, 0.45, 0.36, 0.32, 0.3, 0.28, 0.24];
    let gradients = [0.15, 0.4, 0.9];
    gains.into_iter().flat_map(move |gain| {
        gradients.into_iter().flat_map(move |steep| {
            around(8).map(move |(cos, sin)| Options {
                gain,
                gradient: [steep * cos, steep * sin],
                ..Options::default()
            })
        })
    })
}

#[test]
#[ignore = "8 s"]
fn light_that_eats_edges_is_refused_before_it_moves_markers() {
    for newtons in [0.0, 0.2] {
        let (worst, accepted) = sweep(WEIGHTED, &press(newtons), dim());
        assert!(worst < 0.3 && accepted > 20, "{worst} px, {accepted}");
        let (worst, accepted) = sweep(BINARY, &press(newtons), dim());
        assert!(worst < 0.45 && accepted > 20, "{worst} px, {accepted}");
    }
}

/// Returns options with patches of a paint that reach this far into the damaged marker from all
/// sides.
fn reaching_in(paint: Paint, depths_mm: &[f64]) -> Vec<Options> {
    let mut all = Vec::new();
    for radius_mm in [0.1, 0.3, 1.0] {
        for (cos, sin) in around(8) {
            for depth_mm in depths_mm {
                let distance = 0.5 + radius_mm - depth_mm;
                let [x, y] = SPOILT_MM;
                all.push(Options {
                    patches: vec![Patch {
                        centre_mm: [x + distance * cos, y + distance * sin],
                        radius_mm,
                        paint,
                    }],
                    ..Options::default()
                });
            }
        }
    }
    all
}

#[test]
#[ignore = "10 s"]
fn a_covered_marker_is_refused_before_it_moves() {
    let depths = [0.02, 0.05, 0.08, 0.11, 0.15, 0.2, 0.3, 0.5, 1.0];
    for paint in [Paint::Film, Paint::Glare] {
        let (worst, accepted) = sweep(WEIGHTED, &press(0.1), reaching_in(paint, &depths));
        assert!(
            worst < COVERED_WEIGHTED,
            "{paint:?}: {worst} px, {accepted}"
        );
        let (worst, accepted) = sweep(BINARY, &press(0.1), reaching_in(paint, &depths));
        assert!(worst < COVERED_BINARY, "{paint:?}: {worst} px, {accepted}");
    }
}

#[test]
fn red_that_grows_on_a_marker_is_refused_before_it_moves() {
    let mut growths = Vec::new();
    for radius_mm in [0.1, 0.3, 0.5, 1.0] {
        for (cos, sin) in around(8) {
            for step in 0..8 {
                let distance = (radius_mm - 0.5f64).abs() + 0.04 * f64::from(step);
                let [x, y] = SPOILT_MM;
                let patch = red_patch([x + distance * cos, y + distance * sin], radius_mm);
                growths.push(Options {
                    patches: vec![patch],
                    ..Options::default()
                });
            }
        }
    }
    let (worst, _) = sweep(WEIGHTED, &press(0.1), growths.clone());
    assert!(worst < GROWN_WEIGHTED, "{worst} px");
    let (worst, _) = sweep(BINARY, &press(0.1), growths);
    assert!(worst < GROWN_BINARY, "{worst} px");
}

/// Returns options with a red disc in place of a hidden marker, and the disc's distance from the
/// marker's place, mm.
fn stand_ins() -> Vec<(Options, f64)> {
    let mut missing = [false; 4];
    missing[SPOILT] = true;
    let mut all = Vec::new();
    for radius_mm in [0.45, 0.5, 0.55, 1.0] {
        for (cos, sin) in around(8) {
            for distance in [0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0] {
                let [x, y] = SPOILT_MM;
                let patch = red_patch([x + distance * cos, y + distance * sin], radius_mm);
                let options = Options {
                    missing: missing.into(),
                    patches: vec![patch],
                    ..Options::default()
                };
                all.push((options, distance));
            }
        }
    }
    all
}

#[test]
#[ignore = "6 s"]
fn a_disc_in_place_of_a_marker_is_refused() {
    for (view, farthest_mm) in [(WEIGHTED, 0.04), (BINARY, 0.11)] {
        let mut sensor = view.sensor().unwrap();
        for (options, distance) in stand_ins() {
            let frame = scene(view.preset, options)
                .render_load(&press(0.05), 5)
                .unwrap();
            let accepted = trusted(&mut sensor, &frame).is_some();
            assert!(
                !accepted || distance < farthest_mm,
                "{view:?}: {distance} mm away"
            );
        }
    }
}

#[test]
#[ignore = "15 s"]
fn a_fifth_disc_never_takes_a_markers_place() {
    for view in [WEIGHTED, BINARY] {
        let mut sensor = view.sensor().unwrap();
        let mut told_apart = 0;
        for radius_mm in [0.3, 0.5, 1.2] {
            for (x, y) in (-7..=7).flat_map(|x| (-7..=7).map(move |y| (f64::from(x), f64::from(y))))
            {
                let options = Options {
                    patches: vec![red_patch([x + 0.2, y + 0.1], radius_mm)],
                    ..Options::default()
                };
                let load = Load::from_vector([0.01, 0.0, -0.1]).unwrap();
                let frame = scene(view.preset, options).render_load(&load, 5).unwrap();
                if let Some((worst, _)) = trusted(&mut sensor, &frame) {
                    let limit = view.tolerance_px();
                    assert!(
                        worst < limit,
                        "{radius_mm} mm at ({x}, {y}) mm: off by {worst} px"
                    );
                    told_apart += 1;
                }
            }
        }
        assert!(
            told_apart > 500,
            "{view:?}: only {told_apart} of 675 frames were trusted"
        );
    }
}
