use hivtac_terms::geometry::Preset;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::Px;

use super::*;
use crate::data::collect::gauge::Unit;
use crate::data::conditions::Conditions;
use crate::data::dataset::Recipe;
use hivtac_twin::Load;

/// Weights that a person puts on and takes off by hand, and that person's file of them. It lists
/// when each weight certainly hung and certainly did not, in whole seconds of a watch that is 100 s
/// ahead.
const WEIGHTS_G: [f64; 4] = [5.0, 10.0, 15.0, 20.0];
/// When each is put on and taken off, s.
const TIMES_S: [[f64; 2]; 4] = [[6.4, 15.2], [20.7, 27.6], [32.3, 44.9], [49.5, 55.1]];
const G: f64 = 9.806_65e-3;
const HOLDS: How = How {
    unit: None,
    holds: true,
    direction_deg: DIRECTION_DEG,
};

fn force_n(time_s: f64) -> f64 {
    let hangs = |(times, grams): (&[f64; 2], &f64)| {
        // Half a second to put it on, and to take it off.
        let [on, off] = times.map(|t| ((time_s - t) / 0.5).clamp(0.0, 1.0));
        grams * G * (on - off)
    };
    TIMES_S.iter().zip(&WEIGHTS_G).map(hangs).sum()
}

fn markers(force_n: f64) -> [Marker; 4] {
    let reach = 44.0 + 40.0 * force_n.sqrt();
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| {
        let px = |px: f64| Px((px * 65_536.0) as i32);
        Marker {
            x: px(160.0 + x * reach),
            y: px(120.0 + y * reach),
            area: 190,
        }
    })
}

fn recording() -> Recording {
    let frame = |i: u32| {
        let time_s = f64::from(i) / 39.0;
        Kept {
            run: 0,
            host_s: time_s,
            device_us: (time_s * 1e6) as u64,
            pose: (time_s > 4.0).then_some(Pose {
                angles_deg: [8.0, 0.0],
                place_mm: Some([0.0; 2]),
            }),
            seen: Ok(markers(force_n(time_s)).into()),
        }
    };
    Recording {
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
        down: None,
        samples: (0..60 * 39).map(frame).collect(),
        gauge_lines: Vec::new(),
    }
}

fn notes(unit: &str) -> Series {
    let mut series = Series::default();
    let mut note = |time_s: f64, grams: f64| {
        let number = series.readings() + 1;
        let time_s = 100.0 + time_s;
        series.push(
            number,
            Some(time_s),
            &format!("{grams} {unit}"),
            Unit::NEWTON,
        );
    };
    note(0.0, 0.0);
    for ([on, off], grams) in TIMES_S.into_iter().zip(WEIGHTS_G) {
        note((on - 0.5).floor(), 0.0);
        note((on + 1.0).ceil(), grams);
        note((off - 0.5).floor(), grams);
        note((off + 1.0).ceil(), 0.0);
    }
    note(60.0, 0.0);
    series
}

/// The force that pressed when a row was seen, N.
fn pressed_n(row: &Row) -> f64 {
    let x_px = row.seen.as_ref().unwrap().features_px()[4];
    ((x_px - 204.0) / 40.0).powi(2)
}

/// Every frame that is kept has the force of the weight that hung then, to 0.1 mN.
#[test]
fn weights_and_a_watch_are_a_gauge() {
    let gauge = Gauge::Files(vec![notes("g")]);
    let (dataset, report) = assemble(&recording(), &gauge, HOLDS).unwrap();
    assert!(
        (report.runs[0].alignment.lag_s - 100.0).abs() < 0.5,
        "{report}"
    );
    let mut frames = [0; 4];
    for row in dataset.rows.iter().filter(|row| row.force_n != [0.0; 3]) {
        let force_n = norm(row.force_n);
        assert!((force_n - pressed_n(row)).abs() < 1e-4, "{row:?}");
        let weight = WEIGHTS_G
            .iter()
            .position(|g| (force_n - g * G).abs() < 1e-4);
        frames[weight.unwrap()] += 1;
    }
    assert!(frames.iter().all(|&count| count > 39), "{frames:?}");
}

/// A gauge that was mounted the other way round gives the same rows.
#[test]
fn a_gauge_that_shows_pressing_as_negative_is_turned_round() {
    let turned = Gauge::Files(vec![notes("g").turned_round()]);
    let (found, report) = assemble(&recording(), &turned, HOLDS).unwrap();
    assert!(
        report.to_string().contains("its sign was turned round"),
        "{report}"
    );
    let upright = Gauge::Files(vec![notes("g")]);
    let (expected, report) = assemble(&recording(), &upright, HOLDS).unwrap();
    assert!(!report.to_string().contains("turned round"), "{report}");
    assert_eq!(found.rows, expected.rows);
}

/// A clock that starts again in the middle of a run makes its times ambiguous.
#[test]
fn a_clock_that_starts_again_is_named() {
    let mut again = Series::after(31, 155.0);
    again.push(31, Some(0.0), "0 N", Unit::NEWTON);
    again.push(32, Some(1.0), "0 N", Unit::NEWTON);
    let gauge = Gauge::Files(vec![notes("g"), again]);
    let error = assemble(&recording(), &gauge, HOLDS)
        .unwrap_err()
        .to_string();
    assert!(error.contains("2 gauge files for 1 run(s)"), "{error}");
    assert!(error.contains("line 31 (after 155 s)"), "{error}");
}

