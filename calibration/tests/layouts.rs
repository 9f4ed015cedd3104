//! Tests frames of a film with eight dots through the sensor's own code: identities by the rest
//! position, a force with a correct uncertainty, also without a dot, and clear refusals.

use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_calibration::forward::{self, layout_model, layout_scene, layout_weights};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::{AlignedFile, Model};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_sensor::tare::{Refusal, TareBuilder};
use hivtac_shell::{Design, Film};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::ByteOrder;
use hivtac_twin::film::{Dots, Layout};
use hivtac_twin::{Load, Options, Paint, Patch, Scene};

/// The committed model of eight dots.
static FILE: &AlignedFile<[u8]> = &AlignedFile(*include_bytes!("../models/8v/default.hvtm"));

pub fn model() -> Model<'static> {
    Model::parse(&FILE.0).unwrap()
}

pub fn layout() -> Layout {
    "8v".parse().unwrap()
}

pub fn scene(change: impl FnOnce(&mut Options)) -> Scene {
    let scene = layout_scene(layout()).unwrap();
    let mut options = scene.options().clone();
    change(&mut options);
    scene.with_options(options).unwrap()
}

pub fn nominal() -> Scene {
    scene(|_| {})
}

pub fn untared() -> Box<Sensor<'static>> {
    forward::untared(&model()).unwrap()
}

fn seen(sensor: &mut Sensor<'_>, scene: &Scene, load: &Load, number: u64) -> Measurement {
    sensor.forget_frame();
    sensor.measure_frame(&scene.render_load(load, number).unwrap().to_rgb565())
}

/// The result of a tare on these frames; `None` if they show too few markers.
fn tare(sensor: &mut Sensor<'_>, scene: &Scene, load: &Load) -> Option<Result<Rest, Refusal>> {
    let mut tare = TareBuilder::new(16).unwrap();
    (0..32).find_map(|number| {
        let measurement = seen(sensor, scene, load, 1_000 + number);
        sensor.tare_with(&mut tare, &measurement)
    })
}

/// A sensor that was tared on this scene.
pub fn tared(scene: &Scene) -> Box<Sensor<'static>> {
    let mut sensor = untared();
    let rest = tare(&mut sensor, scene, &Load::REST).unwrap().unwrap();
    sensor.set_tare(Some(rest), Drift::NONE);
    sensor
}

/// Presses within ±4 mm, of 50 to 200 mN.
fn loads() -> impl Iterator<Item = (u64, Load)> {
    (0..40_u64).map(|number| {
        let part = |times: f64| 2.0 * (number as f64 * times).fract() - 1.0;
        let force_n = 0.125 + 0.075 * part(0.618);
        let load = Load::from_angles(force_n, 8.0 * part(0.755), 8.0 * part(0.57)).unwrap();
        let place_mm = [4.0 * part(0.414), 4.0 * part(0.303)];
        (number, load.with_offset_mm(place_mm).unwrap())
    })
}

/// Errors of direction, degrees, |F|, N, and place, mm; and their stated 95 % bounds.
pub fn errors_and_limits(force: &Force, load: &Load) -> ([f64; 3], [f64; 3]) {
    let newtons = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    let length = newtons.iter().map(|part| part * part).sum::<f64>().sqrt();
    let off_deg = angle_deg(
        newtons.map(|part| part / length),
        load.vector_n().map(|part| part / load.magnitude_n()),
    );
    let place = force.place.unwrap();
    let [x, y] = load.offset_mm();
    let off_mm = (f64::from(place.x.0) * 1e-3 - x).hypot(f64::from(place.y.0) * 1e-3 - y);
    let errors = [
        off_deg.unwrap(),
        (length - load.magnitude_n()).abs(),
        off_mm,
    ];
    let limits = [
        1.731e-3 * f64::from(force.direction_sigma.0),
        1.96e-6 * f64::from(force.magnitude_sigma.0),
        2.448e-3 * f64::from(place.sigma.0),
    ];
    (errors, limits)
}

/// Number of presses with a force, and with all three errors within the stated 95 %; the lost
/// markers of each force.
fn judged(sensor: &mut Sensor<'_>, scene: &Scene) -> (u32, [u32; 3], Vec<Lost>) {
    let (mut shown, mut within, mut lost) = (0, [0; 3], Vec::new());
    for (number, load) in loads() {
        let measurement = seen(sensor, scene, &load, number);
        let Some(force) = measurement.force else {
            println!(
                "{number}: {:?} {load:?} {:?}",
                measurement.status, measurement.lost
            );
            continue;
        };
        let is_lost = measurement.lost != Lost::NONE;
        assert!(!is_lost || measurement.status.contains(Status::MARKER_LOST));
        shown += 1;
        lost.push(measurement.lost);
        let (errors, limits) = errors_and_limits(&force, &load);
        println!(
            "{number}: {errors:.4?} {limits:.4?} {:?}",
            measurement.status
        );
        for (within, (error, limit)) in within.iter_mut().zip(errors.iter().zip(limits)) {
            *within += u32::from(*error <= limit);
        }
    }
    (shown, within, lost)
}

