//! Tests of a sensor that is turned over: its film hangs in the other direction.

use hivtac_sensor::pipeline::Measurement;
use hivtac_sensor::tare::Refusal;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::status::Status;
use hivtac_tests::judged::{Contacts, Judged, errors};
use hivtac_tests::models;
use hivtac_tests::pictures::Random;
use hivtac_tests::tared::TaredSensor;
use hivtac_twin::{Frame, Load, Mechanics, Options, Preset, Scene};

const FRAMES: u16 = 16;
const PRESSES: Contacts = Contacts {
    force_n: [0.02, 0.2],
    ratio: 0.3,
    place_mm: 4.0,
};
const PRESSED: usize = 120;
/// Gravity along the film, under which the film hangs like a weightless one, within a tenth of a
/// pixel. The default model takes it for its own unit, whose forces it knows best.
const ALONG: [f64; 3] = [1.0, 0.0, 0.0];
const TOWARDS: [f64; 3] = [0.0, 0.0, -1.0];
const AWAY: [f64; 3] = [0.0, 0.0, 1.0];
const BETWEEN: [[f64; 3]; 2] = [[0.0, -0.8, 0.6], [-0.48, 0.64, -0.6]];

fn held(down: [f64; 3]) -> Scene {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 11).unwrap();
    let film = Mechanics {
        down: Some(down),
        ..Mechanics::default()
    };
    let options = Options {
        film,
        ..Options::default()
    };
    scene.with_options(options).unwrap()
}

fn down_of(down: [f64; 3]) -> Down {
    Down::Told(Direction::of_unit(down.map(|part| part as f32)))
}

fn at_rest(scene: &Scene) -> impl Iterator<Item = Frame> {
    (0..4 * u64::from(FRAMES)).map(|number| scene.render_load(&Load::REST, number).unwrap())
}

/// Returns a sensor that was tared in this orientation, with this knowledge of gravity.
fn tared(down: [f64; 3], known: Down) -> TaredSensor {
    let mut sensor = TaredSensor::of_model(models::anywhere(1)).unwrap();
    sensor.forget_tare();
    sensor.set_down(known);
    sensor.tare(FRAMES, at_rest(&held(down))).unwrap().unwrap();
    sensor
}

/// The results of presses.
#[derive(Debug, Default)]
struct Pressed {
    right: usize,
    refused: usize,
    wrong: Vec<String>,
    /// Root mean square errors: of the direction, degrees, of |F|, mN, and of the place, mm.
    off: [f64; 3],
    /// Forces with one of the three errors above three standard uncertainties.
    beyond: usize,
}

fn press(sensor: &mut TaredSensor, scene: &Scene) -> Pressed {
    let mut random = Random::new(5);
    let mut all = Pressed::default();
    let mut count = 0.0;
    for number in 0..PRESSED as u64 {
        let load = PRESSES.draw(&mut random).unwrap();
        let frame = scene.render_load(&load, number).unwrap();
        let seen = sensor.sense(&frame);
        match Judged::of(&seen, &frame.truth) {
            Judged::Right => all.right += 1,
            Judged::Refused(_) => all.refused += 1,
            Judged::Wrong(how) => all.wrong.push(how),
        }
        let Some(force) = &seen.force else { continue };
        count += 1.0;
        let errors = errors(force, &frame.truth);
        let sigmas = [
            f64::from(force.direction_sigma.0) * 1e-3,
            f64::from(force.magnitude_sigma.0) * 1e-3,
            force
                .place
                .map_or(0.0, |place| f64::from(place.sigma.0) * 1e-3),
        ];
        let is_within = errors
            .iter()
            .zip(sigmas)
            .all(|(error, sigma)| *error <= 3.0 * sigma);
        all.beyond += usize::from(!is_within);
        for (sum, error) in all.off.iter_mut().zip(errors) {
            *sum += error * error;
        }
    }
    all.off = all.off.map(|sum| (sum / count).sqrt());
    all
}

/// Presses the sensor turned over, and in every other orientation.
fn turned_every_way(sensor: &mut TaredSensor, known: impl Fn([f64; 3]) -> Down) -> Vec<Pressed> {
    let ways = [TOWARDS, AWAY].into_iter().chain(BETWEEN);
    let turned = ways.map(|way| {
        sensor.set_down(known(way));
        let pressed = press(sensor, &held(way));
        println!("{way:?}: {pressed:?}");
        pressed
    });
    turned.collect()
}

