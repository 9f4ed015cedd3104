//! Which configuration is best under a user's limits.

use anyhow::{Context, Result, bail};

use super::Configuration;

/// Errors count as equal within this part of themselves: training again changes them as much.
const EQUAL: f64 = 0.05;

/// A user's limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Longest time of a frame, µs at 480 MHz, modelled.
    pub budget_us: Option<f64>,
    /// Least frames a second that the core can do, modelled.
    pub min_rate: Option<f64>,
    /// Largest mean direction error from 50 mN up, degrees, simulated: the upper end of its
    /// interval.
    pub max_error_deg: Option<f64>,
}

/// The best configuration within the limits that the firmware does as it is.
///
/// With a limit on the error, the fastest. Otherwise the most accurate: of those whose direction
/// error from 50 mN up, error of |F| and error of the place are within a twentieth of the least of
/// each, and time within a twentieth of the fastest's, the one that refuses least.
pub(super) fn best<'c>(
    configurations: &'c [Configuration],
    limits: &Limits,
) -> Result<&'c Configuration> {
    let reachable: Vec<&Configuration> = configurations
        .iter()
        .filter(|c| c.reach == "firmware")
        .collect();
    let fitting: Vec<_> = reachable
        .iter()
        .copied()
        .filter(|c| limits.hold(c))
        .collect();
    if fitting.is_empty() {
        bail!(
            "nothing that the firmware does is within these limits; {}",
            nearest(&reachable).unwrap_or_default()
        );
    }
    let fastest = |among: &[&'c Configuration]| among.iter().copied().min_by_key(|c| cycles(c));
    let best = match limits.max_error_deg {
        Some(_) => fastest(&fitting),
        None => refuses_least(&as_fast(&as_accurate(&fitting))),
    };
    best.context("no configuration has a cost")
}

/// The most accurate and their equals.
fn as_accurate<'c>(fitting: &[&'c Configuration]) -> Vec<&'c Configuration> {
    let equals = |among: &[&'c Configuration], of: fn(&Configuration) -> f64| {
        let least = among.iter().map(|c| of(c)).fold(f64::INFINITY, f64::min);
        let near = |c: &&&Configuration| of(c) <= least * (1.0 + EQUAL);
        among.iter().filter(near).copied().collect::<Vec<_>>()
    };
    let by_direction = equals(fitting, |c| c.strong_direction_deg);
    let by_force = equals(&by_direction, |c| c.force_rmse_mn);
    equals(&by_force, |c| c.place_rmse_um)
}

/// The fastest and their equals.
fn as_fast<'c>(fitting: &[&'c Configuration]) -> Vec<&'c Configuration> {
    let least = fitting.iter().map(|c| cycles(c)).min().unwrap_or(i64::MAX);
    let near = |c: &&&Configuration| cycles(c) as f64 <= least as f64 * (1.0 + EQUAL);
    fitting.iter().filter(near).copied().collect()
}

/// The one that refuses the fewest frames; of several the fastest.
fn refuses_least<'c>(fitting: &[&'c Configuration]) -> Option<&'c Configuration> {
    let by_both = |a: &&&'c Configuration, b: &&&'c Configuration| {
        (a.unexplained.total_cmp(&b.unexplained)).then(cycles(a).cmp(&cycles(b)))
    };
    fitting.iter().min_by(by_both).copied()
}

fn cycles(configuration: &Configuration) -> i64 {
    configuration.modelled_cycles.unwrap_or(i64::MAX)
}

/// What comes nearest to limits of time, and to one of the error.
fn nearest(reachable: &[&Configuration]) -> Option<String> {
    let fastest = reachable.iter().min_by_key(|c| cycles(c))?;
    let by_error = |c: &&&Configuration| (1e6 * c.limit_error_deg()) as u64;
    let accurate = reachable.iter().min_by_key(by_error)?;
    Some(format!(
        "the fastest, {fastest}, takes {:.0} µs ({:.0} frames a second); the most accurate, \
         {accurate}, is within {:.3}°",
        fastest.microseconds()?,
        fastest.rate()?,
        accurate.limit_error_deg()
    ))
}

impl Limits {
    /// Whether a configuration is within them.
    fn hold(&self, configuration: &Configuration) -> bool {
        let (Some(us), Some(rate)) = (configuration.microseconds(), configuration.rate()) else {
            return false;
        };
        self.budget_us.is_none_or(|most| us <= most)
            && self.min_rate.is_none_or(|least| rate >= least)
            && self
                .max_error_deg
                .is_none_or(|most| configuration.limit_error_deg() <= most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A configuration that takes so many cycles for so much error: direction (degrees) and |F|
    /// (mN).
    fn made(reach: &str, cycles: i64, [direction, force]: [f64; 2]) -> Configuration {
        Configuration {
            width: 320,
            height: 240,
            centroid: "weighted".to_owned(),
            network: "16-16".to_owned(),
            numbers: "int16".to_owned(),
            steps: 1,
            reach: reach.to_owned(),
            direction_deg: 3.0 * direction,
            strong_direction_deg: direction,
            strong_direction_deg_95: Some(0.1 * direction),
            force_rmse_mn: force,
            place_rmse_um: 10.0,
            unexplained: 0.001,
            modelled_cycles: Some(cycles),
            latency_microseconds: Some(10.0),
        }
    }

    /// Rough; good; as good; a little better; much better in |F|; then one without a firmware, and
    /// one without a camera.
    fn several() -> Vec<Configuration> {
        vec![
            made("firmware", 96_000, [0.5, 0.3]),
            made("firmware", 144_000, [0.20, 0.1]),
            made("firmware", 240_000, [0.20, 0.1]),
            made("firmware", 288_000, [0.195, 0.1]),
            made("firmware", 480_000, [0.198, 0.01]),
            made("camera", 960_000, [0.1, 0.01]),
            made("none", 1_440_000, [0.05, 0.01]),
        ]
    }

    #[test]
    fn the_best_is_picked_under_each_limit() {
        let picked = |budget_us, min_rate, max_error_deg| {
            let limits = Limits {
                budget_us,
                min_rate,
                max_error_deg,
            };
            cycles(best(&several(), &limits).unwrap())
        };
        assert_eq!(picked(None, None, None), 480_000);
        assert_eq!(picked(Some(600.0), None, None), 144_000);
        assert_eq!(picked(Some(299.0), None, None), 96_000);
        assert_eq!(picked(None, Some(2000.0), None), 144_000);
        // The upper end of the interval counts: 0.22°.
        assert_eq!(picked(None, None, Some(0.23)), 144_000);
        assert_eq!(picked(None, None, Some(0.216)), 288_000);
    }

    #[test]
    fn among_equals_as_fast_the_one_that_refuses_least_is_best() {
        let mut all = several();
        for (cycles, least) in [(510_000, 0.001), (500_000, 0.0005)] {
            let mut other = made("firmware", cycles, [0.198, 0.01]);
            other.unexplained = 0.0005;
            all.push(other);
            assert_eq!(best(&all, &Limits::default()).unwrap().unexplained, least);
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_what_comes_nearest() {
        let limits = Limits {
            budget_us: Some(100.0),
            max_error_deg: Some(0.1),
            ..Limits::default()
        };
        let error = best(&several(), &limits).unwrap_err().to_string();
        for words in ["200 µs", "is within 0.21"] {
            assert!(error.contains(words), "no `{words}` in: {error}");
        }
    }
}
