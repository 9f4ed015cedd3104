//! `hivtac check`: measures rate, jitter, losses and latency, and compares them with limits.

use crate::device::{Device, seconds};
use crate::output::{self, note};
use clap::Args;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::link::Link;
use hivtac_host::reply::log_text;
use hivtac_host::tally::Tally;
use hivtac_wire::message::{DeviceMessage, Request, Sample};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Measure rate, jitter, losses and latency for a while, and hold them against limits
///
/// Example: hivtac check --seconds 10 --min-rate 150 --max-loss 0
#[derive(Args)]
pub struct CheckArguments {
    #[command(flatten)]
    device: Device,
    /// How long to measure
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds)]
    seconds: Duration,
    /// Fewest samples a second, by the device's clock
    #[arg(long, value_name = "HZ")]
    min_rate: Option<f64>,
    /// Most frames without a sample
    #[arg(long, value_name = "N")]
    max_loss: Option<u64>,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

/// Measures, prints the results and names the first limit that failed: rate before losses.
pub fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let (mut link, _) = arguments.device.connect()?;
    let mut measured = Measured::default();
    measured.follow(&mut link, arguments)?;
    measured.tally.rejected(link.rejected());
    let report = measured.report();
    output::report(arguments.json, &report, || report.lines(&measured.tally))?;
    report.judge(arguments)
}

/// The measurements: each sample's and the device's counters.
#[derive(Default)]
struct Measured {
    tally: Tally,
    first_us: Option<u64>,
    /// Of the newest sample: sequence number, device time (µs) and arrival.
    last: Option<(u32, u64, Instant)>,
    samples: u64,
    /// For each sample: by how much the time between two arrivals and that between their exposures
    /// differ, ms.
    jitter_ms: Vec<f64>,
    /// Latencies that the device reported, µs.
    latency_us: Vec<u32>,
}

impl Measured {
    fn follow(&mut self, link: &mut Link, arguments: &CheckArguments) -> Result<(), Failure> {
        let patience = arguments.device.timeout;
        self.request(link, Request::GetInfo, patience)?;
        self.request(link, Request::Start, patience)?;
        let end = Instant::now() + arguments.seconds;
        while let Some(message) = link.receive(end)? {
            self.take(&message, Instant::now());
        }
        self.request(link, Request::Stop, patience)?;
        self.request(link, Request::GetInfo, patience)
    }

    fn request(
        &mut self,
        link: &mut Link,
        request: Request,
        patience: Duration,
    ) -> Result<(), Failure> {
        link.request(request, patience, |message| {
            self.take(&message, Instant::now())
        })
    }

    fn take(&mut self, message: &DeviceMessage, now: Instant) {
        match message {
            DeviceMessage::Sample(sample) => self.sample(sample, now),
            DeviceMessage::Stats(stats) => {
                self.tally.stats(stats);
                self.latency_us
                    .extend(Some(stats.latency_us).filter(|&us| us > 0));
            }
            DeviceMessage::Log(line) => note(&log_text(line)),
            _ => (),
        }
    }

    fn sample(&mut self, sample: &Sample, now: Instant) {
        self.tally.sample(sample);
        self.samples += 1;
        self.first_us.get_or_insert(sample.time_us);
        if let Some((sequence, time_us, then)) = self.last
            && sample.sequence == sequence.wrapping_add(1)
        {
            let exposed_ms = sample.time_us.saturating_sub(time_us) as f64 / 1e3;
            let came_ms = (now - then).as_secs_f64() * 1e3;
            self.jitter_ms.push((came_ms - exposed_ms).abs());
        }
        self.last = Some((sample.sequence, sample.time_us, now));
    }

    fn report(&mut self) -> Report {
        let (first_us, last_us) = (self.first_us, self.last.map(|(_, us, _)| us));
        let span_us = last_us
            .zip(first_us)
            .map_or(0, |(last, first)| last.saturating_sub(first));
        let steps = self.samples.saturating_sub(1) as f64;
        self.jitter_ms.sort_by(f64::total_cmp);
        Report {
            samples: self.samples,
            rate_hz: if span_us > 0 {
                steps * 1e6 / span_us as f64
            } else {
                0.0
            },
            jitter_p50_ms: part(&self.jitter_ms, 0.5),
            jitter_p99_ms: part(&self.jitter_ms, 0.99),
            lost: self.tally.lost(),
            causes: self.tally.causes(),
            latency_ms: self.latency_us.iter().max().map(|us| f64::from(*us) / 1e3),
        }
    }
}

/// The value below which the part `part` (0 to 1) of sorted values lies; `None` if there are no
/// values.
fn part(sorted: &[f64], part: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    sorted.get((part * last as f64).round() as usize).copied()
}

#[derive(Debug, Serialize)]
struct Report {
    samples: u64,
    rate_hz: f64,
    jitter_p50_ms: Option<f64>,
    jitter_p99_ms: Option<f64>,
    lost: u64,
    causes: BTreeMap<&'static str, u64>,
    /// The largest latency that the device reported, ms.
    latency_ms: Option<f64>,
}

impl Report {
    fn lines(&self, tally: &Tally) -> String {
        let ms = |value: Option<f64>| value.map_or("–".to_owned(), |ms| format!("{ms:.2} ms"));
        let causes: Vec<_> = self
            .causes
            .iter()
            .map(|(why, n)| format!("{why} {n}"))
            .collect();
        [
            format!(
                "rate     {:.2} samples a second ({} samples)",
                self.rate_hz, self.samples
            ),
            format!(
                "jitter   p50 {}, p99 {} (of the times between arrivals)",
                ms(self.jitter_p50_ms),
                ms(self.jitter_p99_ms)
            ),
            format!("lost     {} ({})", self.lost, causes.join(", ")),
            format!(
                "latency  {} at most, from the middle of the exposure to the sample",
                ms(self.latency_ms)
            ),
            format!("         {}", tally.loss_line()),
        ]
        .join("\n")
    }

    fn judge(&self, arguments: &CheckArguments) -> Result<(), Failure> {
        if let Some(least) = arguments.min_rate.filter(|least| self.rate_hz < *least) {
            let message = format!("{:.2} samples a second, below {least}", self.rate_hz);
            return Err(Failure::new(Kind::Rate, message));
        }
        if let Some(most) = arguments.max_loss.filter(|most| self.lost > *most) {
            let message = format!("{} frames lost, more than {most}", self.lost);
            return Err(Failure::new(Kind::Loss, message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_of_the_sorted_values() {
        let sorted: Vec<f64> = (0..=100).map(f64::from).collect();
        assert_eq!(
            (part(&sorted, 0.5), part(&sorted, 0.99)),
            (Some(50.0), Some(99.0))
        );
        assert_eq!(part(&[], 0.5), None);
    }
}
