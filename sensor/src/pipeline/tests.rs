use super::*;
use crate::force::model::{Origin, encode::ModelSpec, samples::spec};
use crate::picture::{GREY, Pattern, Picture, RED, rest_of, sensor, tared};
use hivtac_terms::threshold::{HsvBox, Mono};
use hivtac_terms::units::{MicroNewtons, Px};
use proptest::prelude::*;
use std::{boxed::Box, vec, vec::Vec};

const GEOMETRY: Geometry = Geometry::preset(Preset::Ov7725, 320, 240);
/// µN per pixel in the linear model below.
const PER_PIXEL: i32 = 10_000;

/// A model whose Fx and Fy are the shift of the rectangle's centre, 10 mN a pixel, and Fz is
/// −100 mN.
fn linear() -> ModelSpec {
    let mut spec = spec(&[11, 3]);
    spec.conditions.geometry = GEOMETRY;
    spec.rest = rest_of(
        &Pattern::at_rest(GEOMETRY).draw(),
        &mut sensor(GEOMETRY, None),
    );
    spec.input.mean = spec.rest.features;
    // Inputs in 256ths of a pixel.
    spec.input.multipliers = [1 << 10; 11];
    spec.input.shifts = [18; 11];
    let layer = &mut spec.layers[0];
    layer.weights = vec![0; 33];
    layer.weights[8] = 64;
    layer.weights[11 + 9] = 64;
    layer.biases = vec![0, 0, -100_000];
    // 64 · 256 of a pixel become 10,000 µN; the bias stays.
    layer.multipliers = vec![5 * 125, 5 * 125, 1 << 10];
    layer.shifts = vec![10; 3];
    spec
}

