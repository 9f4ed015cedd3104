//! The device: frames and a host's bytes in, messages out, as `docs/wire.md` says.
//!
//! One thread does the work of a chip's several tasks, so nothing is busy for long. Kept data last
//! until the program ends.

mod commands;
mod tares;
#[cfg(test)]
mod tests;

use super::camera::{Camera, Kind};
use super::outbox::Outbox;
use hivtac_portable::device::answer::{self, Identity, text};
use hivtac_portable::device::kept::Keeper;
use hivtac_portable::device::model::{self, Fitting};
use hivtac_portable::device::settings::{InUse, OfPipeline, known};
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::{Measurement, Sensor, Work};
use hivtac_sensor::temporal::{Followed, Moment};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::Threshold;
use hivtac_twin::Layout;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::HOST_FRAME_LIMIT;
use hivtac_wire::kept::Record;
use hivtac_wire::message::{
    DeviceHello, DeviceMessage, HostMessage, LogLevel, LogLine, ModelSource, Outcome, Snapshot,
    Stats,
};
use hivtac_wire::settings::{Found, Name};
use hivtac_wire::version::HelloPrefix;
use tares::Taring;

/// Name of the board in the hello.
pub const BOARD: &str = "twin";
/// Time between two counters while streaming, µs.
const STATS_PERIOD_US: u64 = 1_000_000;

/// A captured frame.
#[derive(Clone, Debug)]
pub struct Captured {
    /// Number of the frame, from 1.
    pub number: u32,
    /// When it began, µs.
    pub begun_us: u64,
    /// The camera that took it.
    pub camera: Camera,
    /// Its pixels, as they lie in the device's memory: two bytes each, or two pixels of mono.
    pub words: Vec<u16>,
}

/// A simulated device.
#[derive(Debug)]
pub struct Device {
    sensor: Box<Sensor<'static>>,
    fitting: Fitting,
    /// The file of the built-in model.
    built_in: &'static [u8],
    source: ModelSource,
    camera: Camera,
    /// Brightness of the light on the film, 1 is nominal; automatic exposure suits it.
    light: f64,
    record: Record,
    name: Name,
    down: Down,
    contact_shape: ContactShape,
    /// A conversation is open.
    is_open: bool,
    streams: bool,
    with_markers: bool,
    decoder: Decoder<HOST_FRAME_LIMIT>,
    out: Outbox,
    /// The command that waits for the next frame.
    snapshot: Option<u16>,
    taring: Option<Taring>,
    /// Bytes of a model that is being received, and its length.
    upload: Option<(usize, Vec<u8>)>,
    /// A threshold of other pixels, until such a frame comes, and the command to reply to.
    next_threshold: Option<(u16, Threshold)>,
    stats: Stats,
    /// When the counters were last sent, µs.
    stats_sent_us: u64,
    now_us: u64,
    sequence: u32,
}

impl Device {
    /// A new device for a film with these dots, in light of a brightness; 1 is nominal.
    pub fn new(kind: Kind, layout: Layout, device_id: [u8; 12], light: f64) -> Self {
        // The project's own files: a test reads them.
        Self::with_model(kind, kind.model(layout), device_id, light)
    }

    /// As [`Device::new`], with another model as the built-in one. One that does not fit is left
    /// out.
    pub fn with_model(
        kind: Kind,
        built_in: &'static [u8],
        device_id: [u8; 12],
        light: f64,
    ) -> Self {
        let fitting = kind.fitting(device_id);
        let model = Model::parse(built_in).ok();
        let mut sensor = Box::new(Sensor::<64>::new());
        let settings = fitting.settings(model.as_ref(), None);
        let pixels = settings.threshold.format();
        let record = Record::default();
        // The built-in settings are in range.
        let configured = sensor.configure(settings, model);
        debug_assert!(configured.is_ok());
        sensor.set_motion(kind.motion());
        model::start(&mut sensor, &record, |_| {});
        Self {
            sensor,
            fitting,
            built_in,
            source: ModelSource::BuiltIn,
            camera: Camera::new(kind, pixels, record.camera, light),
            light,
            name: Name::new(),
            down: Down::default(),
            contact_shape: ContactShape::default(),
            record,
            is_open: false,
            streams: false,
            with_markers: false,
            decoder: Decoder::new(),
            out: Outbox::default(),
            snapshot: None,
            taring: None,
            upload: None,
            next_threshold: None,
            stats: Stats::default(),
            stats_sent_us: 0,
            now_us: 0,
            sequence: 0,
        }
    }

