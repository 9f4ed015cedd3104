//! Tests of the forward model, by the committed model: it finds the contact that explains the
//! markers' motion, refuses markers that no contact explains, and survives any input.

use hivtac_sensor::force::forward::{Covariance, Forward, Markers, Pose, STEPS_AT_MOST};
use hivtac_sensor::force::model::encode::FORWARD_OFFSET;
use hivtac_sensor::force::model::{Model, ModelError};
use hivtac_sensor::force::network::Output;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::force::{Force, FrameNoise, Resting};
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;
use hivtac_tests::models;
use hivtac_tests::pictures::Random;

/// Returns the markers that an exact camera sees under a contact.
fn seen(forward: &Forward<'_>, rest: &Rest, pose: &Pose) -> [Marker; 4] {
    let beside = Markers::default();
    let moved = forward.tables.predict(pose, &forward.limits, &beside).moved;
    let focal_px = 175.0;
    std::array::from_fn(|k| {
        let (x, y) = rest.features.centroids[k];
        let off = forward.noise.rest_px[k];
        let at = |rest: Px, i: usize| {
            let px = f64::from(focal_px * moved[2 * k + i] - off[i]);
            Px(rest.0 + (65_536.0 * px) as i32)
        };
        let area = rest.areas[k];
        Marker {
            x: at(x, 0),
            y: at(y, 1),
            area,
        }
    })
}

fn answer(model: &Model<'_>, markers: &[Marker; 4], guess: [i32; 5]) -> (Force, Status) {
    let [x, y, z, place @ ..] = guess;
    let output = Output {
        values: [x, y, z],
        place,
        input_saturated: false,
    };
    let resting = Resting::of_model(model, &model.rest).unwrap();
    let forward = model.forward.as_ref().unwrap();
    resting.force(forward, &model.range, markers, &output)
}

/// The guesses have errors of a millimetre and a fifth of the force, or are in the middle of the
/// film.
#[test]
fn the_contact_is_found_from_bad_guesses() {
    let file = models::anywhere(1);
    let model = Model::parse(&file).unwrap();
    let forward = model.forward.as_ref().unwrap();
    let mut random = Random::new(3);
    let mut between = |low: i64, high: i64| random.between(low, high) as f32;
    for _ in 0..300 {
        let pose = Pose {
            size: between(200, 600) * 1e-3,
            tilt: [between(-250, 250) * 1e-3, between(-250, 250) * 1e-3],
            place_mm: [between(-3_900, 3_900) * 1e-3, between(-3_900, 3_900) * 1e-3],
            width: 0.0,
        };
        let markers = seen(forward, &model.rest, &pose);
        let force_n = forward.stiffness.magnitude_n(pose.size);
        let [px, py] = pose.place_mm.map(|part| (1e3 * part) as i32);
        let near = [0, 0, (-1.2e6 * force_n) as i32, px + 700, py - 700];
        let middle = [0, 0, (-0.8e6 * force_n) as i32, 0, 0];
        for guess in [near, middle] {
            let (force, status) = answer(&model, &markers, guess);
            assert!(!status.contains(Status::UNEXPLAINED), "{pose:?} {status:?}");
            let off_n = f64::from(force.magnitude.0) * 1e-6 - f64::from(force_n);
            assert!(
                off_n.abs() < 2e-3 * f64::from(force_n) + 2e-5,
                "{pose:?} {off_n}"
            );
            let place = force.place.unwrap();
            let far = f64::from(place.x.0 - px).hypot(f64::from(place.y.0 - py));
            assert!(far < 15.0, "{pose:?} {far} µm");
            let sigma = force.direction_sigma.0;
            assert!((1..3_000).contains(&sigma), "{pose:?} {sigma} m°");
        }
    }
}

/// Contacts are as steep as the tables allow, on markers with small errors. If noise makes a
/// contact even steeper, it is found on the tables' border.
#[test]
fn the_steepest_contacts_are_found() {
    let file = models::anywhere(1);
    let model = Model::parse(&file).unwrap();
    let forward = model.forward.as_ref().unwrap();
    let mut random = Random::new(5);
    for number in 0..500 {
        let mut between = |low: i64, high: i64| random.between(low, high) as f32;
        let (sin, cos) = (between(0, 6_283) * 1e-3).sin_cos();
        let steep = forward.limits.tilt * between(980, 1_000) * 1e-3;
        let pose = Pose {
            size: between(150, 500) * 1e-3,
            tilt: [steep * cos, steep * sin],
            place_mm: [between(-3_900, 3_900) * 1e-3, between(-3_900, 3_900) * 1e-3],
            width: 0.0,
        };
        let mut markers = seen(forward, &model.rest, &pose);
        for marker in &mut markers {
            // Errors up to 0.012 px.
            marker.x.0 += random.between(-800, 800) as i32;
            marker.y.0 += random.between(-800, 800) as i32;
        }
        let normal = -1e6 * forward.stiffness.magnitude_n(pose.size);
        let (force, status) = answer(&model, &markers, [0, 0, normal as i32, 0, 0]);
        assert!(
            !status.contains(Status::UNEXPLAINED),
            "{number}: {pose:?} {force:?}"
        );
    }
}

