//! What the page is told of a sensor beside its samples.

use crate::shown::{shown, to_json, unit_number};
use crate::threshold;
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::DeviceHello;
use serde::Serialize;
use std::collections::BTreeMap;

/// How a sensor stands, as the page reads it.
#[derive(Debug, Serialize)]
pub struct Told {
    /// The port's name.
    pub port: String,
    /// Why there are no samples; nothing while they come.
    pub trouble: Option<String>,
    /// What its user calls it; empty when nothing.
    pub name: String,
    /// Its microcontroller's number.
    pub unit: String,
    /// Its board.
    pub board: String,
    /// Its firmware's version.
    pub firmware: String,
    /// Its model's name.
    pub model: Option<String>,
    /// Whether that is of a simulated sensor.
    pub simulated: bool,
    /// Which pixels are markers.
    pub threshold: Limits,
    /// Those that the model was made for.
    pub model_threshold: Option<Limits>,
    /// Samples a second.
    pub rate_hz: Option<f64>,
    /// Frames and samples that are missing.
    pub lost: u64,
    /// The same by cause.
    pub causes: BTreeMap<&'static str, u64>,
    /// From the exposure to the force, µs.
    pub latency_us: Option<u32>,
    /// From the frame's end to the force, µs.
    pub processing_us: Option<u32>,
    /// How a recording stands.
    pub recording: Recording,
    /// The device's newest lines.
    pub lines: Vec<String>,
    /// What presses anywhere cover, while they are recorded.
    pub coverage: Option<Coverage>,
}

/// How a recording stands.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recording {
    /// Whether a file is under way.
    pub on: bool,
    /// Which, and what came; or what became of the last one.
    pub text: String,
}

/// A threshold as the page reads and writes it.
#[derive(Debug, Serialize)]
pub struct Limits {
    format: &'static str,
    limits: [u8; 6],
    text: String,
}

/// What presses anywhere cover of the film.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Coverage {
    /// One for each range of forces.
    pub maps: Vec<Map>,
    /// What is pressed now, for a person.
    pub now: String,
    /// How much is covered, and what to do next, for a person.
    pub line: String,
}

/// What is covered in a range of forces.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Map {
    /// The range.
    pub name: String,
    /// Places in rows, as the camera sees the film.
    pub places: Vec<Vec<Covered>>,
    /// Row and column of what is pressed now, if it is in this range.
    pub pressed: Option<[usize; 2]>,
}

/// How far a place is covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Covered {
    /// Pressed for long enough.
    Covered,
    /// Pressed, but not for long enough.
    Begun,
    /// Not pressed yet.
    Missing,
    /// Not pressed, and not asked for.
    Unneeded,
}

impl Told {
    /// Who it is; nothing has come of it yet.
    pub fn of(port: &str, hello: &DeviceHello) -> Told {
        let model = hello.model.as_ref();
        Told {
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
            rate_hz: None,
            lost: 0,
            causes: BTreeMap::new(),
            latency_us: None,
            processing_us: None,
            recording: Recording::default(),
            lines: Vec::new(),
            coverage: None,
        }
    }

    /// One JSON object.
    pub fn json(&self) -> String {
        to_json(self)
    }
}

impl Limits {
    /// Of a threshold.
    pub fn of(wanted: &Threshold) -> Limits {
        Limits {
            format: wanted.format().name(),
            limits: wanted.limits(),
            text: threshold::text(wanted),
        }
    }
}