    /// The camera as it is set now: its next frame must be taken so.
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// Tells the brightness of the light, which automatic exposure suits when a host next asks for
    /// it.
    pub fn set_light(&mut self, light: f64) {
        self.light = light;
    }

    /// Takes bytes of the host, at a time in µs since the start.
    pub fn receive(&mut self, mut bytes: &[u8], now_us: u64) {
        self.now_us = now_us;
        while let Some(message) = self.decoder.feed(&mut bytes) {
            self.handle(message);
        }
        self.stats.host_frames_rejected = self.decoder.rejected().frames();
    }

    /// Ends the conversation: the host is gone.
    pub fn hang_up(&mut self) {
        self.decoder.reset();
        self.begin(false);
    }

    /// Takes the next message for the host; `None` if none waits.
    pub fn message(&mut self) -> Option<DeviceMessage> {
        self.out.take()
    }

    /// Call when a message could not be sent whole, because the host does not read.
    pub fn cut(&mut self, message: &DeviceMessage) {
        match message {
            DeviceMessage::Sample(_) => self.stats.usb_dropped += 1,
            DeviceMessage::Snapshot(_) | DeviceMessage::SnapshotPart(_) => {
                self.out.give_up_snapshot();
            }
            _ => {}
        }
    }

    fn handle(&mut self, message: Received<HostMessage>) {
        match message {
            Received::Message(HostMessage::Hello(hello)) => self.greet(HelloPrefix {
                protocol: hello.protocol,
                schema: hello.schema,
            }),
            Received::ForeignHello(prefix) => self.greet(prefix),
            // Before a hello, and after one of another version, commands are ignored.
            Received::Message(HostMessage::Command(command)) if self.is_open => self.obey(command),
            Received::Message(HostMessage::Down(down)) if self.is_open => self.down = known(down),
            Received::Message(HostMessage::Command(_) | HostMessage::Down(_)) => {}
        }
    }

    fn greet(&mut self, prefix: HelloPrefix) {
        self.begin(prefix.is_ours());
        let hello = self.hello();
        self.out.answer(DeviceMessage::Hello(hello));
    }

    /// Begins a conversation; nothing of an earlier one goes on.
    fn begin(&mut self, understood: bool) {
        (self.is_open, self.streams) = (understood, false);
        self.out.clear();
        (self.snapshot, self.taring, self.upload) = (None, None, None);
    }

    /// The device's hello.
    pub fn hello(&self) -> DeviceHello {
        let identity = Identity {
            device_id: self.fitting.device_id,
            board: BOARD,
            camera: self.camera.kind.name(),
            program: format_args!("hivtac {}", env!("CARGO_PKG_VERSION")),
            preset: self.fitting.preset,
            geometry: self.fitting.geometry,
        };
        answer::hello(&identity, Some(self.of_pipeline()), self.name.clone())
    }

    fn of_pipeline(&self) -> OfPipeline {
        OfPipeline::of(&self.sensor, self.source)
    }

    fn in_use(&self) -> InUse {
        let name = self.name.clone();
        InUse::of(self.of_pipeline(), name, self.down, self.contact_shape)
    }

    fn keeper(&self) -> Keeper {
        Keeper {
            found: Found::Nothing,
            erases: 0,
            failures: 0,
        }
    }

