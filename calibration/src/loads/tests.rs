use crate::data::conditions::Conditions;
use crate::data::dataset::{About, Free, Loads, Place, Recipe, Row, generate};
use crate::data::range::Range;
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;

use hivtac_sensor::force::features::FEATURES;

use super::*;
use crate::quantize::export;
use crate::weights::Weights;

const CERTAINTY: Certainty = Certainty {
    gauge_n: 0.001,
    place_mm: 0.2,
    frame_px: 0.03,
};

/// A film given by a formula: markers spread with the force, and shift with the place.
fn seen(force_n: f64, [x, y]: [f64; 2], off_px: f64) -> Observation {
    let mut features_px = [0.0; FEATURES];
    for (k, [right, down]) in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .into_iter()
        .enumerate()
    {
        let apart = 44.0 + 40.0 * force_n.sqrt();
        features_px[2 * k] = 160.0 + right * apart + 2.0 * x + off_px;
        features_px[2 * k + 1] = 120.0 + down * apart + 2.0 * y + off_px;
    }
    Observation {
        features_q16: features_px
            .map(|px| Q::from_bits((px * 65_536.0).round() as i64))
            .into(),
        areas_px: [190; 4].into(),
    }
}

/// The place of a press by that formula, mm.
fn place_mm(seen: &Observation) -> [f64; 2] {
    let px = seen.places_px();
    [(0, 160.0), (1, 120.0)].map(|(axis, middle)| {
        let mean = px.iter().map(|at| at[axis]).sum::<f64>() / 4.0;
        (mean - middle) / 2.0
    })
}

fn row(session: usize, force_n: f64, tip_mm: Option<[f64; 2]>, seen: Observation) -> Row {
    Row {
        place: Place {
            session,
            pose: None,
        },
        force_n: [0.0, 0.0, -force_n],
        tip_mm,
        clock_n: None,
        seen: Ok(seen),
    }
}

fn dataset(rows: Vec<Row>, free: Option<Free>, sessions: usize) -> Dataset {
    let about = About {
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
        scene: "a formula".to_owned(),
        loads: Loads::Measured(1),
        rest: 1,
        sessions,
        seed: 0,
        range: Range::default(),
        free,
        down: None,
    };
    Dataset { about, rows }
}

/// A hand that moves over the film for this many frames, holds sometimes, and is fast in between.
/// Fast frames have a larger clock uncertainty, N.
fn hand(frames: usize) -> Vec<Row> {
    let mut rows = vec![row(0, 0.0, None, seen(0.0, [0.0; 2], 0.0))];
    for i in 0..frames {
        let (touch, part) = (i / 100, (i % 100) as f64 / 100.0);
        let spread = |by: f64| 2.0 * (touch as f64 * by).fract() - 1.0;
        let at = [spread(0.618_03), spread(0.754_88)].map(|part| 3.9 * part);
        let most_n = 0.125 + 0.11 * spread(0.324_7);
        let rise = (part / 0.3).min((1.0 - part) / 0.3).min(1.0);
        let force_n = most_n * rise;
        let is_held = rise == 1.0;
        rows.push(Row {
            clock_n: Some(if is_held { 0.0 } else { 0.002 }),
            ..row(0, force_n, None, seen(force_n, at, 0.0))
        });
    }
    rows.retain(|row| row.force_n[2] <= 0.0);
    rows
}

const FREE: Option<Free> = Some(Free { direction_deg: 3.0 });

#[test]
fn rows_of_one_force_and_place_are_frames_of_one_load() {
    let mut rows = vec![row(0, 0.0, None, seen(0.0, [0.0; 2], 0.0))];
    for number in 0..4 {
        let at = [f64::from(number), 0.0];
        for off_px in [0.02, -0.02] {
            rows.push(row(0, 0.1, Some(at), seen(0.1, at, off_px)));
        }
    }
    // A second session, in which the camera was shifted by a pixel.
    rows.push(row(1, 0.0, None, seen(0.0, [0.0; 2], 1.0)));
    rows.push(row(1, 0.1, Some([3.0, 0.0]), seen(0.1, [3.0, 0.0], 1.0)));
    let mut dataset = dataset(rows, None, 2);
    dataset.about.range.place_mm = 3.0;
    let loads = loads_of(&dataset, &CERTAINTY, |_| panic!("places are known")).unwrap();
    let frames: Vec<usize> = loads.iter().map(|load| load.frames).collect();
    assert_eq!(frames, [2, 2, 2, 3]);
    for (number, load) in loads.iter().enumerate() {
        let expected = seen(0.1, [number as f64, 0.0], 0.0).places_px();
        let off = expected
            .as_flattened()
            .iter()
            .zip(load.seen_px.as_flattened());
        assert!(
            off.into_iter().all(|(a, b)| (a - b).abs() < 1e-4),
            "{load:?}"
        );
        assert_eq!((load.each_place_mm, load.direction_rad), (0.2, 0.0));
        assert_eq!(load.size_n, 0.001);
        assert!(load.noise_px > 0.008 && load.noise_px < 0.03);
    }
}

