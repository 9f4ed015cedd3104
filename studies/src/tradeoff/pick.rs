//! Picks the best configuration under a user's limits.

use anyhow::{Context, Result};
use clap::Args;

use super::Configuration;

/// Relative difference up to which errors count as equal: repeated training changes them as much.
const EQUAL: f64 = 0.05;

/// A user's limits.
#[derive(Args, Default)]
pub struct Limits {
    /// Pick the best that takes at most this time for a frame, µs, at 480 MHz, modelled.
    #[arg(long)]
    pub budget_us: Option<f64>,
    /// Pick the best that the core can do at least so often a second, modelled.
    #[arg(long)]
    pub min_rate: Option<f64>,
    /// Pick the fastest whose mean direction error from 50 mN up is at most this, simulated; the
    /// upper end of its interval counts.
    #[arg(long)]
    pub max_error_deg: Option<f64>,
}

/// The best configuration within the limits.
///
/// With a limit on the error, the fastest. Otherwise the most accurate: the error of the direction
/// from 50 mN up, of |F| and of the place must be within a twentieth of the least of each. Among
/// those within a twentieth of the fastest's time, the one that refuses least.
pub(super) fn best<'c>(all: &'c [Configuration], limits: &Limits) -> Result<&'c Configuration> {
    let fitting: Vec<_> = all.iter().filter(|c| limits.hold(c)).collect();
    let best = match limits.max_error_deg {
        Some(_) => fitting.into_iter().min_by_key(|c| c.modelled_cycles),
        None => {
            let left = equals(&fitting, |c| c.strong_direction_deg);
            let left = equals(&left, |c| c.force_rmse_mn);
            let left = equals(&left, |c| c.place_rmse_um);
            let left = equals(&left, |c| c.modelled_cycles as f64);
            left.into_iter().min_by(|a, b| {
                let by_cycles = a.modelled_cycles.cmp(&b.modelled_cycles);
                (a.unexplained.total_cmp(&b.unexplained)).then(by_cycles)
            })
        }
    };
    best.with_context(|| {
        let nearest = nearest(all).unwrap_or_default();
        format!("nothing that the firmware does is within these limits; {nearest}")
    })
}

/// The configuration with the least value of `of`, and its equals.
fn equals<'c>(
    among: &[&'c Configuration],
    of: fn(&Configuration) -> f64,
) -> Vec<&'c Configuration> {
    let least = among.iter().map(|c| of(c)).fold(f64::INFINITY, f64::min);
    let near = |c: &&&Configuration| of(c) <= least * (1.0 + EQUAL);
    among.iter().filter(near).copied().collect()
}

/// Text about what comes nearest to limits of time, and to a limit of the error.
fn nearest(all: &[Configuration]) -> Option<String> {
    let fastest = all.iter().min_by_key(|c| c.modelled_cycles)?;
    let by_error = |c: &&Configuration| (1e6 * c.limit_error_deg()) as u64;
    let accurate = all.iter().min_by_key(by_error)?;
    Some(format!(
        "the fastest, {fastest}, takes {:.0} µs ({:.0} frames a second); the most accurate, \
         {accurate}, is within {:.3}°",
        fastest.microseconds(),
        fastest.rate(),
        accurate.limit_error_deg()
    ))
}

impl Limits {
    /// Whether a configuration is within the limits.
    fn hold(&self, c: &Configuration) -> bool {
        self.budget_us.is_none_or(|most| c.microseconds() <= most)
            && self.min_rate.is_none_or(|least| c.rate() >= least)
            && (self.max_error_deg).is_none_or(|most| c.limit_error_deg() <= most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A configuration with a number of cycles and errors of direction (degrees) and |F| (mN).
    fn made(cycles: i64, [direction, force]: [f64; 2]) -> Configuration {
        Configuration {
            width: 320,
            height: 240,
            centroid: "weighted".to_owned(),
            network: "16-16".to_owned(),
            numbers: "int16".to_owned(),
            steps: 1,
            direction_deg: 3.0 * direction,
            strong_direction_deg: direction,
            strong_direction_deg_95: Some(0.1 * direction),
            force_rmse_mn: force,
            place_rmse_um: 10.0,
            unexplained: 0.001,
            modelled_cycles: cycles,
            latency_microseconds: 10.0,
        }
    }

    /// Inaccurate; good; equally good; slightly better; much better in |F|.
    fn several() -> Vec<Configuration> {
        vec![
            made(96_000, [0.5, 0.3]),
            made(144_000, [0.20, 0.1]),
            made(240_000, [0.20, 0.1]),
            made(288_000, [0.195, 0.1]),
            made(480_000, [0.198, 0.01]),
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
            best(&several(), &limits).unwrap().modelled_cycles
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
            let mut other = made(cycles, [0.198, 0.01]);
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
