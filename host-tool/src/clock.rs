//! Converts a device's time of exposure to this computer's clock.

use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Inverse of the largest difference between the rates of the two clocks: 1 in 10,000, which is
/// more than quartz crystals have.
const DRIFT: u64 = 10_000;
/// Largest delay of a sample, ns. A longer one means that a clock was set or the device restarted.
const LATEST_NS: u64 = 1_000_000_000;

/// Reading of the monotonic clock when a [`LiveClock`] begins, ns: later than any delay.
const BEFORE_NS: u64 = 1 << 40;

/// This computer's time, ns since 1970.
pub fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.unwrap_or_default().as_nanos() as u64
}

/// Converts device time to this computer's time. The offset comes from the sample with the shortest
/// delay, allowing for drift, and delays of single samples do not change it. The device's own
/// latency, from exposure to sample, is taken off.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// The least latency that the device told, µs.
    latency_us: Option<u32>,
    /// Of the sample before: device time (µs), and offset of this computer's clock from the
    /// device's (ns).
    last: Option<(u64, i128)>,
}

impl Clock {
    /// Notes the latency that the device tells of a frame, µs; 0 before its first frame.
    pub fn latency(&mut self, latency_us: u32) {
        if latency_us > 0 {
            let least = self
                .latency_us
                .map_or(latency_us, |least| least.min(latency_us));
            self.latency_us = Some(least);
        }
    }

    /// Time of exposure, ns since 1970, from the device time (µs) and the sample's arrival (ns
    /// since 1970). Never later than the arrival.
    pub fn stamp_ns(&mut self, device_us: u64, came_ns: u64) -> u64 {
        let device_ns = i128::from(device_us) * 1_000;
        let seen = i128::from(came_ns) - device_ns;
        let ahead = match self.last {
            None => seen,
            Some((last_us, ahead)) => {
                let since_ns = u128::from(device_us.saturating_sub(last_us)) * 1_000;
                let ahead = ahead + (since_ns / u128::from(DRIFT)) as i128;
                match seen < ahead || seen - ahead > i128::from(LATEST_NS) {
                    true => seen,
                    false => ahead,
                }
            }
        };
        self.last = Some((device_us, ahead));
        let latency_ns = 1_000 * i128::from(self.latency_us.unwrap_or_default());
        u64::try_from(device_ns + ahead - latency_ns).unwrap_or(came_ns)
    }
}

/// A [`Clock`] for samples as they arrive. It goes by the monotonic clock: its stamps follow a step
/// of this computer's time at once.
#[derive(Clone, Debug)]
pub struct LiveClock {
    begun: Instant,
    clock: Clock,
}

impl Default for LiveClock {
    /// Begins with no sample.
    fn default() -> LiveClock {
        LiveClock {
            begun: Instant::now(),
            clock: Clock::default(),
        }
    }
}

impl LiveClock {
    /// Notes the latency that the device tells, µs.
    pub fn latency(&mut self, latency_us: u32) {
        self.clock.latency(latency_us);
    }

    /// Time of exposure, ns since 1970, of a sample that came at `came`, which is `came_ns` since
    /// 1970.
    pub fn stamp_ns(&mut self, device_us: u64, came: Instant, came_ns: u64) -> u64 {
        let steady_ns = came.saturating_duration_since(self.begun).as_nanos() as u64 + BEFORE_NS;
        let delay_ns = steady_ns - self.clock.stamp_ns(device_us, steady_ns).min(steady_ns);
        came_ns.saturating_sub(delay_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const START: u64 = 1_700_000_000_000_000_000;
    const FRAME_US: u64 = 6_405;

    /// Sends `frames` samples of a device whose clock is `parts` millionths fast, each delayed by
    /// up to 8 ms. Returns the last stamp's error, ns.
    fn error_ns(parts: i64, frames: u64) -> i64 {
        let mut clock = Clock::default();
        let mut error = 0;
        for frame in 0..frames {
            let true_us = frame * FRAME_US;
            let drifted_us = true_us as i64 + true_us as i64 * parts / 1_000_000;
            let device_us = drifted_us as u64 + 5_000_000;
            let delay_ns = 8_000_000 * (frame * 7 % 11) / 10;
            let true_ns = START + true_us * 1_000;
            let stamp = clock.stamp_ns(device_us, true_ns + delay_ns);
            assert!(stamp <= true_ns + delay_ns);
            error = stamp as i64 - true_ns as i64;
        }
        error
    }

    #[test]
    fn delays_of_single_samples_move_no_stamp() {
        assert!(error_ns(0, 1_000).abs() < 10_000, "{}", error_ns(0, 1_000));
    }

    #[test]
    fn clocks_that_run_apart_for_hours_stay_together() {
        for parts in [-40, 40] {
            let error = error_ns(parts, 1_000_000);
            assert!(error.abs() < 20_000, "{parts}: {error}");
        }
    }

    #[test]
    fn a_device_that_starts_anew_and_a_clock_that_is_set_are_followed() {
        let mut clock = Clock::default();
        assert_eq!(clock.stamp_ns(900_000_000, START), START);
        assert_eq!(clock.stamp_ns(2_000, START + 5), START + 5);
        let later = START + 3_600_000_000_000;
        assert_eq!(clock.stamp_ns(9_000, later), later);
        assert_eq!(clock.stamp_ns(16_000, START), START);
    }

    /// A sample comes 4.8 ms and 0 to 8 ms after its exposure. Once the device told its latency,
    /// stamps are true to 0.5 ms.
    #[test]
    fn the_devices_latency_is_taken_off() {
        let mut clock = Clock::default();
        clock.latency(0);
        clock.latency(4_785);
        clock.latency(4_900);
        let mut errors = Vec::new();
        for frame in 0..100 {
            let exposed_ns = START + frame * FRAME_US * 1_000;
            let came_ns = exposed_ns + 4_785_000 + 8_000_000 * (frame * 7 % 11) / 10;
            let stamp_ns = clock.stamp_ns(frame * FRAME_US + 5_000_000, came_ns);
            errors.push(stamp_ns.abs_diff(exposed_ns));
        }
        assert!(errors.iter().all(|error| *error < 500_000), "{errors:?}");
    }

    /// This computer's time is set forward by 0.8 s, and back.
    #[test]
    fn a_step_of_the_time_is_followed_at_once() {
        let mut clock = LiveClock::default();
        clock.latency(4_785);
        let begun = clock.begun;
        for frame in 0..300 {
            let step_ns = if (100..200).contains(&frame) {
                800_000_000
            } else {
                0
            };
            let delay_us = 4_785 + 8_000 * (frame * 7 % 11) / 10;
            let came_us = frame * FRAME_US + delay_us;
            let came = begun + Duration::from_micros(came_us);
            let stamp_ns =
                clock.stamp_ns(frame * FRAME_US, came, START + came_us * 1_000 + step_ns);
            let expected_ns = START + frame * FRAME_US * 1_000 + step_ns;
            assert!(stamp_ns.abs_diff(expected_ns) < 500_000, "{frame}");
        }
    }
}
