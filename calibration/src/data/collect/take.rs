//! Counts a take's samples and gauge readings.

use std::time::{Duration, Instant};

use hivtac_terms::status::Status;
use hivtac_wire::message::Sample;

/// The content of a take.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Take {
    pub samples: usize,
    pub good: usize,
    pub lost: u32,
    pub first_us: Option<u64>,
    pub last_us: u64,
    pub last_sequence: Option<u32>,
    /// The largest |F| that the sensor reported, N; `None` without a force.
    pub felt_n: Option<f64>,
    /// The gauge's readings, N: sum and number.
    pub gauge: (f64, f64),
}

impl Take {
    /// Mean of the gauge's readings, N; `None` without readings.
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
        self.good += usize::from(sample.found().is_some() && !sample.status.contains(implausible));
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

/// The longest silence of a working gauge.
const SILENT: Duration = Duration::from_secs(10);

/// The gauge's readings during a take.
#[derive(Clone, Copy, Debug)]
pub(super) struct GaugeActivity {
    /// Number of readings before it.
    before: Option<usize>,
    /// Number of readings so far, and when it last changed.
    last: Option<usize>,
    at: Instant,
}

impl GaugeActivity {
    pub fn from(readings: Option<usize>) -> Self {
        Self {
            before: readings,
            last: readings,
            at: Instant::now(),
        }
    }

    /// Whether the gauge has been silent for too long, at this number of readings.
    pub fn is_silent(&mut self, readings: Option<usize>) -> bool {
        if readings != self.last {
            (self.last, self.at) = (readings, Instant::now());
        }
        readings.is_some() && self.at.elapsed() > SILENT
    }

    /// Number of readings since the take began.
    pub fn since(&self, readings: Option<usize>) -> Option<usize> {
        Some(readings? - self.before?)
    }
}
