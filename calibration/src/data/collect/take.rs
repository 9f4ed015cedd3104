//! What a take gave so far: samples, and what is heard of the gauge.

use std::time::{Duration, Instant};

use hivtac_terms::status::Status;
use hivtac_wire::message::Sample;

/// What a take gave.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Take {
    pub samples: usize,
    pub good: usize,
    pub lost: u32,
    pub first_us: Option<u64>,
    pub last_us: u64,
    pub last_sequence: Option<u32>,
    /// The largest |F| that the sensor felt, N; nothing without a force.
    pub felt_n: Option<f64>,
    /// What the gauge showed, N: sum and number.
    pub gauge: (f64, f64),
}

impl Take {
    /// What the gauge showed on average, N.
    pub fn gauge_n(&self) -> Option<f64> {
        let (sum, count) = self.gauge;
        (count > 0.0).then(|| sum / count)
    }

    pub fn count(&mut self, sample: &Sample, gauge_n: Option<f64>) {
        if let Some(gauge_n) = gauge_n {
            self.gauge = (self.gauge.0 + gauge_n, self.gauge.1 + 1.0);
        }
        self.samples += 1;
        let implausible = Status::MARKERS_IMPLAUSIBLE;
        self.good += usize::from(sample.markers.is_some() && !sample.status.contains(implausible));
        self.first_us.get_or_insert(sample.time_us);
        self.last_us = sample.time_us;
        if let Some(force) = &sample.force {
            let force_n = f64::from(force.magnitude.0) / 1e6;
            self.felt_n = Some(self.felt_n.map_or(force_n, |most| most.max(force_n)));
        }
        if let Some(last) = self.last_sequence.replace(sample.sequence) {
            self.lost += sample.sequence.wrapping_sub(last).wrapping_sub(1);
        }
    }
}

/// No gauge is silent for longer while it is listened to.
const SILENT: Duration = Duration::from_secs(10);

/// What is heard of a gauge during a take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heard {
    /// Readings before it.
    before: Option<usize>,
    /// Readings so far, and when they were last more.
    last: Option<usize>,
    at: Instant,
}

impl Heard {
    pub fn from(readings: Option<usize>) -> Self {
        Self {
            before: readings,
            last: readings,
            at: Instant::now(),
        }
    }

    /// Whether there was no reading for too long, now that there are so many.
    pub fn is_silent(&mut self, readings: Option<usize>) -> bool {
        if readings != self.last {
            (self.last, self.at) = (readings, Instant::now());
        }
        readings.is_some() && self.at.elapsed() > SILENT
    }

    /// How many came.
    pub fn since(&self, readings: Option<usize>) -> Option<usize> {
        Some(readings? - self.before?)
    }
}
