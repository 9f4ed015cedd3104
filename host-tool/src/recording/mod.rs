//! Reads the recordings of `hivtac record`: every message of a device, as it was received.

mod records;
pub mod types;

use std::collections::{HashMap, VecDeque};
use std::fmt::Display;
use std::fs::File;
use std::path::Path;

use mcap::records::{self as mcap_records, Record};

use crate::failure::Failure;
use crate::shown::{shown, unit_number};
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::DEVICE_FRAME_LIMIT;
use hivtac_wire::message::{DeviceHello, DeviceMessage};
pub use records::Damage;
use records::{Records, Source};
use types::Types;

/// End of the topic with a device's messages.
pub const WIRE: &str = "/wire";
/// Bytes before the device's in a message of [`WIRE`]: the encoding, and the lengths of an empty
/// layout and of the device's bytes.
pub const BEFORE_BYTES: usize = 16;
/// Name of a [`WIRE`] channel's metadata with the device's hello, in hexadecimal digits: other
/// tools that trim or merge files keep it.
pub const HELLO: &str = "hello";
/// Name of that channel's metadata with the [`types`] of the messages.
pub const TYPES: &str = "types";

/// A message with its receive time, ns since 1970.
pub type Kept = (u64, DeviceMessage);

/// A channel with a device's messages.
struct Topic {
    name: String,
    /// Where another release recorded it: the types of the messages.
    types: Option<Types>,
}

impl Topic {
    fn message(&self, frame: &[u8]) -> Option<DeviceMessage> {
        match &self.types {
            None => decoded(frame),
            Some(types) => types.message(frame),
        }
    }
}

/// A recording that is read from its beginning, for one device.
pub struct Recording {
    /// The file's name.
    pub name: String,
    records: Records,
    /// Records that were read ahead.
    ahead: VecDeque<Record<'static>>,
    /// The channels with devices' messages.
    topics: HashMap<u16, Topic>,
    /// The devices, by their topics.
    devices: Vec<(String, DeviceHello)>,
    /// The chosen device's topic.
    chosen: String,
    /// A message that was read ahead, with its topic.
    waiting: Option<(String, Kept)>,
}

impl Recording {
    /// Opens a recording and chooses a device; returns it with the device's hello. `device` is a
    /// name or serial number, necessary if there are several.
    ///
    /// # Errors
    /// [`Kind::Input`](crate::failure::Kind::Input) when the file cannot be read or is not a
    /// recording of this version, or when the device is missing or not unique.
    pub fn open(path: &Path, device: Option<&str>) -> Result<(Recording, DeviceHello), Failure> {
        let name = path.display().to_string();
        match File::open(path) {
            Ok(file) => Recording::of(name, Box::new(file), device),
            Err(error) => Err(Failure::input(format!("cannot read {name}: {error}"))),
        }
    }

    /// Opens a recording of this name.
    fn of(
        name: String,
        source: Box<dyn Source>,
        device: Option<&str>,
    ) -> Result<(Recording, DeviceHello), Failure> {
        let unreadable = |error| Failure::input(format!("cannot read {name}: {error}"));
        let mut recording = Recording {
            records: Records::new(source).map_err(unreadable)?,
            name: name.clone(),
            ahead: VecDeque::new(),
            topics: HashMap::new(),
            devices: Vec::new(),
            chosen: String::new(),
            waiting: None,
        };
        if !recording.records.is_mcap().map_err(unreadable)? {
            return Err(recording.failure("it is no MCAP file"));
        }
        for channel in recording.records.summary().map_err(unreadable)? {
            recording.add(channel);
        }
        recording.find_devices()?;
        let hellos: Vec<_> = recording.devices.iter().map(|(_, hello)| hello).collect();
        let index = chosen(&hellos, device)
            .map_err(|why| Failure::input(format!("{}: {why}", recording.name)))?;
        let (topic, hello) = recording.devices.swap_remove(index);
        recording.chosen = topic;
        Ok((recording, hello))
    }

    /// Reads up to the first message of a known device. A file that other tools trimmed may have
    /// none of the hellos with which a recording begins; then their channels have them.
    fn find_devices(&mut self) -> Result<(), Failure> {
        while let Some((topic, kept)) = self.next_of_any()? {
            match kept.1 {
                DeviceMessage::Hello(hello) => self.add_device(topic, hello),
                _ if self.devices.is_empty() => (),
                _ => {
                    self.waiting = Some((topic, kept));
                    break;
                }
            }
        }
        match (self.devices.is_empty(), self.topics.is_empty()) {
            (false, _) => Ok(()),
            (true, true) => Err(self.failure("it has no topic /wire with a device's messages")),
            (true, false) => Err(self.failure(
                "it has no hello of this release's version: another release recorded it, or its \
                 beginning was cut away",
            )),
        }
    }