/// A right guess takes the model's number of steps, a bad one more. If no contact explains the
/// markers, the largest number of steps is taken, also from the film's middle.
#[test]
fn a_bad_guess_takes_more_steps() {
    let pose = Pose {
        size: 0.45,
        tilt: [0.05, -0.1],
        place_mm: [1.5, -2.0],
        width: 0.0,
    };
    for steps in 1..=3 {
        let file = models::anywhere(steps);
        let model = Model::parse(&file).unwrap();
        let forward = model.forward.as_ref().unwrap();
        let resting = Resting::of_model(&model, &model.rest).unwrap();
        let mut markers = seen(forward, &model.rest, &pose);
        let looks = |markers: &[Marker; 4], place: [i32; 2]| {
            let force_n = forward.stiffness.magnitude_n(pose.size);
            let parts = pose.direction().map(|part| (1e6 * force_n * part) as i32);
            let output = Output {
                values: parts,
                place,
                input_saturated: false,
            };
            resting
                .estimate(forward, markers, FrameNoise::AS_MODELLED, &output)
                .looks
        };
        assert_eq!(looks(&markers, [1_500, -2_000]), 1 + steps);
        assert!((3..=7).contains(&looks(&markers, [0, 0])));
        markers[0].x.0 += 32_768;
        let most = 2 * (1 + STEPS_AT_MOST);
        assert!((2 * (1 + steps)..=most).contains(&looks(&markers, [1_500, -2_000])));
    }
}

/// One marker half a pixel off cannot be a contact. Half of that under the tip can be one, and its
/// uncertainty is stated.
#[test]
fn a_marker_that_is_off_is_refused() {
    let file = models::anywhere(1);
    let model = Model::parse(&file).unwrap();
    let forward = model.forward.as_ref().unwrap();
    let mut refused = 0;
    for marker in 0..4 {
        for place_mm in [[0.0, 0.0], [1.5, -1.0], [-2.0, 0.5]] {
            let pose = Pose {
                size: 0.45,
                tilt: [0.05, -0.1],
                place_mm,
                width: 0.0,
            };
            let mut markers = seen(forward, &model.rest, &pose);
            markers[marker].x.0 += 32_768;
            let (_, status) = answer(&model, &markers, [0, 0, -90_000, 0, 0]);
            refused += u32::from(status.contains(Status::UNEXPLAINED));
        }
    }
    assert_eq!(refused, 12);
}

/// Markers and guesses are anywhere: there is no panic, and no number beyond its range.
#[test]
fn anything_is_survived() {
    let file = models::anywhere(3);
    let model = Model::parse(&file).unwrap();
    let mut random = Random::new(7);
    for round in 0..3_000 {
        let farthest = 1_i64 << (round % 32);
        let mut any = |farthest: i64| {
            let value = random.between(-farthest, farthest);
            value.clamp(i32::MIN.into(), i32::MAX.into()) as i32
        };
        let markers = std::array::from_fn(|_| Marker {
            x: Px(any(farthest)),
            y: Px(any(farthest)),
            area: any(1_000).unsigned_abs(),
        });
        let guess = [(); 5].map(|()| any(farthest));
        let (force, _) = answer(&model, &markers, guess);
        let place = force.place.unwrap();
        assert!(
            force.magnitude.0 <= 260_000 && force.cartesian[2].0 <= 0,
            "{force:?}"
        );
        assert!(
            place.x.0.abs() <= 5_000 && place.y.0.abs() <= 5_000,
            "{force:?}"
        );
        assert!(
            (1..=180_000).contains(&force.direction_sigma.0),
            "{force:?}"
        );
        assert!(
            force.magnitude_sigma.0 >= 1 && place.sigma.0 >= 1,
            "{force:?}"
        );
    }
}

/// A section that is cut or damaged anywhere is refused or read, and one that is read can be used.
#[test]
fn damaged_sections_do_no_harm() {
    let file = models::anywhere(1);
    let section = &file[FORWARD_OFFSET..file.len() - 4];
    assert!(Forward::parse(section).is_ok());
    // The layers follow the section.
    let whole = (0..section.len()).find(|length| Forward::parse(&section[..*length]).is_ok());
    assert!(whole.is_some_and(|whole| whole > 40_000), "{whole:?}");
    let mut random = Random::new(11);
    let mut read = 0;
    for _ in 0..4_000 {
        let mut damaged = section.to_vec();
        // Half of the damage is outside of a table's steps and of the covariance.
        let at = match random.next() % 4 {
            0 => random.next() as usize % 148,
            1 => 148 + random.next() as usize % 5_000,
            _ => random.next() as usize % damaged.len(),
        };
        damaged[at] ^= 1 << (random.next() % 8);
        match Forward::parse(&damaged) {
            Ok(forward) => {
                read += 1;
                let pose = Pose {
                    size: 0.3,
                    tilt: [0.2, 0.1],
                    place_mm: [4.0, -4.0],
                    width: 0.0,
                };
                let beside = Markers::filled(forward.tables.dots(), [0.2, -0.1]);
                let moved = forward.tables.predict(&pose, &forward.limits, &beside);
                assert!(moved.moved.iter().all(|part| part.is_finite()));
                for is_own in [true, false] {
                    let unknown = forward.unknown(is_own);
                    let mut covariance = Covariance::EMPTY;
                    unknown.put(&pose, &forward.limits, &moved.moved, &mut covariance);
                    assert!(covariance.rows().all(|row| row.last() >= Some(&0.0)));
                }
            }
            Err(ModelError::Field { .. } | ModelError::TooShort { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert!(read > 1_000);
}

/// A section states the number of its markers, and which parts it has.
#[test]
fn a_section_of_other_markers_is_refused() {
    let file = models::anywhere(1);
    let section = &file[FORWARD_OFFSET..file.len() - 4];
    for (at, value, name) in [(2, 3, "markers"), (2, 17, "markers"), (3, 8, "parts")] {
        let mut changed = section.to_vec();
        changed[at] = value;
        let refused = Forward::parse(&changed).err();
        let Some(ModelError::Field {
            name: of, offset, ..
        }) = refused
        else {
            panic!("{refused:?}");
        };
        assert_eq!((of, offset), (name, at));
    }
}