#[test]
fn eight_dots_give_a_force_with_a_correct_uncertainty() {
    let scene = nominal();
    let (shown, within, _) = judged(&mut tared(&scene), &scene);
    assert!(shown >= 38, "{shown} of 40");
    assert!(
        within.iter().all(|part| *part >= 33),
        "{within:?} of {shown}"
    );
}

/// Eight dots show how wide a contact is: an unannounced needle is measured nearly as well.
#[test]
fn a_contact_of_unknown_shape_is_little_less_certain() {
    let scene = nominal();
    let mut sensor = tared(&scene);
    for (number, load) in loads().take(8) {
        let sigmas = [ContactShape::Needle, ContactShape::Unknown].map(|shape| {
            sensor.set_contact_shape(shape);
            let force = seen(&mut sensor, &scene, &load, number).force.unwrap();
            let place = force.place.unwrap().sigma.0;
            [force.direction_sigma.0, force.magnitude_sigma.0, place].map(f64::from)
        });
        let (of_needle, of_unknown) = (sigmas[0], sigmas[1]);
        for (needle, unknown) in of_needle.iter().zip(of_unknown) {
            assert!(
                (0.9..6.0).contains(&(unknown / needle)),
                "{number}: {sigmas:?}"
            );
        }
    }
}

/// Any of the eight, as if it had peeled off.
#[test]
fn a_dot_that_is_lost_costs_no_force() {
    for lost in [0, 5] {
        let mut sensor = tared(&nominal());
        let scene = scene(|options| options.missing = Dots::from_fn(8, |dot| dot == lost));
        let (shown, within, without) = judged(&mut sensor, &scene);
        assert!(shown >= 37, "{shown} of 40");
        assert!(
            within.iter().all(|part| *part >= 32),
            "{within:?} of {shown}"
        );
        assert!(without.iter().all(|without| without.contains(lost)));
    }
}

/// A dot that moved on the film by 0.03 mm, half a pixel, since the tare.
#[test]
fn a_dot_that_lies_is_left_out() {
    for liar in [2, 4] {
        let mut sensor = tared(&nominal());
        let scene = scene(|options| {
            options.glued_mm = Dots::defaults(8);
            options.glued_mm[liar] = [0.03, 0.0];
        });
        let (shown, within, _) = judged(&mut sensor, &scene);
        assert!(shown >= 36, "{shown} of 40");
        assert!(
            within.iter().all(|part| *part >= 30),
            "{within:?} of {shown}"
        );
    }
}

#[test]
fn glare_on_a_rim_refuses_no_force() {
    let mut sensor = tared(&nominal());
    let (mut shown, mut within) = (0, [0; 3]);
    for dot in 0..8 {
        let (sin, cos) = (dot as f64).sin_cos();
        let [x, y] = layout().centres_mm()[dot];
        let scene = scene(|options| {
            options.patches.push(Patch {
                centre_mm: [x + 0.5 * cos, y + 0.5 * sin],
                radius_mm: 0.1,
                paint: Paint::Glare,
            });
        });
        let (more, more_within, _) = judged(&mut sensor, &scene);
        shown += more;
        within = [0, 1, 2].map(|k| within[k] + more_within[k]);
    }
    assert!(shown >= 312, "{shown} of 320");
    assert!(
        within.iter().all(|part| *part >= 280),
        "{within:?} of {shown}"
    );
}

/// A camera that is shifted by 1 mm of film and rolled, before the first tare.
#[test]
fn a_first_tare_finds_the_dots_of_a_shifted_camera() {
    let scene = scene(|options| options.mounting.roll_deg = 4.0);
    let sensor = tared(&scene);
    let rest = sensor.tare().unwrap().markers();
    let truth = scene.truth_under(&Load::REST).unwrap();
    for (marker, truth) in rest.iter().zip(truth.markers.iter()) {
        let [x, y] = truth.unwrap().centroid_px;
        assert!((marker.x.to_f64() - x).hypot(marker.y.to_f64() - y) < 0.5);
    }
}

#[test]
fn a_tare_is_refused_while_a_dot_is_missing_or_something_presses() {
    let mut sensor = untared();
    let missing = scene(|options| options.missing = Dots::from_fn(8, |dot| dot == 3));
    assert_eq!(tare(&mut sensor, &missing, &Load::REST), None);
    let press = Load::from_angles(0.02, 0.0, 0.0).unwrap();
    let refused = tare(&mut sensor, &nominal(), &press).unwrap();
    assert!(matches!(refused, Err(Refusal::Touched(_))), "{refused:?}");
}