    fn say(&mut self, level: LogLevel, line: std::fmt::Arguments<'_>) {
        if self.is_open {
            self.out.answer(DeviceMessage::Log(LogLine {
                level,
                time_us: self.now_us,
                text: text(line),
            }));
        }
    }

    /// Counts frames that were not taken, because this computer was busy.
    pub fn missed(&mut self, frames: u32) {
        self.stats.frames_exposed += frames;
        self.stats.dropped_busy += frames;
        self.sensor.miss_frames(frames);
    }

    /// Measures a frame. `missed` says that frames before it are missing, `now` the time in µs
    /// since the start.
    pub fn frame(&mut self, frame: &Captured, missed: bool, now: impl Fn() -> u64) {
        let now_us = now();
        self.now_us = now_us;
        self.stats.frames_exposed = frame.number;
        if frame.camera.pixels != self.sensor.threshold().format() {
            self.change_format(frame);
        }
        self.sensor.set_down(self.down);
        self.sensor.set_contact_shape(self.contact_shape);
        let mut measurement = self.sensor.measure_frame(&frame.words);
        (self.sensor).follow_two_contacts(&mut measurement, Work::OF_A_FRAME);
        if self.taring.is_none() {
            measurement = self.sensor.measure_again(&frame.words, measurement);
        }
        let time_us = frame
            .begun_us
            .saturating_add_signed(frame.camera.middle_us().into());
        let moment = Moment {
            frame: frame.number,
            time_us,
        };
        let followed = self.sensor.follow(moment, &measurement);
        self.stats.processing_us = now().saturating_sub(now_us) as u32;
        self.stats.latency_us = now_us.saturating_sub(time_us) as u32;
        self.stats.frames_processed += 1;
        self.stats.uptime_us = now_us;
        self.stream(moment, missed, &measurement, &followed);
        self.tare_with(&measurement);
        self.take_snapshot(frame, time_us);
    }

    /// Uses the threshold that waited for these pixels. Markers have other areas in them, so the
    /// rest position is discarded.
    fn change_format(&mut self, frame: &Captured) {
        let waiting = self.next_threshold.take();
        let threshold = match waiting {
            Some((_, threshold)) => threshold,
            None => Threshold::red(frame.camera.pixels),
        };
        // It was checked when it came.
        let _ = self.sensor.set_threshold(threshold);
        self.sensor.set_tare(None, Drift::NONE);
        self.give_up_tare();
        self.sensor.forget_frame();
        if let Some((id, _)) = waiting {
            self.out.reply(id, Outcome::Done);
        }
    }

    fn stream(
        &mut self,
        moment: Moment,
        missed: bool,
        measurement: &Measurement,
        followed: &Followed,
    ) {
        if !self.streams {
            return;
        }
        self.sequence = self.sequence.wrapping_add(1);
        let on_the_way = match missed {
            true => Status::FRAME_DROPPED,
            false => Status::OK,
        };
        let sample = answer::sample(
            self.sequence,
            moment,
            on_the_way,
            measurement,
            followed,
            self.with_markers,
        );
        if !self.out.sample(sample) {
            self.stats.usb_dropped += 1;
        }
        if self.now_us - self.stats_sent_us >= STATS_PERIOD_US {
            self.stats_sent_us = self.now_us;
            self.out.answer(DeviceMessage::Stats(self.stats));
        }
    }

    fn take_snapshot(&mut self, frame: &Captured, time_us: u64) {
        let Some(id) = self.snapshot.take() else {
            return;
        };
        let bytes: Vec<u8> = (frame.words.iter())
            .flat_map(|word| word.to_le_bytes())
            .collect();
        let header = Snapshot {
            frame: frame.number,
            time_us,
            width: self.fitting.geometry.width,
            height: self.fitting.geometry.height,
            threshold: self.sensor.threshold(),
            bytes: bytes.len() as u32,
        };
        self.out.snapshot(id, header, bytes);
    }
}
