//! Counts for a summary: frames shown, received and lost by cause, and errors against true forces.

use crate::truth::Truth;
use hivtac_terms::force::Force;
use hivtac_terms::status::Status;
use hivtac_wire::decoder::Rejected;
use hivtac_wire::message::{Sample, Stats};
use std::collections::BTreeMap;
use std::fmt;

/// |F| from which a direction is compared, N.
const DIRECTION_FLOOR_N: f64 = 0.05;

/// Everything that the summary shows.
#[derive(Default)]
pub struct Tally {
    /// Samples printed.
    pub shown: u64,
    received: u64,
    gaps: Gaps,
    rejected: Rejected,
    device: DeviceCounts,
    without_force: u64,
    /// Among samples without a force, the number with each "no force" bit, by the bit's index in
    /// [`Status::NAMES`].
    reasons: BTreeMap<usize, u64>,
    errors: Errors,
    reconnections: u64,
}

impl Tally {
    /// Notes a new connection: frames that passed while there was none do not count as lost.
    pub fn connected_again(&mut self) {
        self.reconnections += 1;
        self.gaps.away = true;
    }

    /// Connections after the first.
    pub fn reconnections(&self) -> u64 {
        self.reconnections
    }

    /// Counts a sample; returns the numbers of samples, and of frames beyond those, missing before
    /// it.
    pub fn sample(&mut self, sample: &Sample) -> (u32, u32) {
        self.received += 1;
        if sample.force.is_none() {
            self.without_force += 1;
            let names = Status::NAMES.iter().enumerate();
            for (place, _) in names.filter(|(_, (bit, _))| {
                Status::NO_FORCE.contains(*bit) && sample.status.contains(*bit)
            }) {
                *self.reasons.entry(place).or_default() += 1;
            }
        }
        self.gaps.count(sample.sequence, sample.frame)
    }

    /// Compares a sample's force with its true force.
    pub fn compare(&mut self, force: &Force, truth: &Truth) {
        self.errors.count(force, truth);
    }

    /// Adds the device's counters.
    pub fn stats(&mut self, stats: &Stats) {
        self.device.count(stats);
    }

    /// Adds the rejects of a connection's decoder; call it once, when the connection ends.
    pub fn rejected(&mut self, of_connection: Rejected) {
        let sum = &mut self.rejected;
        sum.overlong = sum.overlong.saturating_add(of_connection.overlong);
        sum.cobs = sum.cobs.saturating_add(of_connection.cobs);
        sum.crc = sum.crc.saturating_add(of_connection.crc);
        sum.body = sum.body.saturating_add(of_connection.body);
        sum.trailing = sum.trailing.saturating_add(of_connection.trailing);
        sum.bytes = sum.bytes.saturating_add(of_connection.bytes);
    }

    /// The summary for a person; with `truth`, including the errors.
    pub fn summary(&self, truth: bool) -> String {
        let shown = format!("{} frames shown, ", self.shown);
        shown + &self.summary_of_received(truth)
    }

    /// The summary of recorded samples.
    pub fn summary_of_recorded(&self) -> String {
        "recorded: ".to_owned() + &self.summary_of_received(false)
    }

    /// The numbers of samples received and of frames without a sample.
    pub fn received_line(&self) -> String {
        format!("{} received, {} lost", self.received, self.lost())
    }

    /// Frames without a sample, from any cause.
    pub fn lost(&self) -> u64 {
        self.gaps.samples + self.gaps.frames
    }

