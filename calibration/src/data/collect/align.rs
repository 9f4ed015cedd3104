//! Determines the lag between the gauge's clock and the sensor's.
//!
//! The markers' mean radius rises with |F|, but not in proportion. So for every lag a cubic of the
//! radius is fitted to the gauge's force at that time, and correlated with it. At the right lag the
//! correlation is nearly one; the difference from the cubic is the residual. Lags are tried on a
//! grid, and the best one is refined between its steps. The tip's place on the film matters little:
//! for presses anywhere within ±4 mm the residual is 2 mN.

use anyhow::{Result, bail, ensure};

use super::series::Joined;
use crate::data::dataset::LARGEST_N;
use crate::parallel;

/// The markers' radius at a time of the sensor's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusSample {
    /// Time of the sensor's clock, s.
    pub time_s: f64,
    /// Mean distance of the markers from their middle, minus that at rest, px.
    pub radius_px: f64,
}

/// The lags to search.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Lags to try, s.
    pub lags_s: [f64; 2],
    /// Whether the clocks' rates may differ as well.
    pub drift: bool,
}

/// Relation of the clocks: the gauge's time is `time + lag_s + drift · (time − middle_s)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alignment {
    /// The gauge's time minus the sensor's, s.
    pub lag_s: f64,
    /// Difference of the clocks' rates, relative.
    pub drift: f64,
    /// The sensor's time at which the lag holds.
    pub middle_s: f64,
    /// Correlation of the gauge's force with the cubic of the radius.
    pub correlation: f64,
    /// Root mean square difference between the gauge's force and the cubic, N.
    pub residual_n: f64,
    /// The residual at the next best lag outside the best one's minimum, N.
    pub next_n: f64,
    /// Standard deviation of the gauge's force, N.
    pub spread_n: f64,
    /// Standard uncertainty of the lag, s.
    pub lag_sigma_s: f64,
}

/// Step of the grid of lags, s.
const STEP_S: f64 = 0.02;
/// The longest span of a recording and its gauge, s: half a day.
const LONGEST_S: f64 = 43_200.0;
/// The largest number of frames used on the grid; the refinement uses all.
const GRID_FRAMES: usize = 1000;
/// At least this part of the frames must have a reading.
const COVERED: f64 = 0.8;
/// The smallest number of frames for an alignment.
const FEWEST: usize = 20;
/// The least standard deviation of the gauge's force, N.
const LEAST_SPREAD_N: f64 = 0.002;
const LEAST_CORRELATION: f64 = 0.95;
/// The least ratio of the residual at the next best lag to that at the best.
const LEAST_CONTRAST: f64 = 1.5;
/// The largest difference of clock rates, relative: 500 ppm, five times that of crystals.
const LARGEST_DRIFT: f64 = 5e-4;
/// The least standard uncertainty of a lag, s. Readings and frames arrive with delays of computer
/// and gauge.
const LEAST_LAG_S: f64 = 0.002;
/// Time after which residuals of the force are independent, s.
const FORGOTTEN_S: f64 = 0.5;
/// Half the interval over which the gauge's rate of force is computed, s.
const RATE_S: f64 = 0.03;
/// In a shorter recording, s, a difference of rates is indistinguishable from a lag.
const SHORTEST_FOR_DRIFT_S: f64 = 60.0;

impl Alignment {
    /// The gauge's time at a time of the sensor, s.
    pub fn gauge_time(&self, time_s: f64) -> f64 {
        time_s + self.lag_s + self.drift * (time_s - self.middle_s)
    }

    /// Standard uncertainty of the force at a time of the sensor, N. Due to the lag's uncertainty
    /// and the time between readings. `None` where the gauge has no readings around it.
    pub fn clock_n(&self, gauge: Joined<'_>, time_s: f64) -> Option<f64> {
        let time_s = self.gauge_time(time_s);
        let rate = rate_n_per_s(gauge, time_s)?;
        let clock_n = (rate * self.lag_sigma_s).hypot(gauge.bent_n(time_s));
        Some(clock_n.min(LARGEST_N))
    }
}

/// Rate of the gauge's force at a time of its own clock, N/s; `None` without readings around it.
fn rate_n_per_s(gauge: Joined<'_>, time_s: f64) -> Option<f64> {
    let now = gauge.at(time_s)?;
    let at = |time_s: f64| gauge.at(time_s);
    let [before, after] = [time_s - RATE_S, time_s + RATE_S].map(at);
    match (before, after) {
        (Some(before), Some(after)) => Some((after - before) / (2.0 * RATE_S)),
        (Some(before), None) => Some((now - before) / RATE_S),
        (None, Some(after)) => Some((after - now) / RATE_S),
        (None, None) => None,
    }
}