#[test]
fn places_that_nobody_noted_are_the_middle_where_nobody_pressed_anywhere() {
    let rows = (0..5).map(|i| {
        let force_n = 0.05 * f64::from(i);
        row(0, force_n, None, seen(force_n, [0.0; 2], 0.0))
    });
    let dataset = dataset(rows.collect(), None, 1);
    let loads = loads_of(&dataset, &CERTAINTY, place_mm).unwrap();
    assert_eq!(loads.len(), 4);
    assert!(
        loads
            .iter()
            .all(|load| load.place_mm == [0.0; 2] && load.each_place_mm == 0.2)
    );
}

#[test]
fn presses_anywhere_are_loads_of_unknown_places_beside_known_ones() {
    let mut rows = hand(30_000);
    rows.push(row(0, 0.1, Some([0.0; 2]), seen(0.1, [0.0; 2], 0.0)));
    let dataset = dataset(rows, FREE, 1);
    let loads = loads_of(&dataset, &CERTAINTY, place_mm).unwrap();
    assert_eq!(loads.len(), MOST_FREE + 1);
    let known: Vec<&SeenLoad> = loads
        .iter()
        .filter(|load| load.direction_rad == 0.0)
        .collect();
    assert!(known.len() == 1 && known[0].each_place_mm == 0.2);
    for load in loads.iter().filter(|load| load.direction_rad > 0.0) {
        assert!((load.direction_rad - 3_f64.to_radians()).abs() < 1e-12);
        assert_eq!(load.each_place_mm, f64::INFINITY);
        let there = seen(load.magnitude_n(), load.place_mm, 0.0).places_px();
        let off = there.as_flattened().iter().zip(load.seen_px.as_flattened());
        assert!(
            off.into_iter().all(|(a, b)| (a - b).abs() < 0.05),
            "{load:?}"
        );
    }
}

/// Held presses are preferred, fast ones taken only where there are no others; places and sizes are
/// spread.
#[test]
fn steady_frames_are_chosen_from_everywhere() {
    let dataset = dataset(hand(30_000), FREE, 1);
    let rows: Vec<Sample<'_>> = dataset.samples().filter(|s| s.force_n[2] < 0.0).collect();
    let chosen = representative(&rows, 120, place_mm);
    assert_eq!(chosen.len(), 120);
    let held = chosen
        .iter()
        .filter(|load| load.frames == 8 && load.clock_n < 1e-6);
    assert!(held.count() > 100, "{chosen:?}");
    let corner = |load: &&LoadFrames| load.place_mm[0] > 2.0 && load.place_mm[1] < -2.0;
    assert!(chosen.iter().filter(corner).count() >= 4);
    let strong = chosen.iter().filter(|load| load.force_n[2] < -0.19);
    assert!(strong.count() >= 15);
    let weak = chosen.iter().filter(|load| load.force_n[2] > -0.04);
    assert!(weak.count() >= 15);
    assert_eq!(representative(&rows, 7, place_mm).len(), 7);
    assert!(representative(&[], 120, place_mm).is_empty());
    assert_eq!(
        representative(&rows, 120, place_mm),
        chosen,
        "the same each time"
    );
}

/// If the gauge changes fast and clocks are known to some milliseconds, the force is less certain.
#[test]
fn what_clocks_leave_is_part_of_a_loads_uncertainty() {
    let mut dataset = dataset(hand(3_000), FREE, 1);
    for row in &mut dataset.rows {
        row.clock_n = Some(0.003);
    }
    let loads = loads_of(&dataset, &CERTAINTY, place_mm).unwrap();
    for load in &loads {
        assert!(load.size_n >= 0.001_f64.hypot(0.003) - 1e-12, "{load:?}");
    }
    for row in &mut dataset.rows {
        row.clock_n = None;
    }
    let unknown = loads_of(&dataset, &CERTAINTY, place_mm).unwrap();
    assert!(
        unknown
            .iter()
            .all(|load| load.size_n >= 0.05 * load.magnitude_n())
    );
}

/// The default model estimates the place of a press on an unknown unit whose picture is shifted.
#[test]
fn a_model_of_no_unit_tells_rough_places() {
    let recipe = Recipe {
        loads: Loads::Random(30),
        rest: 2,
        ..Recipe::default()
    };
    let mut dataset = generate(&recipe, || ()).unwrap();
    let all_seen = dataset
        .rows
        .iter_mut()
        .filter_map(|row| row.seen.as_mut().ok());
    for seen in all_seen {
        for x in seen.features_q16.iter_mut().take(8).step_by(2) {
            *x += Q::from_bits(3 << 16);
        }
        seen.features_q16[8] += Q::from_bits(3 << 16);
    }
    let weights = Weights::parse(include_str!("../../models/default.weights")).unwrap();
    let model = export(&weights).unwrap();
    let rough = Rough::new(&model, &dataset.rest().unwrap()).unwrap();
    let strong = |sample: &Sample<'_>| norm(sample.force_n) > 0.03;
    let mut seen = 0;
    for sample in dataset.samples().filter(strong) {
        let [x, y] = rough.place_mm(sample.seen);
        let [true_x, true_y] = sample.tip_mm.unwrap();
        let off_mm = (x - true_x).hypot(y - true_y);
        assert!(off_mm < 0.5, "{off_mm} mm: {sample:?}");
        seen += 1;
    }
    assert!(seen > 15, "{seen}");
    let certainty = Certainty::of(&weights, 0.001, 0.0);
    assert!(
        certainty.frame_px > 0.0 && certainty.frame_px < 0.1,
        "{certainty:?}"
    );
}
