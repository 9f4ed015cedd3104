use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::Px;

use super::*;
use crate::collect::gauge::Unit;
use crate::conditions::Conditions;

/// Weights that somebody puts on and takes off by hand, and the file that they write of it: when
/// each surely hung and surely did not, in whole seconds of a watch that is 100 s ahead.
const WEIGHTS_G: [f64; 4] = [5.0, 10.0, 15.0, 20.0];
/// When each is put on and taken off, s.
const TIMES_S: [[f64; 2]; 4] = [[6.4, 15.2], [20.7, 27.6], [32.3, 44.9], [49.5, 55.1]];
const G: f64 = 9.806_65e-3;

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
                place_mm: [0.0; 2],
            }),
            seen: Ok(markers(force_n(time_s))),
        }
    };
    Recording {
        conditions: Conditions::simulated(Preset::Ov7725, 320, 240, PixelFormat::Rgb565),
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

/// Every frame that is kept has the force of the weight that hung on it, to 0.1 mN.
#[test]
fn weights_and_a_watch_are_a_gauge() {
    let gauge = Gauge::Files(vec![notes("g")]);
    let (dataset, report) = assemble(&recording(), &gauge, Unit::NEWTON, true).unwrap();
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

/// Forces that no data set could hold never get into one.
#[test]
fn a_gauge_in_kilonewtons_has_no_readings() {
    let gauge = Gauge::Files(vec![notes("kN")]);
    let error = assemble(&recording(), &gauge, Unit::NEWTON, false).unwrap_err();
    let error = format!("{error:#}");
    assert!(
        error.contains("readings for too few of the frames"),
        "{error}"
    );
}
