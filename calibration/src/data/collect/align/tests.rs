use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::gauge::Unit;
use super::super::series::Series;
use super::*;

/// A hand that presses repeatedly, differently each time: |F| in N.
fn hand(time_s: f64) -> f64 {
    let swing = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time_s + phase).sin();
    let force = 0.08 + 0.06 * swing(0.31, 0.3) + 0.04 * swing(0.173, 1.0) + 0.02 * swing(0.77, 2.0);
    force.max(0.0)
}

/// The markers' radius, px: it rises less and less with force.
fn radius(force_n: f64) -> f64 {
    30.0 * force_n.sqrt()
}

/// A gauge `lag_s` ahead and faster by `drift`, whose readings have noise.
fn gauge(of: impl Fn(f64) -> f64, span_s: f64, lag_s: f64, drift: f64, noise_n: f64) -> Series {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut series = Series::default();
    for i in 0..(span_s * 100.0) as usize {
        let time = i as f64 / 100.0 - 5.0 + lag_s;
        let middle = 0.5 * (span_s - 10.0);
        let sensor = middle + (time - lag_s - middle) / (1.0 + drift);
        let force = of(sensor) + noise_n * random.random_range(-1.7..1.7);
        series.push(i, Some(time), &format!("{force:.4}N"), Unit::NEWTON);
    }
    series
}

fn frames(of: impl Fn(f64) -> f64, span_s: f64) -> Vec<RadiusSample> {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    (0..(span_s * 39.0) as usize)
        .map(|i| {
            let time_s = i as f64 / 39.0;
            let noise = 0.03 * random.random_range(-1.7..1.7);
            RadiusSample {
                time_s,
                radius_px: radius(of(time_s)) + noise,
            }
        })
        .collect()
}

const WIDE: Search = Search {
    lags_s: [-40.0, 40.0],
    drift: true,
};

#[test]
fn a_lag_is_found_to_a_few_milliseconds() {
    for lag_s in [-37.123, 0.0, 3.456] {
        let series = gauge(hand, 70.0, lag_s, 0.0, 0.000_5);
        let found = align(&frames(hand, 60.0), series.joined(), WIDE).unwrap();
        assert!((found.lag_s - lag_s).abs() < 0.003, "{lag_s}: {found:?}");
        assert!(
            found.residual_n < 0.002 && found.correlation > 0.99,
            "{found:?}"
        );
        assert!(found.next_n > 5.0 * found.residual_n, "{found:?}");
    }
}

#[test]
fn a_clock_that_runs_faster_is_followed() {
    let span = 610.0;
    let series = gauge(hand, span, 12.3, 2e-4, 0.000_5);
    let found = align(&frames(hand, span - 10.0), series.joined(), WIDE).unwrap();
    assert!((found.drift - 2e-4).abs() < 2e-5, "{found:?}");
    for time in [0.0, 300.0, 600.0] {
        let true_time = 300.0 + (time - 300.0) * (1.0 + 2e-4) + 12.3;
        assert!(
            (found.gauge_time(time) - true_time).abs() < 0.006,
            "{found:?}"
        );
    }
}

/// The message of the refusal.
fn refused(frames: &[RadiusSample], series: &Series, search: Search) -> String {
    align(frames, series.joined(), search)
        .unwrap_err()
        .to_string()
}

#[test]
fn what_does_not_convince_is_refused() {
    let rhythm = |time_s: f64| 0.1 + 0.08 * (std::f64::consts::TAU * 0.5 * time_s).sin();
    let steady = gauge(rhythm, 70.0, 0.0, 0.0, 0.000_5);
    let error = refused(&frames(rhythm, 60.0), &steady, WIDE);
    assert!(error.contains("more than one lag"), "{error}");

    let still = gauge(|_| 0.1, 70.0, 0.0, 0.0, 0.000_5);
    let error = refused(&frames(hand, 60.0), &still, WIDE);
    assert!(error.contains("hardly changes"), "{error}");

    let other = gauge(|t| hand(t * 1.7 + 400.0), 70.0, 0.0, 0.0, 0.000_5);
    let error = refused(&frames(hand, 60.0), &other, WIDE);
    assert!(error.contains("no lag fits"), "{error}");

    let narrow = Search {
        lags_s: [-2.0, 2.0],
        drift: false,
    };
    let late = gauge(hand, 70.0, 2.3, 0.0, 0.000_5);
    let error = refused(&frames(hand, 60.0), &late, narrow);
    assert!(
        error.contains("the last one that was tried") || error.contains("no lag fits"),
        "{error}"
    );

    let short = gauge(hand, 20.0, 0.0, 0.0, 0.000_5);
    let error = refused(&frames(hand, 60.0), &short, WIDE);
    assert!(error.contains("too few of the frames"), "{error}");
    let error = refused(&frames(hand, 0.3), &steady, WIDE);
    assert!(error.contains("11 frames"), "{error}");
}

#[test]
fn clocks_that_cannot_be_of_one_recording_are_refused() {
    let series = gauge(hand, 70.0, 0.0, 0.0, 0.000_5);
    for far in [1e7, 1e300, f64::INFINITY, f64::NAN] {
        let search = Search {
            lags_s: [-far, far],
            drift: true,
        };
        let error = refused(&frames(hand, 60.0), &series, search);
        assert!(error.contains("of the same recording?"), "{error}");
    }
}

#[test]
fn a_pull_is_no_press() {
    let pulled = gauge(|t| -hand(t), 70.0, 0.0, 0.0, 0.000_5);
    let error = refused(&frames(hand, 60.0), &pulled, WIDE);
    assert!(error.contains("no lag fits"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]
    #[test]
    fn any_lag_is_found(lag_s in -8.0..8.0_f64, noise_n in 0.0..0.002_f64) {
        let series = gauge(hand, 40.0, lag_s, 0.0, noise_n);
        let search = Search { lags_s: [-10.0, 10.0], drift: false };
        let found = align(&frames(hand, 30.0), series.joined(), search).unwrap();
        prop_assert!((found.lag_s - lag_s).abs() < 0.01, "{found:?}");
    }
}
