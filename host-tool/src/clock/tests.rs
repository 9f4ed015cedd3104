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
fn clocks_that_run_apart_for_half_an_hour_stay_together() {
    for parts in [-40, 40] {
        let error = error_ns(parts, 300_000);
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

/// A sample comes 4.8 ms and 0 to 8 ms after its exposure. Once the device reported its latency,
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
    let begun = Arrival::now().at;
    for frame in 0..300 {
        let step_ns = if (100..200).contains(&frame) {
            800_000_000
        } else {
            0
        };
        let delay_us = 4_785 + 8_000 * (frame * 7 % 11) / 10;
        let came_us = frame * FRAME_US + delay_us;
        let came = Arrival {
            at: begun + Duration::from_micros(came_us),
            ns: START + came_us * 1_000 + step_ns,
        };
        let stamp_ns = clock.stamp_ns(frame * FRAME_US, came);
        let expected_ns = START + frame * FRAME_US * 1_000 + step_ns;
        assert!(stamp_ns.abs_diff(expected_ns) < 500_000, "{frame}");
    }
}

/// Random numbers, the same ones in each run.
struct Dice(u64);

impl Dice {
    /// From 0 to 1.
    fn part(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The way from the devices to the program.
#[derive(Clone, Copy, Default)]
struct Way {
    /// The computer is busy for half of each such time, s: then all samples come at its end.
    busy_every_s: Option<f64>,
    /// All samples but one in fifty come 0.3 to 3 ms later.
    is_crowded: bool,
    /// The second device starts anew at this time, s.
    restart_s: Option<f64>,
    /// The computer's time is set forward by 0.8 s at this time, s.
    step_s: Option<f64>,
    /// From this time on, s, for 20 s, the computer's clock is 500 ppm fast.
    slewed_from_s: Option<f64>,
}

impl Way {
    /// When a sample that is ready at `ready_s` comes to the program. USB at full speed hands over
    /// at the end of a frame of 1 ms; the program runs 60 µs later on average, and one time in
    /// fifty up to 5 ms later.
    fn came_s(self, ready_s: f64, dice: &mut Dice) -> f64 {
        let handed_s = (ready_s * 1e3).ceil() * 1e-3;
        let mut runs_s = handed_s - 60e-6 * (1.0 - dice.part()).ln();
        if dice.part() < 0.02 {
            runs_s += 5e-3 * dice.part();
        }
        if self.is_crowded && dice.part() > 0.02 {
            runs_s += 0.3e-3 + 2.7e-3 * dice.part();
        }
        let busy = self
            .busy_every_s
            .filter(|every| runs_s.rem_euclid(*every) > every / 2.0);
        busy.map_or(runs_s, |every| (runs_s / every).ceil() * every)
    }

    /// The reading of the computer's clock that never jumps, s.
    fn steady_s(self, true_s: f64) -> f64 {
        let slewed = self
            .slewed_from_s
            .map_or(0.0, |from| (true_s - from).clamp(0.0, 20.0));
        true_s + 500e-6 * slewed
    }

    /// The same as a time, and as ns since 1970.
    fn arrival(self, true_s: f64, begun: Instant) -> Arrival {
        let steady_s = self.steady_s(true_s);
        let is_set = self.step_s.is_some_and(|step| true_s >= step);
        let since_s = steady_s + if is_set { 0.8 } else { 0.0 };
        Arrival {
            at: begun + Duration::from_secs_f64(steady_s),
            ns: START + (since_s * 1e9) as u64,
        }
    }
}

/// A device whose clock is wrong by a part, and its stamps.
struct Simulated {
    rate: f64,
    /// When it started, s, and number of its next frame since then.
    started_s: f64,
    frame: u32,
    clock: LiveClock,
    told_s: f64,
    dice: Dice,
}

impl Simulated {
    fn new(parts: f64, seed: u64) -> Simulated {
        Simulated {
            rate: 1.0 + parts * 1e-6,
            started_s: -20.0 - seed as f64 * 0.001_37,
            frame: 3_300,
            clock: LiveClock::default(),
            told_s: f64::NEG_INFINITY,
            dice: Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)),
        }
    }

    /// True time of its next exposure, s.
    fn next_s(&self) -> f64 {
        self.started_s + f64::from(self.frame) * 6_405.3e-6 / self.rate
    }

    /// Takes its next frame: true time, s, and the error of its stamp, s.
    fn take(&mut self, way: Way, begun: Instant) -> (f64, f64) {
        let exposed_s = self.next_s();
        let device_us = (f64::from(self.frame) * 6_405.3) as u64;
        self.frame += 1;
        // One frame in fifty gets a second look.
        let again = if self.dice.part() < 0.02 { 1.5e-3 } else { 0.0 };
        let latency_s = 4_785e-6 + 60e-6 * self.dice.part() + again;
        let ready_s = exposed_s + latency_s;
        let came_s = way.came_s(ready_s, &mut self.dice);
        if exposed_s - self.told_s >= 1.0 {
            self.told_s = exposed_s;
            self.clock.latency((latency_s * 1e6) as u32);
        }
        let came = way.arrival(came_s, begun);
        let stamp_ns = self.clock.stamp_ns(device_us, came);
        assert!(stamp_ns <= came.ns);
        // The true time by the clock that is set when the sample comes.
        let is_set = way.step_s.is_some_and(|step| came_s >= step);
        let true_s = way.steady_s(exposed_s) + if is_set { 0.8 } else { 0.0 };
        let true_ns = START as i64 + (true_s * 1e9) as i64;
        (exposed_s, (stamp_ns as i64 - true_ns) as f64 * 1e-9)
    }
}

/// The largest difference between the errors of two devices' stamps, s, and the largest error, s,
/// from two seconds after a start on; twenty on a crowded computer. Their clocks run 50 ppm apart.
fn apart_s(way: Way) -> (f64, f64) {
    let begun = Arrival::now().at;
    let mut devices = [Simulated::new(-20.0, 7), Simulated::new(30.0, 11)];
    let mut errors = [0.0_f64; 2];
    let (mut apart, mut largest) = (0.0_f64, 0.0_f64);
    let mut is_anew = false;
    let from_s = if way.is_crowded { 20.0 } else { 2.0 };
    loop {
        let next = usize::from(devices[1].next_s() < devices[0].next_s());
        if let Some(restart_s) = way.restart_s.filter(|it| *it < devices[1].next_s())
            && !std::mem::replace(&mut is_anew, true)
        {
            devices[1].started_s = restart_s;
            devices[1].frame = 1;
            continue;
        }
        let (exposed_s, error_s) = devices[next].take(way, begun);
        errors[next] = error_s;
        let since_restart_s = exposed_s - way.restart_s.unwrap_or_default();
        if exposed_s > from_s && !(0.0..2.0).contains(&since_restart_s) {
            apart = apart.max((errors[0] - errors[1]).abs());
            largest = largest.max(errors[0].abs()).max(errors[1].abs());
        }
        if exposed_s > 120.0 {
            return (apart, largest);
        }
    }
}

/// Prints what remains: `cargo test -p hivtac --lib clock -- --nocapture`.
#[test]
fn stamps_of_two_devices_agree_to_a_fifth_of_a_millisecond() {
    let quiet = Way::default();
    let [busy_every_s, restart_s, step_s, slewed_from_s] =
        [Some(0.8), Some(40.0), Some(40.0), Some(40.0)];
    for (what, way, limit_ms) in [
        ("quiet", quiet, 0.2),
        (
            "busy for 0.4 s of 0.8",
            Way {
                busy_every_s,
                ..quiet
            },
            0.2,
        ),
        (
            "crowded",
            Way {
                is_crowded: true,
                ..quiet
            },
            0.2,
        ),
        ("restart", Way { restart_s, ..quiet }, 0.2),
        ("step of 0.8 s", Way { step_s, ..quiet }, 0.2),
        (
            "slewed by 500 ppm",
            Way {
                slewed_from_s,
                ..quiet
            },
            3.0,
        ),
    ] {
        let (apart_s, error_s) = apart_s(way);
        let [apart_ms, error_ms] = [apart_s, error_s].map(|it| it * 1e3);
        println!("{what:>18}: apart by {apart_ms:.3} ms at most, off by {error_ms:.3} ms");
        assert!(apart_ms < limit_ms, "{what}: {apart_ms} ms");
        assert!(error_ms < 1.5 * limit_ms, "{what}: off by {error_ms} ms");
    }
}