/// Determines the lag of the gauge's clock.
///
/// # Errors When the peak is not convincing: the reason and the remedy.
pub fn align(frames: &[RadiusSample], gauge: Joined<'_>, search: Search) -> Result<Alignment> {
    ensure!(
        frames.len() >= FEWEST,
        "{} frames with markers are too few to align clocks: {FEWEST} at least",
        frames.len()
    );
    let sparse: Vec<RadiusSample> = frames
        .iter()
        .step_by(frames.len().div_ceil(GRID_FRAMES))
        .copied()
        .collect();
    let [low, high] = search.lags_s;
    ensure!(
        high - low <= LONGEST_S,
        "the gauge's times differ from the sensor's by {low:.1} to {high:.1} s: are they of the \
         same recording?"
    );
    let steps = ((high - low) / STEP_S).ceil().max(0.0) as usize;
    let grid = parallel::map(steps + 1, |step| {
        Fit::of(&sparse, gauge, low + step as f64 * STEP_S, 0.0, 0.0)
    });
    let residual = |step: usize| grid[step].map_or(f64::INFINITY, |fit| fit.relative());
    let Some(best) = (0..=steps)
        .filter(|&step| grid[step].is_some())
        .min_by(|&a, &b| residual(a).total_cmp(&residual(b)))
    else {
        bail!(
            "the gauge has readings for too few of the frames at any lag from {low:.1} to \
             {high:.1} s: did both record at the same time?"
        );
    };
    let hill = hill(best, steps, residual);
    let next = (0..=steps)
        .filter(|step| !hill.contains(step))
        .filter_map(|step| grid[step])
        .map(|fit| fit.relative())
        .fold(1.0, f64::min);
    let found = refine(frames, gauge, low + best as f64 * STEP_S, search.drift);
    let next_n = next * found.spread_n;
    let found = Alignment { next_n, ..found };
    convincing(&found, best == 0 || best == steps)?;
    Ok(found)
}

/// The lags around the best one up to which the residual rises steadily.
fn hill(
    best: usize,
    steps: usize,
    residual: impl Fn(usize) -> f64,
) -> std::ops::RangeInclusive<usize> {
    let (mut low, mut high) = (best, best);
    while low > 0 && residual(low - 1) >= residual(low) {
        low -= 1;
    }
    while high < steps && residual(high + 1) >= residual(high) {
        high += 1;
    }
    low..=high
}

fn convincing(found: &Alignment, at_an_end: bool) -> Result<()> {
    let (spread, residual, next) = (
        found.spread_n * 1e3,
        found.residual_n * 1e3,
        found.next_n * 1e3,
    );
    ensure!(
        found.spread_n >= LEAST_SPREAD_N,
        "the gauge's force hardly changes (standard deviation {spread:.2} mN): press and release \
         while recording"
    );
    ensure!(
        found.correlation >= LEAST_CORRELATION,
        "no lag fits: at the best one, {:.3} s, force and markers correlate by {:.3} only (at \
         least {LEAST_CORRELATION}), and {residual:.1} mN of {spread:.1} mN are left: are gauge \
         and sensor of the same recording, and does nothing but the gauge's tip touch the film?",
        found.lag_s,
        found.correlation
    );
    ensure!(
        !at_an_end,
        "the best lag, {:.3} s, is the last one that was tried: are gauge and sensor of the same \
         recording, and does the gauge send its readings at once?",
        found.lag_s
    );
    ensure!(
        next >= LEAST_CONTRAST * residual,
        "more than one lag fits: {residual:.1} mN are left at {:.3} s and {next:.1} mN at another: \
         press in an irregular rhythm",
        found.lag_s
    );
    Ok(())
}

/// The best lag near one of the grid, and the difference of the clocks' rates if `drift` allows
/// one.
fn refine(frames: &[RadiusSample], gauge: Joined<'_>, lag_s: f64, drift: bool) -> Alignment {
    let ends = [frames[0].time_s, frames[frames.len() - 1].time_s];
    let middle = f64::midpoint(ends[0], ends[1]);
    let drift = drift && ends[1] - ends[0] >= SHORTEST_FOR_DRIFT_S;
    let fit = |lag, drift| Fit::of(frames, gauge, lag, drift, middle);
    let cost = |lag, drift| fit(lag, drift).map_or(f64::INFINITY, |fit| fit.relative());
    let (mut lag, mut rate) = (lag_s, 0.0);
    let mut reach = STEP_S;
    for _ in 0..4 {
        lag = golden(|lag| cost(lag, rate), lag - reach, lag + reach);
        if drift {
            let reach = LARGEST_DRIFT * reach / STEP_S;
            let [low, high] =
                [rate - reach, rate + reach].map(|r| r.clamp(-LARGEST_DRIFT, LARGEST_DRIFT));
            rate = golden(|rate| cost(lag, rate), low, high);
        }
        reach *= if drift { 0.5 } else { 0.1 };
    }
    let fit = fit(lag, rate).unwrap_or_default();
    Alignment {
        lag_s: lag,
        drift: rate,
        middle_s: middle,
        correlation: fit.correlation(),
        residual_n: fit.residual_n,
        next_n: 0.0,
        spread_n: fit.spread_n,
        lag_sigma_s: lag_sigma_s(frames, gauge, lag, fit.residual_n),
    }
}