fn with_model(edit: impl Fn(&mut ModelSpec), test: impl Fn(&mut Sensor<'_>)) {
    let mut spec = linear();
    edit(&mut spec);
    let bytes = spec.encode().unwrap();
    test(&mut sensor(GEOMETRY, Some(Model::parse(&bytes).unwrap())));
}

fn shifted(x: f64, y: f64) -> Picture {
    Pattern {
        shift: (x, y),
        ..Pattern::at_rest(GEOMETRY)
    }
    .draw()
}

#[test]
fn a_shift_of_whole_pixels_is_the_force_that_the_model_makes_of_it() {
    with_model(
        |_| {},
        |sensor| {
            for (x, y) in [(0, 0), (1, 0), (0, -1), (-1, 1)] {
                let seen = shifted(f64::from(x), f64::from(y)).feed(sensor);
                let force = seen.force.unwrap();
                let expected = [x * PER_PIXEL, y * PER_PIXEL, -100_000].map(MicroNewtons);
                assert_eq!((force.cartesian, force.place), (expected, None));
                let standing = Status::TARE_MISSING | Status::NOT_CALIBRATED | Status::CONTACT;
                assert_eq!(seen.status, standing, "({x}, {y})");
            }
        },
    );
}

#[test]
fn a_tare_takes_the_place_of_the_models_rest() {
    with_model(
        |_| {},
        |sensor| {
            let rest = rest_of(&shifted(3.0, -4.0), sensor);
            sensor.set_tare(Some(rest), Drift::NONE);
            let seen = shifted(4.0, -4.0).feed(sensor);
            assert_eq!(seen.status, Status::NOT_CALIBRATED | Status::CONTACT);
            let expected = [PER_PIXEL, 0, -100_000].map(MicroNewtons);
            assert_eq!(seen.force.unwrap().cartesian, expected);
            sensor.set_tare(None, Drift::NONE);
            assert!(
                shifted(0.0, 0.0)
                    .feed(sensor)
                    .status
                    .contains(Status::TARE_MISSING)
            );
        },
    );
}

#[test]
fn a_rest_position_has_its_markers_where_the_geometry_has_them() {
    let rest = *tared(GEOMETRY).tare().unwrap();
    let scaled = |percent: i32| {
        let mut scaled = rest;
        let (center_x, center_y) = GEOMETRY.center();
        for (x, y) in &mut scaled.features.centroids {
            *x = Px(center_x.0 + (x.0 - center_x.0) / 100 * percent);
            *y = Px(center_y.0 + (y.0 - center_y.0) / 100 * percent);
        }
        scaled.fits(&GEOMETRY)
    };
    assert!(rest.fits(&GEOMETRY) && scaled(87) && scaled(113));
    assert!(
        !scaled(83) && !scaled(117),
        "pressed, or another film distance"
    );
}

#[test]
fn a_tare_that_cannot_be_is_none() {
    let mut sensor = tared(GEOMETRY);
    let mut rest = *sensor.tare().unwrap();
    rest.features.centroids[2].0 = Px(-1);
    sensor.set_tare(Some(rest), Drift::NONE);
    assert_eq!(sensor.tare(), None);
}

/// The pattern tapered along x and sheared, px at each marker, as by a tip to which the film
/// sticks.
fn pulled(taper: f64, shear: f64) -> Pattern {
    let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    Pattern {
        displaced: signs.map(|(x, y)| (taper * x * y + shear * y, shear * x)),
        ..Pattern::at_rest(GEOMETRY)
    }
}

#[test]
fn the_models_contact_reading_says_what_the_markers_may_do() {
    let mut one_displaced = Pattern::at_rest(GEOMETRY);
    one_displaced.displaced[1] = (1.1, 0.0);
    for (contact, may_be_pulled) in [
        (ContactReading::Force, false),
        (ContactReading::Stick, true),
        (ContactReading::Slip, false),
    ] {
        with_model(
            |spec| spec.conditions.contact = contact,
            |sensor| {
                let rest = rest_of(&pulled(0.0, 0.0).draw(), sensor);
                sensor.set_tare(Some(rest), Drift::NONE);
                let mut is_refused = |pattern: &Pattern| {
                    let status = pattern.draw().feed(sensor).status;
                    status.contains(Status::MARKERS_IMPLAUSIBLE)
                };
                assert!(!is_refused(&pulled(2.0, 0.0)), "{contact:?}: tapered");
                assert_eq!(is_refused(&pulled(3.0, 0.7)), !may_be_pulled, "{contact:?}");
                assert!(is_refused(&pulled(0.0, 0.7)), "{contact:?}: sheared alone");
                assert!(is_refused(&one_displaced), "{contact:?}: one marker");
            },
        );
    }
}

#[test]
fn far_from_all_training_is_out_of_range() {
    with_model(
        |spec| spec.input.shifts = [11; 11],
        |sensor| {
            let seen = shifted(1.0, 0.0).feed(sensor);
            assert!(seen.status.contains(Status::MAGNITUDE_OUT_OF_RANGE));
            assert!(seen.force.is_some());
        },
    );
}

#[test]
fn a_calibrated_unit_is_not_called_uncalibrated() {
    with_model(
        |spec| spec.conditions.origin = Origin::Unit([7; 12]),
        |sensor| {
            let standing = Status::TARE_MISSING | Status::CONTACT;
            assert_eq!(shifted(0.0, 0.0).feed(sensor).status, standing);
        },
    );
}

/// At rest the force is all Fz; the second number is its uncertainty.
#[test]
fn a_contact_is_reported_from_two_millinewtons_on_when_they_are_certain() {
    for (press, sigma, expected) in [
        (100_000, 800, true),
        (2_000, 600, true),
        (1_999, 600, false),
        (2_399, 800, false),
        (2_400, 800, true),
        (0, 0, false),
    ] {
        with_model(
            |spec| {
                spec.layers[0].biases[2] = -press;
                let knots = &mut spec.uncertainty.knots;
                knots
                    .iter_mut()
                    .for_each(|knot| knot.along = MicroNewtons(sigma));
            },
            |sensor| {
                let seen = shifted(0.0, 0.0).feed(sensor);
                let reported = seen.status.contains(Status::CONTACT);
                assert_eq!(reported, expected, "{press} µN ± {sigma} µN: {seen:?}");
            },
        );
    }
}

#[test]
fn a_frame_without_a_force_tells_of_no_contact() {
    with_model(
        |spec| spec.conditions.dilations = 2,
        |sensor| {
            let seen = shifted(0.0, 0.0).feed(sensor);
            assert!(seen.force.is_none() && !seen.status.contains(Status::CONTACT));
        },
    );
}

#[test]
fn other_conditions_than_the_models_give_no_force() {
    type Edit = fn(&mut ModelSpec);
    let edits: [Edit; 7] = [
        |spec| spec.conditions.dilations = 2,
        |spec| {
            let value_low = HsvBox::RED.value_low + 1;
            spec.conditions.threshold = Threshold::Rgb565(HsvBox {
                value_low,
                ..HsvBox::RED
            });
        },
        |spec| spec.conditions.threshold = Threshold::red(PixelFormat::Yuv422),
        |spec| spec.conditions.threshold = Threshold::red(PixelFormat::Mono),
        |spec| spec.conditions.geometry.height = 239,
        |spec| spec.conditions.geometry.focal.0 += 1,
        |spec| spec.conditions.geometry.marker_diameter.0 += 1,
    ];
    for edit in edits {
        with_model(edit, |sensor| {
            let seen = shifted(0.0, 0.0).feed(sensor);
            assert!(seen.status.contains(Status::MODEL_MISMATCH));
            assert!(seen.force.is_none() && seen.features.is_some());
        });
    }
}

#[test]
fn a_new_threshold_mismatches_until_it_is_set_back() {
    with_model(
        |_| {},
        |sensor| {
            let usual = sensor.threshold();
            let darker = Threshold::Rgb565(HsvBox {
                value_low: 40,
                ..HsvBox::RED
            });
            sensor.set_threshold(darker).unwrap();
            assert_eq!(sensor.threshold(), darker);
            assert!(
                shifted(0.0, 0.0)
                    .feed(sensor)
                    .status
                    .contains(Status::MODEL_MISMATCH)
            );
            assert!(
                sensor
                    .set_threshold(Threshold::Rgb565(HsvBox {
                        hue_low: 180,
                        ..HsvBox::RED
                    }))
                    .is_err()
            );
            assert_eq!(
                sensor.threshold(),
                darker,
                "a refused threshold changes nothing"
            );
            sensor.set_threshold(usual).unwrap();
            assert!(shifted(0.0, 0.0).feed(sensor).force.is_some());
        },
    );
}

#[test]
fn without_a_model_there_are_markers_but_no_force() {
    let mut sensor = sensor(GEOMETRY, None);
    let seen = shifted(0.0, 0.0).feed(&mut sensor);
    assert_eq!(seen.status, Status::MODEL_MISSING | Status::TARE_MISSING);
    assert!(seen.markers.is_some() && seen.features.is_some() && seen.force.is_none());
    assert_eq!(sensor.blobs().len(), 4);
}

#[test]
fn a_sensor_that_was_not_configured_sees_nothing() {
    let mut sensor: Box<Sensor<'_>> = Box::default();
    let seen = shifted(0.0, 0.0).feed(&mut sensor);
    assert!(
        seen.status
            .contains(Status::IMAGE_DARK | Status::MODEL_MISSING)
    );
}

#[test]
fn wrong_settings_are_refused_and_change_nothing() {
    let mut sensor = tared(GEOMETRY);
    let (before, tare) = (*sensor.settings(), sensor.tare().copied());
    let wrong = [
        Settings {
            dilations: 4,
            ..before
        },
        Settings {
            threshold: Threshold::Rgb565(HsvBox {
                hue_low: 200,
                ..HsvBox::RED
            }),
            ..before
        },
        Settings {
            threshold: Threshold::Mono(Mono { low: 9, high: 8 }),
            ..before
        },
        Settings {
            threshold: Threshold::red(PixelFormat::Yuv422),
            geometry: Geometry {
                width: 319,
                ..GEOMETRY
            },
            ..before
        },
        Settings {
            geometry: Geometry {
                width: 0,
                ..GEOMETRY
            },
            ..before
        },
        Settings {
            geometry: Geometry {
                height: 801,
                ..GEOMETRY
            },
            ..before
        },
        Settings {
            geometry: Geometry {
                focal: Px(0),
                ..GEOMETRY
            },
            ..before
        },
    ];
    for settings in wrong {
        assert!(sensor.configure(settings, None).is_err(), "{settings:?}");
        assert_eq!((*sensor.settings(), sensor.tare().copied()), (before, tare));
    }
}

#[test]
fn frames_that_are_not_whole_give_no_force() {
    with_model(
        |_| {},
        |sensor| {
            let picture = shifted(0.0, 0.0);
            let rows: Vec<&[u16]> = picture.pixels.chunks(320).collect();
            let mut feed = |rows: &[&[u16]]| {
                sensor.begin_frame();
                rows.iter().for_each(|row| sensor.push_row(row));
                sensor.finish_frame()
            };
            let longer = [&rows[..], &rows[..1]].concat();
            let mut narrower = rows.clone();
            narrower[17] = &rows[17][..319];
            for frame in [&rows[..239], &rows[..0], &longer, &narrower] {
                let seen = feed(frame);
                assert!(seen.status.contains(Status::FRAME_INCOMPLETE));
                assert_eq!((seen.force, seen.markers), (None, None));
            }
            assert!(feed(&rows).force.is_some(), "the next whole frame is good");
        },
    );
}

#[test]
fn too_many_blobs_are_reported() {
    let mut picture = shifted(0.0, 0.0);
    for index in 0..80 {
        picture.disc(
            RED,
            (
                20.0 + 14.0 * f64::from(index % 20),
                20.0 + 60.0 * f64::from(index / 20),
            ),
            9.0,
        );
    }
    let seen = picture.feed(&mut tared(GEOMETRY));
    assert!(seen.status.contains(Status::BLOB_OVERFLOW));
    assert_eq!(seen.markers, None);
}

/// Grey, red, or random pixels as a camera may send them.
fn noisy(picture: &mut Picture, kind: u8, seed: u64) {
    let mut state = seed | 1;
    for pixel in &mut picture.pixels {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        match (kind, (state >> 56) as u8) {
            (0, 0..8) => *pixel = RED,
            (1, 0..8) => *pixel = GREY,
            (2, _) => *pixel = (state >> 40) as u16,
            _ => {}
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn there_is_a_force_exactly_when_no_bit_forbids_it(
        discs in prop::collection::vec((0.0..320.0f64, 0.0..240.0f64, 2.0..90.0f64), 0..4),
        kind in 0u8..8,
        missing in 0usize..8,
        seed: u64,
        rows in 235usize..245,
        tare: bool,
    ) {
        let mut picture = Picture::new(&GEOMETRY);
        for identity in (0..4).filter(|identity| *identity != missing) {
            Pattern::at_rest(GEOMETRY).draw_marker(&mut picture, identity);
        }
        discs.iter().for_each(|(x, y, d)| picture.disc(RED, (*x, *y), *d));
        noisy(&mut picture, kind, seed);
        std::thread_local!(static SPEC: ModelSpec = linear());
        let bytes = SPEC.with(|spec| spec.encode().unwrap());
        let mut sensor = sensor(GEOMETRY, Some(Model::parse(&bytes).unwrap()));
        if tare {
            sensor.set_tare(Some(SPEC.with(|spec| spec.rest)), Drift::NONE);
        }
        // Mostly whole frames.
        let rows = if rows == 239 { 239 } else { 240 };
        picture.pixels.truncate(rows * 320);
        let seen = picture.feed(&mut sensor);
        prop_assert_eq!(seen.force.is_none(), seen.status.intersects(Status::NO_FORCE));
        prop_assert_eq!(seen.features.is_some(), seen.markers.is_some());
        prop_assert_eq!(seen.status.contains(Status::TARE_MISSING), !tare);
        if let Some(force) = seen.force {
            prop_assert!(force.magnitude.0 >= 0);
        }
        let touches = |force: Force| force::is_contact(force.magnitude, force.magnitude_sigma);
        let touched = seen.force.is_some_and(touches);
        prop_assert_eq!(seen.status.contains(Status::CONTACT), touched);
    }
}