    /// Losses by cause: on the way, and those that the device counts.
    pub fn causes(&self) -> BTreeMap<&'static str, u64> {
        let [_, _, busy, overrun, size, setup, usb, ..] = self.device.grown;
        [
            ("on the way", self.gaps.samples),
            ("not processed", self.gaps.frames),
            ("busy", busy),
            ("overrun", overrun),
            ("size", size),
            ("set-up", setup),
            ("usb", usb),
        ]
        .into()
    }

    /// The counts that a recording holds of itself.
    pub fn counts(&self) -> [(&'static str, u64); 6] {
        [
            ("samples", self.received),
            ("samples_lost_on_the_way", self.gaps.samples),
            ("frames_not_processed", self.gaps.frames),
            ("samples_without_force", self.without_force),
            ("messages_rejected", self.rejected.frames().into()),
            ("device_restarts", self.gaps.restarts),
        ]
    }

    fn summary_of_received(&self, truth: bool) -> String {
        let mut lines = vec![
            self.received_line(),
            self.loss_line(),
            self.device.to_string(),
        ];
        if self.without_force > 0 {
            lines.push(self.without_force_line());
        }
        if self.reconnections > 0 {
            let frames = self.gaps.frames_away;
            let times = self.reconnections;
            lines.push(format!(
                "connected again {times} times; {frames} frames passed meanwhile"
            ));
        }
        if truth {
            lines.extend(self.errors.lines());
        }
        lines.join("\n") + "\n"
    }

    /// A line with the losses by cause.
    pub fn loss_line(&self) -> String {
        let Rejected {
            overlong,
            cobs,
            crc,
            body,
            trailing,
            bytes,
        } = self.rejected;
        let mut line = format!(
            "lost: {} samples on the way (gaps in the sequence), {} frames not processed (gaps in \
             the frame number); rejected here: {} messages, {bytes} bytes",
            self.gaps.samples,
            self.gaps.frames,
            self.rejected.frames()
        );
        if self.rejected.frames() > 0 {
            line += &format!(
                " (overlong {overlong}, cobs {cobs}, crc {crc}, body {body}, trailing {trailing})"
            );
        }
        if self.gaps.restarts > 0 {
            line += &format!("; the device started anew {} times", self.gaps.restarts);
        }
        line
    }

    fn without_force_line(&self) -> String {
        let reasons: Vec<_> = self
            .reasons
            .iter()
            .map(|(place, count)| format!("{} {count}", Status::NAMES[*place].1))
            .collect();
        format!(
            "without a force: {} ({})",
            self.without_force,
            reasons.join(", ")
        )
    }
}

/// Gaps in a sample's two counters, sequence number and frame number.
#[derive(Default)]
struct Gaps {
    last: Option<(u32, u32)>,
    samples: u64,
    frames: u64,
    /// True from a new connection to its first sample.
    away: bool,
    /// Frames without a sample that passed between connections.
    frames_away: u64,
    restarts: u64,
}

impl Gaps {
    /// Counts a sample; returns the samples, and the frames beyond those, missing before it.
    fn count(&mut self, sequence: u32, frame: u32) -> (u32, u32) {
        let away = std::mem::take(&mut self.away);
        let Some((last_sequence, last_frame)) = self.last.replace((sequence, frame)) else {
            return (0, 0);
        };
        let samples = sequence.wrapping_sub(last_sequence).wrapping_sub(1);
        let frames = frame.wrapping_sub(last_frame).wrapping_sub(1);
        // Counters that step back show a restart of the device.
        if samples > u32::MAX / 2 || frames > u32::MAX / 2 {
            self.restarts += 1;
            return (0, 0);
        }
        let beyond = frames.saturating_sub(samples);
        self.samples += u64::from(samples);
        *if away {
            &mut self.frames_away
        } else {
            &mut self.frames
        } += u64::from(beyond);
        (samples, beyond)
    }
}

/// Growth of the device's counters while it was watched.
#[derive(Default)]
struct DeviceCounts {
    last: Option<Stats>,
    /// Number of times they were received after the first.
    updates: u64,
    grown: [u64; 11],
}

impl DeviceCounts {
    fn count(&mut self, stats: &Stats) {
        let last = match self.last.replace(*stats) {
            None => return,
            Some(last) if stats.uptime_us < last.uptime_us => Stats::default(),
            Some(last) => last,
        };
        self.updates += 1;
        let pairs = counters(stats).into_iter().zip(counters(&last));
        for (sum, (now, before)) in self.grown.iter_mut().zip(pairs) {
            *sum += u64::from(now.saturating_sub(before));
        }
    }
}