/// `hivtac-calibrate layout 8v` makes the files that demo, twin and calibration use.
#[test]
#[ignore = "90 s: the tables of eight dots are made anew"]
fn the_models_files_are_as_they_are_made() {
    const ANEW: &str = "make it anew: hivtac-calibrate layout";
    let weights = Weights::parse(include_str!("../models/8v/default.weights")).unwrap();
    let spec = layout_model(layout(), 2).unwrap();
    assert!(spec.encode().unwrap() == FILE.0, "{ANEW}");
    assert!(layout_weights(&spec).unwrap() == weights, "{ANEW}");
    assert!(export(&weights).unwrap() == FILE.0, "{ANEW}");
}

/// A sensor with the model of the four dots, without a tare.
pub fn of_four() -> Box<Sensor<'static>> {
    static FILE: &AlignedFile<[u8]> = &AlignedFile(*include_bytes!("../models/default.hvtm"));
    forward::untared(&Model::parse(&FILE.0).unwrap()).unwrap()
}

/// Another layout than the model's is on the film: it is named, and there is no force, whatever
/// presses.
#[test]
fn another_film_than_the_models_is_named_and_gives_no_force() {
    let four = layout_scene(Layout::default()).unwrap();
    for (mut sensor, film) in [(untared(), &four), (of_four(), &nominal())] {
        for (number, load) in loads().chain([(100, Load::REST)]) {
            let measurement = seen(&mut sensor, film, &load, number);
            assert!(measurement.force.is_none(), "{number}: {measurement:?}");
            let named = measurement.status.contains(Status::ANOTHER_LAYOUT);
            assert!(named, "{number}: {:?}", measurement.status);
        }
    }
}

/// A rest position of another layout than the model's.
#[test]
fn a_tare_of_another_layout_gives_no_force() {
    let four = layout_scene(Layout::default()).unwrap();
    let mut sensor = untared();
    let mut four_dots: Rest = model().rest;
    four_dots = Rest::of_markers(&four_dots.markers()[..4]);
    sensor.set_tare(Some(four_dots), Drift::NONE);
    let measurement = seen(&mut sensor, &four, &Load::REST, 1);
    assert!(measurement.status.contains(Status::MODEL_MISMATCH));
    // A model of the four dots' layout: the tare of eight is not kept.
    let file: &AlignedFile<[u8]> = &AlignedFile(*include_bytes!("../models/default.hvtm"));
    let of_four = Model::parse(&file.0).unwrap();
    let mut sensor = tared(&nominal());
    let settings = of_four.conditions.settings(ByteOrder::Native);
    sensor.reconfigure(settings, Some(of_four)).unwrap();
    assert_eq!(sensor.tare(), None);
}

/// A needle that turns, by the full solver: the force has its torque, whether or not the sensor
/// knows that it is a needle.
#[test]
fn a_needle_that_turns_has_a_torque() {
    let scene = nominal();
    let film = Film::new(&Design::default()).unwrap();
    let load = Load::from_angles(0.12, 4.0, -3.0).unwrap();
    let load = load.with_offset_mm([2.0, -1.5]).unwrap();
    let tip = hivtac_shell::Patch::tip(load.offset_mm(), film.design().tip_radius_mm).unwrap();
    for torque_nmm in [-0.04, 0.04] {
        let state = film.press_twisted(&tip, load.vector_n(), torque_nmm, &film.rest());
        let state = state.unwrap();
        let moved = |rest_mm| film.displacement(&state, rest_mm);
        let frame = scene.render_film(moved, &Load::REST, 7);
        for shape in [ContactShape::Unknown, ContactShape::Needle] {
            let mut sensor = tared(&scene);
            sensor.set_contact_shape(shape);
            let seen = sensor.measure_frame(&frame.to_rgb565());
            let force = seen.force.unwrap_or_else(|| panic!("{shape:?}: {seen:?}"));
            let (errors, limits) = errors_and_limits(&force, &load);
            assert!(
                errors[0] < 1.5 * limits[0],
                "{shape:?}: {errors:?} {limits:?}"
            );
            let torque = force
                .torque
                .unwrap_or_else(|| panic!("{shape:?}: {seen:?}"));
            let off_nmm = f64::from(torque.z.0) * 1e-6 - torque_nmm;
            let sigma_nmm = f64::from(torque.sigma.0) * 1e-6;
            assert!(
                sigma_nmm < 0.006 && off_nmm.abs() < 3.0 * sigma_nmm,
                "{torque:?}"
            );
        }
    }
}
