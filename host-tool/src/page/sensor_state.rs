//! The state of a sensor that the page shows in addition to its samples.

use crate::shown::{shown, to_json, unit_number};
use crate::threshold;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::DeviceHello;
use serde::Serialize;
use std::collections::BTreeMap;

/// A sensor's state, as the page reads it.
#[derive(Debug, Serialize)]
pub struct SensorState {
    /// The port's name.
    pub port: String,
    /// Why samples are missing; `None` while they come.
    pub trouble: Option<String>,
    /// The name that its user set; empty if not set.
    pub name: String,
    /// Its microcontroller's number.
    pub unit: String,
    /// Its board.
    pub board: String,
    /// Its firmware's version.
    pub firmware: String,
    /// Its model's name.
    pub model: Option<String>,
    /// Whether the model is of a simulated sensor.
    pub simulated: bool,
    /// The threshold in use.
    pub threshold: Limits,
    /// The threshold that the model was made for.
    pub model_threshold: Option<Limits>,
    /// The contact's shape, as `hivtac settings` writes it; `None` until the device sent it.
    pub contact: Option<String>,
    /// Samples a second.
    pub rate_hz: Option<f64>,
    /// Number of missing frames and samples.
    pub lost: u64,
    /// Number of missing frames and samples, by cause.
    pub causes: BTreeMap<&'static str, u64>,
    /// From the exposure to the force, µs.
    pub latency_us: Option<u32>,
    /// From the frame's end to the force, µs.
    pub processing_us: Option<u32>,
    /// The state of a recording.
    pub recording: Recording,
    /// The newest lines that the device logged.
    pub lines: Vec<String>,
    /// The coverage of free presses, while these are recorded.
    pub coverage: Option<Coverage>,
    /// The grip of this sensor and another, for a person; `None` without one.
    pub grip: Option<String>,
}

/// The state of a recording.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recording {
    /// Whether a file is being written.
    pub on: bool,
    /// The file and what it holds; or the result of the last file.
    pub text: String,
}

/// A threshold, as the page reads and writes it.
#[derive(Debug, Serialize)]
pub struct Limits {
    format: &'static str,
    limits: [u8; 6],
    text: String,
}

/// The part of the film that free presses cover.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Coverage {
    /// One for each range of forces.
    pub maps: Vec<Map>,
    /// The present press, for a person.
    pub now: String,
    /// The coverage and the next action, for a person.
    pub line: String,
}

/// The coverage in a range of forces.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Map {
    /// The range.
    pub name: String,
    /// The places, row by row, as the camera sees the film.
    pub places: Vec<Vec<Covered>>,
    /// Row and column of the present press; `None` if it is not in this range.
    pub pressed: Option<[usize; 2]>,
}

/// The coverage of a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Covered {
    /// Pressed for long enough.
    Covered,
    /// Pressed, but not for long enough.
    Begun,
    /// Not pressed yet.
    Missing,
    /// Not pressed, and not necessary.
    Unneeded,
}

impl SensorState {
    /// The identity of a device, before it has sent anything else.
    pub fn of(port: &str, hello: &DeviceHello) -> SensorState {
        let model = hello.model.as_ref();
        SensorState {
            port: port.to_owned(),
            trouble: None,
            name: shown(&hello.name),
            unit: unit_number(&hello.device_id),
            board: shown(&hello.board),
            firmware: shown(&hello.firmware),
            model: model.map(|model| shown(&model.name)),
            simulated: model.is_some_and(|model| model.simulated),
            threshold: Limits::of(&hello.threshold),
            model_threshold: model.map(|model| Limits::of(&model.threshold)),
            contact: None,
            rate_hz: None,
            lost: 0,
            causes: BTreeMap::new(),
            latency_us: None,
            processing_us: None,
            recording: Recording::default(),
            lines: Vec::new(),
            coverage: None,
            grip: None,
        }
    }

    /// One JSON object.
    pub fn json(&self) -> String {
        to_json(self)
    }
}

impl Limits {
    /// The limits of a threshold.
    pub fn of(wanted: &Threshold) -> Limits {
        Limits {
            format: wanted.format().name(),
            limits: wanted.limits(),
            text: threshold::text(wanted),
        }
    }
}
