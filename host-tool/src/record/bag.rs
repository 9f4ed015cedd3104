//! A recording as MCAP in ROS 2's profile: what `ros2 bag play`, Foxglove and `PlotJuggler` read,
//! and beside it every message of the device as it came, which `hivtac replay` reads.

use super::ros::{self, Definition};
use hivtac_host::recording::WIRE;
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

/// Channels, in the order of [`Topics::create`].
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
    sensors: Vec<Topics>,
}

/// The topics of a sensor.
struct Topics {
    channels: [u16; 7],
    counts: [u32; 7],
    /// Of the first sample: host time, ns since 1970, and device time, µs.
    first: Option<(u64, u64)>,
}

impl Topics {
    /// Those of a device, in their order as [`Topic`] has them.
    fn create(writer: &mut Writer<BufWriter<File>>, hello: &DeviceHello) -> McapResult<Topics> {
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
        Ok(Topics {
            channels,
            counts: [0; 7],
            first: None,
        })
    }

    /// When a sample's frame was exposed on the host's clock: by the device's clock since the first
    /// one, which has no jitter.
    fn stamp_ns(&mut self, sample: &Sample, now_ns: u64) -> u64 {
        let (host_ns, device_us) = *self.first.get_or_insert((now_ns, sample.time_us));
        let since_us = sample.time_us.wrapping_sub(device_us) as i64;
        host_ns.saturating_add_signed(since_us.saturating_mul(1_000))
    }
}

/// When a message came, and when what it tells was, ns since 1970; and of which sensor it is.
#[derive(Clone, Copy)]
struct When {
    sensor: usize,
    now_ns: u64,
    stamp_ns: u64,
}

impl Bag {
    /// Begins a file with the devices' hellos.
    pub fn create(file: File, hellos: &[DeviceHello], now_ns: u64) -> McapResult<Bag> {
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("hivtac ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            .compression(None);
        let mut writer = options.create(BufWriter::new(file))?;
        let sensors = hellos
            .iter()
            .map(|hello| Topics::create(&mut writer, hello));
        let mut bag = Bag {
            sensors: sensors.collect::<McapResult<_>>()?,
            writer,
        };
        for (sensor, hello) in hellos.iter().enumerate() {
            bag.message(sensor, &DeviceMessage::Hello(hello.clone()), now_ns)?;
        }
        Ok(bag)
    }

    /// Keeps a message of a sensor that came at a time, ns since 1970.
    pub fn message(
        &mut self,
        sensor: usize,
        message: &DeviceMessage,
        now_ns: u64,
    ) -> McapResult<()> {
        let mut buffer = [0; MAX_DEVICE_FRAME];
        let stamp_ns = match message {
            DeviceMessage::Sample(sample) => self.sensors[sensor].stamp_ns(sample, now_ns),
            _ => now_ns,
        };
        let when = When {
            sensor,
            now_ns,
            stamp_ns,
        };
        if let Ok(frame) = encode(message, &mut buffer) {
            self.write(Topic::Wire, &ros::bytes(frame), when)?;
        }
        match message {
            DeviceMessage::Sample(sample) => self.sample(sample, when),
            _ => Ok(()),
        }
    }

    fn sample(&mut self, sample: &Sample, when: When) -> McapResult<()> {
        let Sample {
            force,
            markers,
            status,
            ..
        } = sample;
        let stamp_ns = when.stamp_ns;
        if let Some(force) = force {
            let wrench = ros::wrench(stamp_ns, FILM_FRAME, force);
            self.write(Topic::Wrench, &wrench, when)?;
            if let Some(place) = ros::point(stamp_ns, FILM_FRAME, force) {
                self.write(Topic::Place, &place, when)?;
            }
            for (topic, bit) in [
                (Topic::Contact, Status::CONTACT),
                (Topic::Slip, Status::SLIP),
            ] {
                self.write(topic, &ros::bool(status.contains(bit)), when)?;
            }
        }
        if let Some(markers) = markers {
            let markers = ros::polygon(stamp_ns, IMAGE_FRAME, markers);
            self.write(Topic::Markers, &markers, when)?;
        }
        let names: Vec<_> = status.names().collect();
        self.write(Topic::Status, &ros::string(&names.join(" ")), when)
    }

    fn write(&mut self, topic: Topic, data: &[u8], when: When) -> McapResult<()> {
        let topic = topic as usize;
        let sensor = &mut self.sensors[when.sensor];
        let header = MessageHeader {
            channel_id: sensor.channels[topic],
            sequence: sensor.counts[topic],
            log_time: when.now_ns,
            publish_time: when.stamp_ns,
        };
        sensor.counts[topic] = sensor.counts[topic].wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)
    }

    /// Brings to the disk what came so far.
    pub fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Ends the file, with what came of each sensor inside: metadata `hivtac` of one, and
    /// `hivtac/unit_NUMBER` of several.
    pub fn finish(mut self, summaries: Vec<BTreeMap<String, String>>) -> McapResult<File> {
        let is_one = summaries.len() == 1;
        for metadata in summaries {
            let name = match metadata.get("unit").filter(|_| !is_one) {
                None => "hivtac".to_owned(),
                Some(unit) => format!("hivtac/unit_{unit}"),
            };
            self.writer.write_metadata(&Metadata { name, metadata })?;
        }
        self.writer.finish()?;
        let writer = self.writer.into_inner();
        Ok(writer.into_inner().map_err(|error| error.into_error())?)
    }
}