/// Standard uncertainty of the lag, s: the residual over the rate of the force.
fn lag_sigma_s(frames: &[RadiusSample], gauge: Joined<'_>, lag_s: f64, residual_n: f64) -> f64 {
    let rates = frames.iter().step_by(frames.len().div_ceil(GRID_FRAMES));
    let rates = rates.filter_map(|frame| rate_n_per_s(gauge, frame.time_s + lag_s));
    let (sum, count) = rates.fold((0.0, 0.0), |(sum, count), rate| {
        (sum + rate * rate, count + 1.0)
    });
    let rate = (sum / f64::max(count, 1.0)).sqrt();
    let span_s = frames[frames.len() - 1].time_s - frames[0].time_s;
    let times = (span_s / FORGOTTEN_S).max(1.0);
    let found = residual_n / (rate * times.sqrt()).max(f64::MIN_POSITIVE);
    found.min(STEP_S).hypot(LEAST_LAG_S)
}

/// The minimum of a function with one minimum in a range, to a thousandth of the range.
fn golden(cost: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const PART: f64 = 0.618_033_988_749_894_9;
    let inner = |low: f64, high: f64| [high - PART * (high - low), low + PART * (high - low)];
    let [mut a, mut b] = inner(low, high);
    let (mut at_a, mut at_b) = (cost(a), cost(b));
    for _ in 0..15 {
        if at_a <= at_b {
            (high, b, at_b) = (b, a, at_a);
            a = inner(low, high)[0];
            at_a = cost(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = inner(low, high)[1];
            at_b = cost(b);
        }
    }
    f64::midpoint(low, high)
}

/// Fit of a cubic of the radius to the gauge's force.
#[derive(Clone, Copy, Debug, Default)]
struct Fit {
    spread_n: f64,
    residual_n: f64,
    rises: bool,
}

impl Fit {
    /// At a lag; `None` when too few frames have a reading.
    fn of(
        frames: &[RadiusSample],
        gauge: Joined<'_>,
        lag: f64,
        drift: f64,
        middle: f64,
    ) -> Option<Self> {
        let pair = |sample: &RadiusSample| {
            let time = sample.time_s + lag + drift * (sample.time_s - middle);
            Some((sample.radius_px, gauge.at(time)?))
        };
        let pairs: Vec<(f64, f64)> = frames.iter().filter_map(pair).collect();
        if (pairs.len() as f64) < COVERED * frames.len() as f64 || pairs.len() < FEWEST {
            return None;
        }
        Some(Self::of_pairs(&pairs))
    }

    fn of_pairs(pairs: &[(f64, f64)]) -> Self {
        let count = pairs.len() as f64;
        let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
        let (radius, force) = (mean(|p| p.0), mean(|p| p.1));
        let largest = pairs
            .iter()
            .map(|p| (p.0 - radius).abs())
            .fold(f64::MIN_POSITIVE, f64::max);
        // Gram–Schmidt on the powers of the radius, scaled to ±1: stable, without equations to
        // solve.
        let mut left: Vec<f64> = pairs.iter().map(|p| p.1 - force).collect();
        let spread = (square(&left) / count).sqrt();
        let x: Vec<f64> = pairs.iter().map(|p| (p.0 - radius) / largest).collect();
        let mut basis: Vec<Vec<f64>> = vec![vec![1.0; pairs.len()]];
        let mut rises = false;
        for power in 1..=3 {
            let mut next: Vec<f64> = x.iter().map(|x| x.powi(power)).collect();
            for earlier in &basis {
                remove(&mut next, earlier);
            }
            // Dependent on lower powers: the radius takes too few values.
            if square(&next) > 1e-9 * count {
                let share = remove(&mut left, &next);
                rises |= power == 1 && share > 0.0;
                basis.push(next);
            }
        }
        Self {
            spread_n: spread,
            residual_n: (square(&left) / count).sqrt(),
            rises,
        }
    }

    /// Ratio of residual to spread; 1 if the force does not rise with the radius.
    fn relative(&self) -> f64 {
        if self.rises && self.spread_n > 0.0 {
            self.residual_n / self.spread_n
        } else {
            1.0
        }
    }

    fn correlation(&self) -> f64 {
        (1.0 - self.relative().powi(2)).max(0.0).sqrt()
    }
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum()
}

/// Removes the component along `direction` from `values`, and returns its coefficient.
fn remove(values: &mut [f64], direction: &[f64]) -> f64 {
    let along: f64 = values.iter().zip(direction).map(|(v, d)| v * d).sum();
    let share = along / square(direction);
    values
        .iter_mut()
        .zip(direction)
        .for_each(|(v, d)| *v -= share * d);
    share
}

#[cfg(test)]
mod tests;
