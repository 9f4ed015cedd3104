//! Converts a device's time of exposure to this computer's clock, so that the stamps of several
//! devices are comparable.

mod line;

use line::{Line, Point};
use std::collections::VecDeque;
use std::sync::LazyLock;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Largest delay of a sample, ns. A longer one means that a clock was set or the device restarted.
const LATEST_NS: i64 = 1_000_000_000;
/// Above this delay, ns, a sample is late.
const LATE_NS: i64 = 1_000_000;
/// After only late samples in this time, µs, the clocks' rates are others.
const LATE_FOR_US: u64 = 3_000_000;
/// A sample that is sooner by this, ns, shows that all before were late, or a clock was set.
const SOONER_NS: i64 = -1_000_000;
/// Latencies that must agree that it is another one: the device sends one each second, of one
/// frame, and a frame may take longer than others.
const LATENCIES: usize = 4;
/// Differences of latencies up to this, µs, are chance; a longer exposure makes larger ones.
const CHANCE_US: u32 = 200;

/// Reading of [`Arrival`]'s clock when the program begins, ns: later than any delay.
const BEFORE_NS: u64 = 1 << 40;
/// Longest time between two readings of clocks that count as one.
const AT_ONCE: Duration = Duration::from_micros(20);
/// Most attempts to read clocks at once.
const ATTEMPTS: usize = 4;

/// The origin of the times of all devices.
static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);

/// This computer's time, ns since 1970.
pub fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.unwrap_or_default().as_nanos() as u64
}

/// When something arrived at this computer.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// By the clock that never jumps.
    pub at: Instant,
    /// Ns since 1970.
    pub ns: u64,
}

impl Arrival {
    /// Reads both clocks, at once unless this thread was interrupted each time.
    pub fn now() -> Arrival {
        let mut read = (Duration::MAX, Arrival::read());
        for _ in 0..ATTEMPTS {
            let arrival = Arrival::read();
            let took = arrival.at.elapsed();
            if took < read.0 {
                read = (took, arrival);
            }
            if took <= AT_ONCE {
                break;
            }
        }
        read.1
    }

    fn read() -> Arrival {
        LazyLock::force(&BEGUN);
        Arrival {
            at: Instant::now(),
            ns: now_ns(),
        }
    }
}

/// Converts device time to this computer's time. Delays of single samples do not change it: it
/// follows the line below the delays of the last minute, whose slope is the difference of the
/// clocks' rates. The device's own latency, from exposure to sample, is taken off.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// The last latencies that the device reported, µs, and the one that is subtracted.
    latencies_us: VecDeque<u32>,
    latency_us: u32,
    line: Line,
    /// Device time of the last sample, µs.
    last_us: u64,
    /// Device time since which all samples were late, µs.
    late_since_us: Option<u64>,
}

impl Clock {
    /// Notes the latency of a frame, as the device reports it, µs; 0 before its first frame.
    pub fn latency(&mut self, latency_us: u32) {
        if latency_us == 0 {
            return;
        }
        // From the first report on, a lesser one was right before, too.
        let is_new = self.latencies_us.len() < LATENCIES;
        self.latencies_us.truncate(LATENCIES - 1);
        self.latencies_us.push_front(latency_us);
        let before_us = self.latency_us;
        if before_us == 0 || latency_us < before_us {
            self.latency_us = latency_us;
            if is_new || before_us - latency_us <= CHANCE_US {
                let by_us = i64::from(before_us) - i64::from(latency_us);
                self.line.shift(1_000 * by_us);
            }
        } else if let Some(least_us) = self.latencies_us.iter().min()
            && !is_new
            && *least_us > before_us + CHANCE_US
        {
            self.latency_us = *least_us;
        }
    }

    /// Time of exposure, ns since 1970, from the device time (µs) and the sample's arrival (ns
    /// since 1970). Never later than the arrival.
    pub fn stamp_ns(&mut self, device_us: u64, came_ns: u64) -> u64 {
        let soonest_ns = came_ns.saturating_sub(1_000 * u64::from(self.latency_us));
        let device_ns = device_us.saturating_mul(1_000) as i64;
        let point = Point {
            device_us,
            ahead_ns: soonest_ns as i64 - device_ns,
        };
        self.forget(point);
        self.line.add(point);
        let ahead_ns = self.line.at(device_us).unwrap_or(point.ahead_ns);
        let stamp_ns = device_ns.saturating_add(ahead_ns);
        u64::try_from(stamp_ns).map_or(soonest_ns, |stamp_ns| stamp_ns.min(soonest_ns))
    }

    /// Forgets the samples that say nothing about this one, before it is added.
    fn forget(&mut self, point: Point) {
        let above_ns = self.line.above(point);
        let is_other = point.device_us < self.last_us || above_ns > LATEST_NS;
        self.last_us = point.device_us;
        if is_other || above_ns < SOONER_NS {
            self.line = Line::default();
        }
        if is_other || above_ns <= LATE_NS {
            self.late_since_us = None;
            return;
        }
        let since_us = *self.late_since_us.get_or_insert(point.device_us);
        if point.device_us - since_us > LATE_FOR_US {
            self.line.forget_before(since_us);
            self.late_since_us = None;
        }
    }
}

/// A [`Clock`] for samples as they arrive. It uses the monotonic clock, so its stamps follow a step
/// of this computer's time at once.
#[derive(Clone, Debug, Default)]
pub struct LiveClock(Clock);

impl LiveClock {
    /// Notes the latency that the device reports, µs.
    pub fn latency(&mut self, latency_us: u32) {
        self.0.latency(latency_us);
    }

    /// Time of exposure of a sample, ns since 1970.
    pub fn stamp_ns(&mut self, device_us: u64, came: Arrival) -> u64 {
        let since = came.at.saturating_duration_since(*BEGUN);
        let steady_ns = since.as_nanos() as u64 + BEFORE_NS;
        let delay_ns = steady_ns - self.0.stamp_ns(device_us, steady_ns).min(steady_ns);
        came.ns.saturating_sub(delay_ns)
    }
}

#[cfg(test)]
mod tests;