/// Forces beyond a data set's limits never enter one.
#[test]
fn a_gauge_in_kilonewtons_has_no_readings() {
    let gauge = Gauge::Files(vec![notes("kN")]);
    let error = assemble(&recording(), &gauge, How::default()).unwrap_err();
    let error = format!("{error:#}");
    assert!(
        error.contains("readings for too few of the frames"),
        "{error}"
    );
}

/// A hand that presses anywhere: each touch lasts a second and a half at its own place and along
/// its own direction, with its own and never constant force.
fn touch(time_s: f64) -> Option<Load> {
    if time_s < 0.0 {
        return None;
    }
    let number = (time_s / 1.5).floor();
    let part = time_s / 1.5 - number;
    // Multiples of an irrational number, modulo 1, are spread evenly.
    let spread = |by: f64| 2.0 * (number * by).fract() - 1.0;
    let most_n = 0.11 + 0.1 * spread(0.324_7);
    let wobble = 1.0 + 0.15 * (9.0 * part + number).sin();
    let force_n = most_n * wobble * (std::f64::consts::PI * part).sin().powi(2);
    let place_mm = [spread(0.618_03), spread(0.754_88)].map(|part| 3.9 * part);
    let [alpha, beta] = [spread(0.445_04), spread(0.237_1)].map(|part| 5.0 * part);
    let load = Load::from_angles(force_n, alpha, beta).unwrap();
    (force_n > 0.001).then(|| load.with_offset_mm(place_mm).unwrap())
}

fn free_recording(seconds: u32) -> (Recording, Series) {
    let scene = Recipe::default().scene(0).unwrap();
    let markers_of = |load: &Load| {
        let truth = scene.truth_under(load).unwrap();
        truth.markers.array::<4>().map(|marker| {
            let [x, y] = marker.unwrap().centroid_px;
            let px = |px: f64| Px((px * 65_536.0) as i32);
            Marker {
                x: px(x),
                y: px(y),
                area: 190,
            }
        })
    };
    let frame = |i: u32| {
        let time_s = f64::from(i) / 39.0;
        let pressed = touch(time_s - 3.0);
        Kept {
            run: 0,
            host_s: time_s,
            device_us: (time_s * 1e6) as u64,
            pose: (time_s > 3.0).then_some(Pose::anywhere([0.0; 2])),
            seen: Ok(markers_of(&pressed.unwrap_or(Load::REST)).into()),
        }
    };
    let mut gauge = Series::default();
    for i in 0..seconds * 50 {
        let time_s = f64::from(i) / 50.0;
        let pressed = touch(time_s - 3.0);
        let force_n = pressed.map_or(0.0, |load| norm(load.vector_n()));
        let line = format!("{force_n:.4} N");
        gauge.push(i as usize + 1, Some(time_s - 41.0), &line, Unit::NEWTON);
    }
    let recording = Recording {
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
        down: None,
        samples: (0..seconds * 39).map(frame).collect(),
        gauge_lines: Vec::new(),
    };
    (recording, gauge)
}

/// Clocks are aligned wherever the tip is; rows have the force and the axis, but no place.
#[test]
fn presses_anywhere_are_rows_without_a_place() {
    let (recording, series) = free_recording(40);
    let gauge = Gauge::Files(vec![series]);
    let (dataset, report) = assemble(&recording, &gauge, HOLDS).unwrap();
    println!("{report}");
    let alignment = report.runs[0].alignment;
    assert!((alignment.lag_s + 41.0).abs() < 0.005, "{report}");
    assert!(alignment.lag_sigma_s < 0.01, "{alignment:?}");
    let free = dataset.about.free.unwrap();
    assert_eq!(free.direction_deg, DIRECTION_DEG);
    let rows: Vec<&Row> = dataset
        .rows
        .iter()
        .filter(|row| dataset.is_free(row))
        .collect();
    assert!(rows.len() > 1000, "{}", rows.len());
    for row in &rows {
        let [x, y, z] = row.force_n;
        assert!(x == 0.0 && y == 0.0 && z < 0.0, "{row:?}");
        assert!(row.clock_n.unwrap() < 0.005, "{row:?}");
    }
    let text = dataset.to_text().unwrap();
    let again = Dataset::parse(std::str::from_utf8(&text).unwrap()).unwrap();
    assert_eq!(again, dataset);
}

/// A recording with both kinds of loads keeps each row's own knowledge.
#[test]
fn loads_in_the_middle_stay_there_beside_presses_anywhere() {
    let mut both = recording();
    let (free, _) = free_recording(20);
    let later = free.samples.into_iter().map(|kept| Kept { run: 1, ..kept });
    both.samples.extend(later);
    let (_, series) = free_recording(20);
    let gauge = Gauge::Files(vec![notes("g"), series]);
    let (dataset, _) = assemble(&both, &gauge, HOLDS).unwrap();
    let pressed = |session: usize| {
        let of = move |row: &&Row| row.place.session == session && row.force_n != [0.0; 3];
        dataset.rows.iter().filter(of)
    };
    assert!(pressed(0).count() > 100 && pressed(1).count() > 100);
    assert!(pressed(0).all(|row| row.tip_mm == Some([0.0; 2]) && row.clock_n.is_none()));
    assert!(pressed(1).all(|row| row.tip_mm.is_none() && row.clock_n.is_some()));
    assert!(!dataset.knows_places());
}
