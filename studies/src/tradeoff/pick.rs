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
/// from 50 mN up, of |F| and of the place must be within a twentieth of the least of each. So must
/// then be the time, and of those that are left the part of frames without a force. Of the rest,
/// the fastest.
pub(super) fn best<'c>(all: &'c [Configuration], limits: &Limits) -> Result<&'c Configuration> {
    let fitting: Vec<_> = all.iter().filter(|c| limits.hold(c)).collect();
    let left = match limits.max_error_deg {
        Some(_) => fitting,
        None => {
            let left = equals(&fitting, |c| c.strong_direction_deg);
            let left = equals(&left, |c| c.force_rmse_mn);
            let left = equals(&left, |c| c.place_rmse_um);
            let left = equals(&left, |c| c.modelled_cycles as f64);
            equals(&left, |c| c.unexplained)
        }
    };
    let best = left.into_iter().min_by_key(|c| c.modelled_cycles);
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

/// Text about the configurations nearest to limits of time, and to a limit of the error.
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
    use crate::tradeoff::configurations;

    #[test]
    fn the_best_is_picked_under_each_limit() {
        let all = configurations().unwrap();
        let picked = |budget_us, min_rate, max_error_deg| {
            let limits = Limits {
                budget_us,
                min_rate,
                max_error_deg,
            };
            best(&all, &limits)
        };
        let name = |limits: Result<&Configuration>| limits.unwrap().to_string();
        let network = "128-128 (int8 per channel) with 0 steps on weighted centroids";
        assert_eq!(name(picked(Some(500.0), None, None)), network);
        assert_eq!(name(picked(None, Some(2000.0), None)), network);
        let on_film = "32-32 (int8 per channel) with 1 step on weighted centroids";
        assert_eq!(name(picked(None, None, Some(0.2))), on_film);
        // The upper end of the interval counts.
        assert!(picked(None, None, Some(0.2)).unwrap().limit_error_deg() <= 0.2);
        let error = picked(Some(10.0), None, Some(0.1)).unwrap_err().to_string();
        for words in ["350 µs", "is within 0.166"] {
            assert!(error.contains(words), "no `{words}` in: {error}");
        }
    }
}