/// Measures the untouched film of a sensor in an orientation.
fn untouched(sensor: &mut TaredSensor, way: [f64; 3]) -> Measurement {
    sensor.sense(&held(way).render_load(&Load::REST, 1).unwrap())
}

#[test]
fn a_sensor_that_is_reported_how_it_is_held_measures_as_one_that_stays() {
    // For the default model a film that hangs belongs to another unit; one that does not is its
    // own.
    for (before, most) in [(TOWARDS, [0.7, 1.0, 0.035]), (ALONG, [0.5, 0.2, 0.015])] {
        let mut sensor = tared(before, down_of(before));
        let stays = press(&mut sensor, &held(before));
        println!("stays: {stays:?}");
        for turned in turned_every_way(&mut sensor, down_of) {
            assert_eq!(turned.wrong, Vec::<String>::new());
            assert!(turned.refused <= 3 && turned.beyond <= 4, "{turned:?}");
            for (off, most) in turned.off.iter().zip(most) {
                assert!(*off < most, "{turned:?}");
            }
            if before == TOWARDS {
                let alike = turned.off.iter().zip(stays.off);
                assert!(alike.into_iter().all(|(off, stays)| *off < 1.5 * stays));
            }
        }
    }
}

#[test]
fn an_untouched_film_that_is_turned_reads_no_contact_and_can_be_tared() {
    let mut sensor = tared(TOWARDS, down_of(TOWARDS));
    for way in [AWAY, ALONG].into_iter().chain(BETWEEN) {
        sensor.set_down(down_of(way));
        let seen = untouched(&mut sensor, way);
        assert!(!seen.status.contains(Status::CONTACT), "{way:?}: {seen:?}");
        assert!(seen.force.unwrap().magnitude.0 < 1_000, "{way:?}: {seen:?}");
        sensor.tare(FRAMES, at_rest(&held(way))).unwrap().unwrap();
    }
    // The host did not report that the sensor was turned: the film looks touched.
    sensor.set_down(down_of(AWAY));
    sensor.tare(FRAMES, at_rest(&held(AWAY))).unwrap().unwrap();
    let refused = sensor.tare(FRAMES, at_rest(&held(TOWARDS))).unwrap();
    assert!(matches!(refused, Err(Refusal::Touched(_))));
}

/// Unreported turns are within the standard uncertainties, without a penalty for a sensor that
/// stays.
#[test]
fn a_sensor_that_may_be_turned_says_how_little_it_knows() {
    let mut sensor = tared(ALONG, Down::Fixed);
    let fixed = press(&mut sensor, &held(ALONG));
    assert_eq!(fixed.wrong, Vec::<String>::new());
    for turned in turned_every_way(&mut sensor, |_| Down::Fixed) {
        assert!(turned.beyond + turned.refused > PRESSED / 2, "{turned:?}");
    }
    let mut sensor = tared(ALONG, Down::Unknown);
    for turned in turned_every_way(&mut sensor, |_| Down::Unknown) {
        assert!(turned.wrong.len() <= 2, "{turned:?}");
        assert!(turned.beyond <= 4 && turned.refused <= 3, "{turned:?}");
    }
    for way in [TOWARDS, AWAY] {
        let seen = untouched(&mut sensor, way);
        let is_known = |status: Status| !status.contains(Status::WEIGHT_UNKNOWN);
        assert!(
            !is_known(seen.status) && !seen.status.contains(Status::CONTACT),
            "{seen:?}"
        );
    }
}

/// The orientation at the tare is unknown. Later knowledge of the orientation has no effect until a
/// new tare is taken.
#[test]
fn a_tare_that_is_older_than_what_is_reported_counts_as_any_way() {
    let mut sensor = tared(TOWARDS, Down::Fixed);
    sensor.set_down(down_of(AWAY));
    assert!(
        untouched(&mut sensor, AWAY)
            .status
            .contains(Status::WEIGHT_UNKNOWN)
    );
    sensor.forget_tare();
    sensor.tare(FRAMES, at_rest(&held(AWAY))).unwrap().unwrap();
    let seen = untouched(&mut sensor, AWAY).status;
    assert!(!seen.intersects(Status::WEIGHT_UNKNOWN | Status::CONTACT));
}
