//! A recording as MCAP in ROS 2's profile: what `ros2 bag play`, Foxglove and `PlotJuggler` read,
//! and beside it every message of the device as it came, which `hivtac replay` reads.

use super::ros::{self, Definition};
use hivtac_host::shown::unit_number;
use hivtac_terms::status::Status;
use hivtac_wire::frame::{MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{DeviceHello, DeviceMessage, Sample};
use mcap::records::{MessageHeader, Metadata};
use mcap::{McapResult, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;

/// Bytes of a chunk at most: what a full disk costs at the end.
const CHUNK: u64 = 1 << 18;
/// The frame that forces and places are in: x to the right in the image, y down; a press has z < 0.
const FILM_FRAME: &str = "hivtac_film";
/// The frame of the markers.
const IMAGE_FRAME: &str = "hivtac_image";
/// End of the topic of the device's messages.
pub const WIRE: &str = "/wire";

/// Channels, in the order of [`Bag::create`].
#[derive(Clone, Copy)]
enum Topic {
    Wrench,
    Place,
    Markers,
    Contact,
    Slip,
    Status,
    Wire,
}

/// The file under way.
pub struct Bag {
    writer: Writer<BufWriter<File>>,
    channels: [u16; 7],
    counts: [u32; 7],
    /// Of the first sample: host time, ns since 1970, and device time, µs.
    first: Option<(u64, u64)>,
}

impl Bag {
    /// Begins a file with the device's hello.
    pub fn create(file: File, hello: &DeviceHello, now_ns: u64) -> McapResult<Bag> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("hivtac ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            .compression(None);
        let mut writer = options.create(BufWriter::new(file))?;
        let unit = unit_number(&hello.device_id);
        let topics: [(&str, &Definition); 7] = [
            ("/wrench", &ros::WRENCH),
            ("/place", &ros::POINT),
            ("/markers", &ros::POLYGON),
            ("/contact", &ros::BOOL),
            ("/slip", &ros::BOOL),
            ("/status", &ros::STRING),
            (WIRE, &ros::BYTES),
        ];
        let mut channels = [0; 7];
        for (channel, (topic, definition)) in channels.iter_mut().zip(topics) {
            let text = definition.text.as_bytes();
            let schema = writer.add_schema(definition.name, "ros2msg", text)?;
            let topic = format!("/hivtac/unit_{unit}{topic}");
            *channel = writer.add_channel(schema, &topic, "cdr", &BTreeMap::new())?;
        }
        let mut bag = Bag {
            writer,
            channels,
            counts: [0; 7],
            first: None,
        };
        bag.message(&DeviceMessage::Hello(hello.clone()), now_ns)?;
        Ok(bag)
    }

    /// Keeps a message that came at a time, ns since 1970.
    pub fn message(&mut self, message: &DeviceMessage, now_ns: u64) -> McapResult<()> {
        let mut buffer = [0; MAX_DEVICE_FRAME];
        let stamp_ns = match message {
            DeviceMessage::Sample(sample) => self.stamp_ns(sample, now_ns),
            _ => now_ns,
        };
        if let Ok(frame) = encode(message, &mut buffer) {
            self.write(Topic::Wire, &ros::bytes(frame), now_ns, stamp_ns)?;
        }
        match message {
            DeviceMessage::Sample(sample) => self.sample(sample, now_ns, stamp_ns),
            _ => Ok(()),
        }
    }

    /// When a sample's frame was exposed on the host's clock: by the device's clock since the first
    /// one, which has no jitter.
    fn stamp_ns(&mut self, sample: &Sample, now_ns: u64) -> u64 {
        let (host_ns, device_us) = *self.first.get_or_insert((now_ns, sample.time_us));
        let since_us = sample.time_us.wrapping_sub(device_us) as i64;
        host_ns.saturating_add_signed(since_us.saturating_mul(1_000))
    }

    fn sample(&mut self, sample: &Sample, now_ns: u64, stamp_ns: u64) -> McapResult<()> {
        let Sample {
            force,
            markers,
            status,
            ..
        } = sample;
        if let Some(force) = force {
            let wrench = ros::wrench(stamp_ns, FILM_FRAME, force);
            self.write(Topic::Wrench, &wrench, now_ns, stamp_ns)?;
            if let Some(place) = ros::point(stamp_ns, FILM_FRAME, force) {
                self.write(Topic::Place, &place, now_ns, stamp_ns)?;
            }
            for (topic, bit) in [
                (Topic::Contact, Status::CONTACT),
                (Topic::Slip, Status::SLIP),
            ] {
                let is_set = ros::bool(status.contains(bit));
                self.write(topic, &is_set, now_ns, stamp_ns)?;
            }
        }
        if let Some(markers) = markers {
            let markers = ros::polygon(stamp_ns, IMAGE_FRAME, markers);
            self.write(Topic::Markers, &markers, now_ns, stamp_ns)?;
        }
        let names: Vec<_> = status.names().collect();
        self.write(
            Topic::Status,
            &ros::string(&names.join(" ")),
            now_ns,
            stamp_ns,
        )
    }

    fn write(&mut self, topic: Topic, data: &[u8], now_ns: u64, stamp_ns: u64) -> McapResult<()> {
        let topic = topic as usize;
        let header = MessageHeader {
            channel_id: self.channels[topic],
            sequence: self.counts[topic],
            log_time: now_ns,
            publish_time: stamp_ns,
        };
        self.counts[topic] = self.counts[topic].wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)
    }

    /// Brings to the disk what came so far.
    pub fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Ends the file, with what came of it inside.
    pub fn finish(mut self, summary: BTreeMap<String, String>) -> McapResult<File> {
        self.writer.write_metadata(&Metadata {
            name: "hivtac".to_owned(),
            metadata: summary,
        })?;
        self.writer.finish()?;
        let writer = self.writer.into_inner();
        Ok(writer.into_inner().map_err(|error| error.into_error())?)
    }
}