fn counters(stats: &Stats) -> [u32; 11] {
    [
        stats.frames_exposed,
        stats.frames_processed,
        stats.dropped_busy,
        stats.dropped_overrun,
        stats.dropped_size,
        stats.dropped_setup,
        stats.usb_dropped,
        stats.camera_timeouts,
        stats.camera_restarts,
        stats.capture_overruns,
        stats.host_frames_rejected,
    ]
}

impl fmt::Display for DeviceCounts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(last) = self.last.filter(|_| self.updates > 0) else {
            return f.write_str("device: no counters received since the start");
        };
        let [
            exposed,
            processed,
            busy,
            overrun,
            size,
            setup,
            usb,
            timeouts,
            restarts,
            overruns,
            rejected,
        ] = self.grown;
        write!(
            f,
            "device: {exposed} frames exposed, {processed} processed; dropped: busy {busy}, \
             overrun {overrun}, size {size}, set-up {setup}, USB {usb}; camera timeouts \
             {timeouts}, restarts {restarts}, overruns {overruns}; commands rejected {rejected}; \
             last frame took {} µs, its sample was ready {} µs after the middle of its exposure",
            last.processing_us, last.latency_us
        )
    }
}

/// A mean of numbers that are added one at a time.
#[derive(Default)]
struct Mean {
    sum: f64,
    count: u64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

/// Errors against the true forces.
#[derive(Default)]
struct Errors {
    direction_deg: Mean,
    direction_deg_from_floor: Mean,
    magnitude_squared: Mean,
    /// Square of the distance between the place found and the true one, µm².
    place_squared: Mean,
}

impl Errors {
    fn count(&mut self, force: &Force, truth: &Truth) {
        let magnitude_error = f64::from(force.magnitude.0) / 1e6 - truth.magnitude_n;
        self.magnitude_squared
            .add(magnitude_error * magnitude_error);
        if let (Some(place), Some([x_mm, y_mm])) = (force.place, truth.place_mm()) {
            let x = f64::from(place.x.0) - x_mm * 1e3;
            let y = f64::from(place.y.0) - y_mm * 1e3;
            self.place_squared.add(x * x + y * y);
        }
        let found = force.cartesian.map(|part| f64::from(part.0));
        let Some(angle) = angle_deg(found, [truth.x_n, truth.y_n, truth.z_n]) else {
            return;
        };
        self.direction_deg.add(angle);
        if truth.magnitude_n >= DIRECTION_FLOOR_N {
            self.direction_deg_from_floor.add(angle);
        }
    }

