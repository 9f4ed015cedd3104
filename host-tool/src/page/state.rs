//! The state of a device: identity, connection, rate, losses and latency.

use super::{Recording, SensorState};
use crate::contact_shape;
use crate::reply::log_text;
use crate::tally::Tally;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_wire::message::{DeviceHello, DeviceMessage, LogLine, Sample, Stats};
use std::collections::VecDeque;

/// Number of samples from which the rate is computed.
const RATE_OF: usize = 256;
/// Number of the device's lines that are shown.
const LINES: usize = 8;

/// All data about a device except its samples.
pub struct State {
    /// The port's name.
    pub port: String,
    /// The device's last hello.
    pub hello: DeviceHello,
    /// Why samples are missing; `None` while they come.
    pub trouble: Option<String>,
    /// Losses since the start of the program.
    pub tally: Tally,
    times_us: VecDeque<u64>,
    /// The device's newest counters.
    pub stats: Option<Stats>,
    lines: VecDeque<String>,
    /// The contact's shape; `None` until the device sent its settings.
    pub contact_shape: Option<ContactShape>,
    /// The grip of this sensor and another, for a person; `None` without one.
    pub grip: Option<String>,
}

impl State {
    /// The state of a connected device.
    pub fn new(port: String, hello: DeviceHello) -> State {
        State {
            port,
            hello,
            trouble: None,
            tally: Tally::default(),
            times_us: VecDeque::new(),
            stats: None,
            lines: VecDeque::new(),
            contact_shape: None,
            grip: None,
        }
    }

    /// Handles a device's message.
    pub fn take(&mut self, message: &DeviceMessage) {
        match message {
            DeviceMessage::Sample(sample) => self.sample(sample),
            DeviceMessage::Stats(stats) => {
                self.tally.stats(stats);
                self.stats = Some(*stats);
            }
            DeviceMessage::Hello(hello) => self.hello = hello.clone(),
            DeviceMessage::Log(line) => self.line(line),
            DeviceMessage::Settings(report) => {
                self.contact_shape = Some(report.contact_shape);
            }
            _ => (),
        }
    }

    fn sample(&mut self, sample: &Sample) {
        self.tally.sample(sample);
        self.trouble = None;
        let newest = self.times_us.back().copied().unwrap_or(0);
        if sample.time_us < newest {
            // The device restarted, and so did its clock.
            self.times_us.clear();
        }
        if self.times_us.len() == RATE_OF {
            self.times_us.pop_front();
        }
        self.times_us.push_back(sample.time_us);
    }

    fn line(&mut self, line: &LogLine) {
        if self.lines.len() == LINES {
            self.lines.pop_front();
        }
        self.lines.push_back(log_text(line));
    }

    /// Notes that the connection is lost or the device is silent.
    pub fn trouble(&mut self, why: String) {
        self.trouble = Some(why);
        self.times_us.clear();
    }

    /// Notes that the device is connected again.
    pub fn connected_again(&mut self, hello: DeviceHello) {
        self.tally.connected_again();
        self.hello = hello;
    }

    /// Samples a second, by the device's clock.
    pub fn rate_hz(&self) -> Option<f64> {
        let (first, last) = self.times_us.front().zip(self.times_us.back())?;
        let steps = self.times_us.len().checked_sub(1)?;
        (last > first).then(|| steps as f64 * 1e6 / (last - first) as f64)
    }

    /// One JSON object; `recording` is the state of the page's recording.
    pub fn json(&self, recording: Recording) -> String {
        let state = SensorState {
            trouble: self.trouble.clone(),
            contact: self.contact_shape.map(contact_shape::text),
            rate_hz: self.rate_hz(),
            lost: self.tally.lost(),
            causes: self.tally.causes(),
            latency_us: self.stats.map(|stats| stats.latency_us),
            processing_us: self.stats.map(|stats| stats.processing_us),
            recording,
            grip: self.grip.clone(),
            lines: self.lines.iter().cloned().collect(),
            ..SensorState::of(&self.port, &self.hello)
        };
        state.json()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::conditions::CentroidEstimator;
    use hivtac_terms::force::ContactList;
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::status::Status;
    use hivtac_terms::threshold::HsvBox;

    fn state() -> State {
        let hello = DeviceHello {
            protocol: 2,
            schema: 0,
            device_id: [7; 12],
            board: "<b>\u{1b}[2J".try_into().unwrap(),
            firmware: "fake".try_into().unwrap(),
            model: None,
            width: 320,
            height: 240,
            threshold: HsvBox::RED.into(),
            preset: "ov7725".try_into().unwrap(),
            dilations: 1,
            centroid: CentroidEstimator::BinaryMask,
            name: "\u{9b}thumb".try_into().unwrap(),
            filter: Default::default(),
        };
        State::new("a port".to_owned(), hello)
    }

    fn sample(number: u32, time_us: u64) -> DeviceMessage {
        DeviceMessage::Sample(Sample {
            sequence: number,
            frame: number,
            time_us,
            status: Status::OK,
            force: None,
            contacts: ContactList::default(),
            markers: MarkerList::default(),
        })
    }

    fn json(state: &State) -> serde_json::Value {
        serde_json::from_str(&state.json(Recording::default())).unwrap()
    }

    #[test]
    fn the_rate_is_that_of_the_devices_clock() {
        let mut state = state();
        assert!(json(&state)["rate_hz"].is_null());
        let frames = 0..600_u32;
        frames.for_each(|n| state.take(&sample(n, 5_000 * u64::from(n))));
        assert_eq!(json(&state)["rate_hz"], 200.0);
        // The device restarts, at another rate.
        (0..3).for_each(|n| state.take(&sample(n, 10_000 * u64::from(n))));
        assert_eq!(json(&state)["rate_hz"], 100.0);
    }

    #[test]
    fn trouble_is_over_with_the_next_sample() {
        let mut state = state();
        state.take(&sample(1, 1));
        state.trouble("pulled".to_owned());
        assert_eq!(json(&state)["trouble"], "pulled");
        state.take(&sample(9, 2));
        let reported = json(&state);
        assert_eq!(
            (&reported["trouble"], &reported["lost"]),
            (&().into(), &7.into())
        );
    }

    #[test]
    fn the_devices_texts_act_on_nothing_and_are_bounded() {
        let mut state = state();
        for _ in 0..100 {
            state.take(&DeviceMessage::Log(LogLine {
                level: hivtac_wire::message::LogLevel::Info,
                time_us: 0,
                text: "\u{202e}x".try_into().unwrap(),
            }));
        }
        let reported = json(&state);
        assert_eq!(reported["board"], r"<b>\u{1b}[2J");
        assert_eq!(reported["name"], r"\u{9b}thumb");
        assert_eq!(reported["lines"].as_array().unwrap().len(), LINES);
        assert_eq!(reported["lines"][0], r"device, 0.000 s, info: \u{202e}x");
    }
}