    fn add(&mut self, channel: mcap_records::Channel) {
        if !channel.topic.ends_with(WIRE) {
            return;
        }
        let mut topic = Topic {
            name: channel.topic,
            types: None,
        };
        let hello = channel.metadata.get(HELLO).and_then(|text| from_hex(text));
        if let Some(frame) = hello {
            if decoded(&frame).is_none() {
                let types = channel.metadata.get(TYPES);
                topic.types = types.and_then(|text| Types::parse(text));
            }
            if let Some(DeviceMessage::Hello(hello)) = topic.message(&frame) {
                self.add_device(topic.name.clone(), hello);
            }
        }
        self.topics.insert(channel.id, topic);
    }

    fn add_device(&mut self, topic: String, hello: DeviceHello) {
        if self.devices.iter().all(|(known, _)| *known != topic) {
            self.devices.push((topic, hello));
        }
    }

    /// The device's next message; `None` at the end, or where a recording was cut. Damaged parts
    /// are skipped.
    ///
    /// # Errors
    /// [`Kind::Input`](crate::failure::Kind::Input) when the file cannot be read.
    pub fn next_message(&mut self) -> Result<Option<Kept>, Failure> {
        while let Some((topic, kept)) = self.next_of_any()? {
            if topic == self.chosen && !matches!(kept.1, DeviceMessage::Hello(_)) {
                return Ok(Some(kept));
            }
        }
        Ok(None)
    }

    /// True after the end of a recording that was cut.
    pub fn is_cut(&self) -> bool {
        self.records.is_cut
    }

    /// The damaged parts that were skipped until now.
    pub fn damage(&self) -> &[Damage] {
        &self.records.damage
    }

    /// The failure of a recording that cannot be used.
    pub fn failure(&self, why: impl Display) -> Failure {
        let name = &self.name;
        Failure::input(format!("{name} is no recording of `hivtac record`: {why}"))
    }

    /// The next message of any device, with its topic.
    fn next_of_any(&mut self) -> Result<Option<(String, Kept)>, Failure> {
        if let Some(waiting) = self.waiting.take() {
            return Ok(Some(waiting));
        }
        loop {
            match self.ahead.pop_front() {
                Some(Record::Channel(channel)) => self.add(channel),
                Some(Record::Message { header, data }) => {
                    let topic = self.topics.get(&header.channel_id);
                    let message = topic
                        .zip(data.get(BEFORE_BYTES..))
                        .and_then(|(topic, frame)| Some((topic, topic.message(frame)?)));
                    if let Some((topic, message)) = message {
                        return Ok(Some((topic.name.clone(), (header.log_time, message))));
                    }
                }
                Some(_) => (),
                None => match self.records.next() {
                    Ok(Some(records)) => self.ahead = records.into(),
                    Ok(None) => return Ok(None),
                    Err(error) => {
                        let name = &self.name;
                        return Err(Failure::input(format!("cannot read {name}: {error}")));
                    }
                },
            }
        }
    }
}

/// The text of a hello in a channel's metadata.
pub fn to_hex(frame: &[u8]) -> String {
    frame.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn from_hex(text: &str) -> Option<Vec<u8>> {
    let (pairs, rest) = text.as_bytes().as_chunks::<2>();
    let byte = |pair: &[u8; 2]| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok();
    rest.is_empty().then(|| pairs.iter().map(byte).collect())?
}

/// The index of the wanted device.
fn chosen(hellos: &[&DeviceHello], device: Option<&str>) -> Result<usize, String> {
    let number = |hello: &DeviceHello| unit_number(&hello.device_id);
    let is_meant = |hello: &DeviceHello| match device {
        None => true,
        Some(device) => hello.name == device || number(hello) == device.to_lowercase(),
    };
    let meant: Vec<usize> = (0..hellos.len())
        .filter(|&index| is_meant(hellos[index]))
        .collect();
    let lines = hellos.iter().map(|hello| match hello.name.as_str() {
        "" => number(hello),
        name => format!("{} {}", number(hello), shown(name)),
    });
    let all = lines.collect::<Vec<_>>().join(", ");
    match (&meant[..], device) {
        ([index], _) => Ok(*index),
        ([], device) => Err(format!(
            "it has no sensor with the name or serial number {}; it has {all}",
            shown(device.unwrap_or_default())
        )),
        (_, None) => Err(format!(
            "it has more than one sensor; choose one with --device: {all}"
        )),
        (_, Some(name)) => Err(format!(
            "more than one of its sensors is called {}; choose by serial number: {all}",
            shown(name)
        )),
    }
}

/// The message in a frame; `None` if its protocol version is different.
fn decoded(mut frame: &[u8]) -> Option<DeviceMessage> {
    match Decoder::<DEVICE_FRAME_LIMIT>::new().feed(&mut frame)? {
        Received::Message(message) => Some(message),
        Received::ForeignHello(_) => None,
    }
}

#[cfg(test)]
mod tests;
