//! Writes a recording as MCAP in ROS 2's profile, which `ros2 bag play`, Foxglove and `PlotJuggler`
//! read. It also holds every message of the device as received, for `hivtac replay`.

use crate::clock::Clock;
use crate::grip::Reading;
use crate::grip::pair::Pair;
use crate::recording::{HELLO, TYPES, WIRE, to_hex, types};
use crate::ros::channel::{
    Channel, Frames, GRIP_TOPIC, GripChannel, grip_messages, messages, topic_of,
};
use crate::ros::{self, Definition};
use crate::shown::unit_number;
use crate::tally::Tally;
use hivtac_wire::frame::{MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapResult, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::time::Duration;

/// Most bytes of a chunk; a full disk loses at most one chunk at the end.
const CHUNK: u64 = 1 << 18;
/// Topics of a sensor: its channels, and its messages as received.
const TOPICS: usize = Channel::ALL.len() + 1;
/// Index of the topic with the messages as received.
const AS_THEY_CAME: usize = Channel::ALL.len();

/// The file that is being written.
pub struct Bag<W: Write + Seek> {
    writer: Writer<W>,
    frames: Frames,
    sensors: Vec<Topics>,
    grip: Option<GripTopics>,
}

/// The topics of a grip of the first two sensors.
struct GripTopics {
    pair: Pair,
    names: [String; 2],
    numbers: Vec<u16>,
    count: u32,
}

/// The topics of a sensor.
struct Topics {
    numbers: [u16; TOPICS],
    counts: [u32; TOPICS],
    clock: Clock,
}

impl Topics {
    /// The topics of a device: one for each [`Channel`], and that of its messages as received.
    fn create<W: Write + Seek>(writer: &mut Writer<W>, hello: &DeviceHello) -> McapResult<Topics> {
        let unit = unit_number(&hello.device_id);
        let channels = Channel::ALL.iter();
        let channels =
            channels.map(|channel| (format!("/{}", channel.name()), channel.definition()));
        let topics: Vec<(String, &Definition)> =
            channels.chain([(WIRE.to_owned(), &ros::BYTES)]).collect();
        let mut buffer = [0; MAX_DEVICE_FRAME];
        let frame = encode(&DeviceMessage::Hello(hello.clone()), &mut buffer);
        let hello_text = to_hex(frame.as_deref().unwrap_or_default());
        let mut numbers = [0; TOPICS];
        for (number, (topic, definition)) in numbers.iter_mut().zip(topics) {
            let text = definition.text.as_bytes();
            let schema = writer.add_schema(definition.name, "ros2msg", text)?;
            let topic = topic_of(&unit) + &topic;
            let metadata = match topic.ends_with(WIRE) {
                true => BTreeMap::from([
                    (HELLO.to_owned(), hello_text.clone()),
                    (TYPES.to_owned(), types::ours()),
                ]),
                false => BTreeMap::new(),
            };
            *number = writer.add_channel(schema, &topic, "cdr", &metadata)?;
        }
        Ok(Topics {
            numbers,
            counts: [0; TOPICS],
            clock: Clock::default(),
        })
    }
}

/// A message's sensor, its receive time and its measurement time, ns since 1970.
#[derive(Clone, Copy)]
struct When {
    sensor: usize,
    now_ns: u64,
    stamp_ns: u64,
}

impl<W: Write + Seek> Bag<W> {
    /// Begins a file with the devices' hellos.
    ///
    /// # Errors
    /// When the file cannot be written, as the other functions.
    pub fn create(file: W, hellos: &[DeviceHello], now_ns: u64) -> McapResult<Bag<W>> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("hivtac ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            .compression(None);
        let mut writer = options.create(file)?;
        let sensors = hellos
            .iter()
            .map(|hello| Topics::create(&mut writer, hello));
        let mut bag = Bag {
            sensors: sensors.collect::<McapResult<_>>()?,
            frames: Frames::of("hivtac"),
            grip: None,
            writer,
        };
        for (sensor, hello) in hellos.iter().enumerate() {
            bag.message(sensor, &DeviceMessage::Hello(hello.clone()), now_ns)?;
        }
        Ok(bag)
    }

    /// Also writes the grip of the first two sensors, from now on.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn add_grip(&mut self, pair: Pair, names: [String; 2]) -> McapResult<()> {
        let channels = GripChannel::ALL.iter().map(|channel| {
            let definition = channel.definition();
            let text = definition.text.as_bytes();
            let schema = self.writer.add_schema(definition.name, "ros2msg", text)?;
            let topic = format!("{GRIP_TOPIC}/{}", channel.name());
            self.writer
                .add_channel(schema, &topic, "cdr", &BTreeMap::new())
        });
        self.grip = Some(GripTopics {
            numbers: channels.collect::<McapResult<_>>()?,
            pair,
            names,
            count: 0,
        });
        Ok(())
    }

    /// Writes the grips that are known by a sensor's reading.
    fn write_grips(&mut self, sensor: usize, reading: Reading, now_ns: u64) -> McapResult<()> {
        let Some(grip_topics) = self.grip.as_mut().filter(|_| sensor < 2) else {
            return Ok(());
        };
        for grip in grip_topics.pair.push(sensor, reading) {
            let messages = grip_messages(&grip, "hivtac_grip", &grip_topics.names);
            for (channel, data) in messages {
                let header = MessageHeader {
                    channel_id: grip_topics.numbers[channel as usize],
                    sequence: grip_topics.count,
                    log_time: now_ns,
                    publish_time: grip.stamp_ns,
                };
                self.writer.write_to_known_channel(&header, &data)?;
            }
            grip_topics.count = grip_topics.count.wrapping_add(1);
        }
        Ok(())
    }

    /// Writes a sensor's message that was received at `now_ns`, ns since 1970.
    pub fn message(
        &mut self,
        sensor: usize,
        message: &DeviceMessage,
        now_ns: u64,
    ) -> McapResult<()> {
        let mut buffer = [0; MAX_DEVICE_FRAME];
        let stamp_ns = match message {
            DeviceMessage::Sample(sample) => {
                let clock = &mut self.sensors[sensor].clock;
                clock.stamp_ns(sample.time_us, now_ns)
            }
            DeviceMessage::Stats(stats) => {
                self.sensors[sensor].clock.latency(stats.latency_us);
                now_ns
            }
            _ => now_ns,
        };
        let when = When {
            sensor,
            now_ns,
            stamp_ns,
        };
        if let Ok(frame) = encode(message, &mut buffer) {
            self.write(AS_THEY_CAME, &ros::bytes(frame), when)?;
        }
        if let DeviceMessage::Sample(sample) = message {
            for (channel, data) in messages(sample, stamp_ns, &self.frames) {
                self.write(channel as usize, &data, when)?;
            }
            self.write_grips(sensor, Reading::of(sample, stamp_ns, now_ns), now_ns)?;
        }
        Ok(())
    }

    /// Writes a message to one of a sensor's topics.
    fn write(&mut self, topic: usize, data: &[u8], when: When) -> McapResult<()> {
        let sensor = &mut self.sensors[when.sensor];
        let header = MessageHeader {
            channel_id: sensor.numbers[topic],
            sequence: sensor.counts[topic],
            log_time: when.now_ns,
            publish_time: when.stamp_ns,
        };
        sensor.counts[topic] = sensor.counts[topic].wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)
    }

    /// Writes all messages received until now to the disk.
    pub fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Ends the file with a summary of each sensor: metadata `hivtac` for one sensor,
    /// `hivtac/unit_NUMBER` for several.
    pub fn finish(mut self, summaries: Vec<BTreeMap<String, String>>) -> McapResult<W> {
        let is_one = summaries.len() == 1;
        for metadata in summaries {
            let name = match metadata.get("unit").filter(|_| !is_one) {
                None => "hivtac".to_owned(),
                Some(unit) => format!("hivtac/unit_{unit}"),
            };
            self.writer.write_metadata(&Metadata { name, metadata })?;
        }
        self.writer.finish()?;
        Ok(self.writer.into_inner())
    }
}

/// The summary that a file holds about a sensor: its counts, how it `ended`, and how long it
/// `lasted`.
pub fn summary_of(
    hello: &DeviceHello,
    tally: &Tally,
    ended: &str,
    lasted: Duration,
) -> BTreeMap<String, String> {
    let counts = tally.counts().into_iter();
    let counts = counts.map(|(name, count)| (name, count.to_string()));
    let model = hello.model.as_ref();
    let about = [
        ("unit", unit_number(&hello.device_id)),
        ("name", hello.name.to_string()),
        ("ended", ended.to_owned()),
        ("seconds", format!("{:.3}", lasted.as_secs_f64())),
        ("board", hello.board.to_string()),
        ("firmware", hello.firmware.to_string()),
        (
            "model",
            model.map_or("none", |model| &model.name).to_owned(),
        ),
    ];
    let texts = counts.chain(about);
    texts.map(|(name, text)| (name.to_owned(), text)).collect()
}
