//! Reads the recordings of `hivtac record`: every message of a device, as it was received.

use crate::failure::Failure;
use crate::shown::{shown, unit_number};
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::DEVICE_FRAME_LIMIT;
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// End of the topic with a device's messages.
pub const WIRE: &str = "/wire";
/// Bytes before the device's in a message of [`WIRE`]: the encoding, and the lengths of an empty
/// layout and of the device's bytes.
pub const BEFORE_BYTES: usize = 16;
/// Longest record of a recording.
const LONGEST_RECORD: usize = 1 << 24;

/// A message with its receive time, ns since 1970.
pub type Kept = (u64, DeviceMessage);

/// A recording that is read from its beginning, for one device.
pub struct Recording {
    /// The file's name.
    pub name: String,
    file: File,
    reader: LinearReader,
    /// The channels with devices' messages.
    channels: Vec<u16>,
    /// The chosen device's channel.
    chosen: Option<u16>,
    /// A message that was read ahead, with its channel.
    waiting: Option<(u16, Kept)>,
    is_over: bool,
    is_cut: bool,
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
        let file = File::open(path)
            .map_err(|error| Failure::input(format!("cannot read {name}: {error}")))?;
        let options = LinearReaderOptions::default().with_record_length_limit(LONGEST_RECORD);
        let mut recording = Recording {
            name,
            file,
            reader: LinearReader::new_with_options(options),
            channels: Vec::new(),
            chosen: None,
            waiting: None,
            is_over: false,
            is_cut: false,
        };
        let mut hellos = recording.hellos()?;
        let index = chosen(&hellos, device).map_err(|why| {
            let name = &recording.name;
            Failure::input(format!("{name}: {why}"))
        })?;
        let (channel, hello) = hellos.swap_remove(index);
        recording.chosen = Some(channel);
        Ok((recording, hello))
    }

    /// The devices' hellos, with which a recording begins, each with its channel.
    fn hellos(&mut self) -> Result<Vec<(u16, DeviceHello)>, Failure> {
        let mut hellos = Vec::new();
        while let Some((channel, kept)) = self.next_of_any()? {
            match kept.1 {
                DeviceMessage::Hello(hello) => hellos.push((channel, hello)),
                _ => {
                    self.waiting = Some((channel, kept));
                    break;
                }
            }
        }
        match hellos.is_empty() {
            true => Err(self.failure("it does not begin with a hello of this release's version")),
            false => Ok(hellos),
        }
    }

    /// The device's next message; `None` at the end, or where a recording was cut.
    ///
    /// # Errors
    /// [`Kind::Input`](crate::failure::Kind::Input) when the file cannot be read.
    pub fn next_message(&mut self) -> Result<Option<Kept>, Failure> {
        while let Some((channel, kept)) = self.next_of_any()? {
            if Some(channel) == self.chosen {
                return Ok(Some(kept));
            }
        }
        Ok(None)
    }

    /// True after the end of a recording that was cut.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// The failure of a recording that cannot be used.
    pub fn failure(&self, why: impl Display) -> Failure {
        let name = &self.name;
        Failure::input(format!("{name} is no recording of `hivtac record`: {why}"))
    }

    /// The next message of any device, with its channel.
    fn next_of_any(&mut self) -> Result<Option<(u16, Kept)>, Failure> {
        if let Some(waiting) = self.waiting.take() {
            return Ok(Some(waiting));
        }
        while !self.is_over {
            let event = match self.reader.next_event() {
                None => break,
                Some(Ok(event)) => event,
                Some(Err(error)) if self.channels.is_empty() => return Err(self.failure(error)),
                Some(Err(_)) => {
                    (self.is_over, self.is_cut) = (true, true);
                    break;
                }
            };
            match event {
                LinearReadEvent::ReadRequest(wanted) => {
                    let read = self.file.read(self.reader.insert(wanted));
                    let read = read.map_err(|error| {
                        let name = &self.name;
                        Failure::input(format!("cannot read {name}: {error}"))
                    })?;
                    self.reader.notify_read(read);
                }
                LinearReadEvent::Record { data, opcode } => {
                    match mcap::parse_record(opcode, data) {
                        Ok(Record::Channel(channel)) if channel.topic.ends_with(WIRE) => {
                            self.channels.push(channel.id);
                        }
                        Ok(Record::Message { header, data })
                            if self.channels.contains(&header.channel_id) =>
                        {
                            if let Some(message) = decoded(&data) {
                                let kept = (header.log_time, message);
                                return Ok(Some((header.channel_id, kept)));
                            }
                        }
                        _ => (),
                    }
                }
            }
        }
        Ok(None)
    }
}

/// The index of the wanted device.
fn chosen(hellos: &[(u16, DeviceHello)], device: Option<&str>) -> Result<usize, String> {
    let number = |hello: &DeviceHello| unit_number(&hello.device_id);
    let is_meant = |hello: &DeviceHello| match device {
        None => true,
        Some(device) => hello.name == device || number(hello) == device.to_lowercase(),
    };
    let meant: Vec<usize> = (0..hellos.len())
        .filter(|&index| is_meant(&hellos[index].1))
        .collect();
    let lines = hellos.iter().map(|(_, hello)| match hello.name.as_str() {
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

/// The message in a kept frame; `None` if its protocol version is different.
fn decoded(data: &[u8]) -> Option<DeviceMessage> {
    let mut frame = data.get(BEFORE_BYTES..)?;
    match Decoder::<DEVICE_FRAME_LIMIT>::new().feed(&mut frame)? {
        Received::Message(message) => Some(message),
        Received::ForeignHello(_) => None,
    }
}