    fn lines(&self) -> [String; 3] {
        let direction = |mean: &Mean, what: &str| match mean.value() {
            Some(value) => format!("{value:.3}° over {} frames {what}", mean.count),
            None => format!("none over 0 frames {what}"),
        };
        let rmse = match self.magnitude_squared.value() {
            Some(square) => format!("{:.3} mN", square.sqrt() * 1e3),
            None => "none".to_owned(),
        };
        let place = match self.place_squared.value() {
            Some(square) => format!("{:.1} µm", square.sqrt()),
            None => "none".to_owned(),
        };
        [
            format!(
                "mean direction error: {}, {}",
                direction(&self.direction_deg, "with a force"),
                direction(&self.direction_deg_from_floor, "with true |F| ≥ 50 mN")
            ),
            format!(
                "RMSE of |F|: {rmse} over {} frames",
                self.magnitude_squared.count
            ),
            format!(
                "RMSE of the place: {place} over {} frames",
                self.place_squared.count
            ),
        ]
    }
}

/// Angle between two vectors, degrees, well conditioned at every angle; `None` if one of them has
/// no direction.
fn angle_deg(a: [f64; 3], b: [f64; 3]) -> Option<f64> {
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let cross = [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ];
    let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    (dot != 0.0 || sine != 0.0).then(|| sine.atan2(dot).to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::Place;
    use hivtac_terms::units::{
        MicroNewtons, Micrometres, MilliDegrees, SignedMicrometres, UnsignedMicroNewtons,
        UnsignedMilliDegrees,
    };

    #[test]
    fn gaps_are_distinguished() {
        let mut gaps = Gaps::default();
        assert_eq!(
            gaps.count(u32::MAX - 1, 10),
            (0, 0),
            "the first has no gap before it"
        );
        assert_eq!(gaps.count(u32::MAX, 11), (0, 0));
        assert_eq!(gaps.count(0, 12), (0, 0), "wraps");
        assert_eq!(gaps.count(3, 15), (2, 0), "two samples lost on the way");
        assert_eq!(gaps.count(4, 18), (0, 2), "two frames not processed");
        assert_eq!(gaps.count(6, 22), (1, 2), "both");
        gaps.away = true;
        assert_eq!(gaps.count(8, 40), (1, 16), "back again");
        assert_eq!(gaps.frames_away, 16);
        assert_eq!(gaps.count(0, 1), (0, 0), "started anew");
        assert_eq!((gaps.samples, gaps.frames, gaps.restarts), (4, 4, 1));
    }

    #[test]
    fn device_counters_are_what_they_grew() {
        let stats = |exposed, uptime_us| Stats {
            frames_exposed: exposed,
            uptime_us,
            ..Stats::default()
        };
        let mut device = DeviceCounts::default();
        for (exposed, uptime) in [(100, 10), (130, 20), (5, 3), (9, 4)] {
            device.count(&stats(exposed, uptime));
        }
        assert_eq!(device.grown[0], 39, "30 before the restart and 9 after it");
    }

    #[test]
    fn the_error_of_a_place_is_a_distance_over_the_frames_that_have_both() {
        let force = |place| Force {
            alpha: MilliDegrees(0),
            beta: MilliDegrees(0),
            magnitude: MicroNewtons(0),
            cartesian: [0; 3].map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(0),
            magnitude_sigma: UnsignedMicroNewtons(0),
            place,
            torque: None,
        };
        let place = |x, y| {
            force(Some(Place {
                x: SignedMicrometres(x),
                y: SignedMicrometres(y),
                sigma: Micrometres(1),
            }))
        };
        let truth = |place_x_mm, place_y_mm| Truth {
            alpha_deg: 0.0,
            beta_deg: 0.0,
            magnitude_n: 0.0,
            x_n: 0.0,
            y_n: 0.0,
            z_n: 0.0,
            place_x_mm,
            place_y_mm,
        };
        let mut errors = Errors::default();
        let line = |errors: &Errors| errors.lines()[2].clone();
        errors.count(&force(None), &truth(Some(1.0), Some(1.0)));
        errors.count(&place(5, 5), &truth(None, Some(1.0)));
        assert_eq!(line(&errors), "RMSE of the place: none over 0 frames");
        errors.count(&place(1_003, -1_996), &truth(Some(1.0), Some(-2.0)));
        assert_eq!(line(&errors), "RMSE of the place: 5.0 µm over 1 frames");
        errors.count(&place(0, 7), &truth(Some(0.0), Some(0.0)));
        assert_eq!(line(&errors), "RMSE of the place: 6.1 µm over 2 frames");
    }

    #[test]
    fn counters_end_at_their_largest() {
        let mut tally = Tally::default();
        let most = Rejected {
            overlong: u32::MAX,
            bytes: u32::MAX,
            ..Rejected::default()
        };
        (0..2).for_each(|_| tally.rejected(most));
        assert_eq!(tally.rejected, most);
    }

    #[test]
    fn angles_between_vectors() {
        let angle = |a, b| angle_deg(a, b).unwrap();
        assert!((angle([0.0, 0.0, -2.0], [0.0, 3.0, 0.0]) - 90.0).abs() < 1e-12);
        assert!((angle([1.0, 0.0, 0.0], [1.0, 1e-9, 0.0]) - 1e-9_f64.to_degrees()).abs() < 1e-20);
        assert!((angle([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]) - 180.0).abs() < 1e-12);
        assert_eq!(angle_deg([0.0; 3], [1.0, 0.0, 0.0]), None);
    }
}
