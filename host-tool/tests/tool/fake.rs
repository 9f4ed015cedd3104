//! A simulated device that follows a script, on TCP or on a pseudo-terminal.

use hivtac_terms::camera::{CameraLimits, CameraSettings, RateLimits};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::Down;
use hivtac_terms::fixed::Q;
use hivtac_terms::force::{ContactList, Force, Place};
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{Filter, TemporalSettings};
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Microseconds, MilliDegrees, Px, SignedMicrometres, Sixteenths,
    UnsignedMicroNewtons, UnsignedMilliDegrees,
};
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::{HOST_FRAME_LIMIT, MAX_DEVICE_FRAME, encode};
use hivtac_wire::health::{BrownOut, Health, ResetReason};
use hivtac_wire::message::*;
use hivtac_wire::settings::*;
use hivtac_wire::version::SCHEMA_HASH;
use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::mpsc;

pub trait Stream: Read + Write + Send {}
impl<T: Read + Write + Send> Stream for T {}

/// The device's end of one connection.
pub struct Conversation {
    stream: Box<dyn Stream>,
    decoder: Decoder<HOST_FRAME_LIMIT>,
    pub stats: Stats,
    /// The commands that were received, for the test's checks.
    pub commands: mpsc::Sender<Request>,
    /// The reply to a tare; `None` for no reply.
    pub tare: Option<Outcome>,
    /// Its hello.
    pub hello: DeviceHello,
    /// Its settings.
    pub settings: SettingsReport,
    /// Its health.
    pub health: Health,
    /// The outcome of keeping settings.
    pub flash: Outcome,
    /// The messages of each snapshot in turn, before the reply.
    pub snapshots: VecDeque<Vec<DeviceMessage>>,
    /// True when the host accepts no more bytes.
    pub host_is_gone: bool,
    /// Its connection, for TCP.
    tcp: Option<TcpStream>,
}

/// The behaviour of a device on one connection.
pub type Script = Box<dyn FnOnce(&mut Conversation) + Send>;

impl Conversation {
    /// The host's next message; `None` when the host is gone.
    pub fn next(&mut self) -> Option<HostMessage> {
        loop {
            let mut byte = [0];
            match self.stream.read(&mut byte) {
                Ok(0) => return None,
                Ok(_) => match self.decoder.push(byte[0]) {
                    Some(Received::Message(message)) => return Some(message),
                    Some(Received::ForeignHello(hello)) => {
                        return Some(HostMessage::Hello(hello.into()));
                    }
                    None => (),
                },
                Err(_) => return None,
            }
        }
    }

    /// Sends bytes; ignores a host that is gone.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.host_is_gone |= self.stream.write_all(bytes).is_err();
    }

    pub fn send(&mut self, message: DeviceMessage) {
        let mut buffer = [0; MAX_DEVICE_FRAME];
        self.raw(encode(&message, &mut buffer).unwrap());
    }

    pub fn reply(&mut self, id: u16, outcome: Outcome) {
        self.send(DeviceMessage::Reply(Reply { id, outcome }));
    }

    /// Answers like a good device until the host's start command. Returns true then, and false when
    /// the host is gone.
    pub fn until_start(&mut self) -> bool {
        while let Some(message) = self.next() {
            if self.answer(message) {
                return true;
            }
        }
        false
    }

    /// Answers like a good device until the host is gone; sends no samples.
    pub fn serve(&mut self) {
        while let Some(message) = self.next() {
            self.answer(message);
        }
    }

    /// Ends a TCP connection after the host has read all bytes: closing at once may discard some.
    pub fn end_after_what_was_sent(&mut self) {
        self.tcp.take().unwrap().shutdown(Shutdown::Write).unwrap();
        while self.next().is_some() {}
    }

    /// Answers one message like a good device; false when the host is gone.
    pub fn answer_one(&mut self) -> bool {
        let message = self.next();
        message.map(|message| self.answer(message)).is_some()
    }

    /// Answers this message like a good device.
    pub fn answer_to(&mut self, message: HostMessage) {
        self.answer(message);
    }

    /// Answers one message; true for a start command.
    fn answer(&mut self, message: HostMessage) -> bool {
        let (id, request) = match message {
            HostMessage::Command(Command { id, request }) => (id, request),
            HostMessage::Hello(_) => {
                self.send(DeviceMessage::Hello(self.hello.clone()));
                return false;
            }
            HostMessage::Down(down) => {
                self.settings.down = down;
                return false;
            }
        };
        let _ = self.commands.send(request.clone());
        match &request {
            Request::GetInfo => {
                self.send(DeviceMessage::Hello(self.hello.clone()));
                self.send(DeviceMessage::Stats(self.stats));
            }
            Request::SetThreshold(Threshold::Mono { .. }) => {
                self.reply(id, Outcome::Unsupported);
                return false;
            }
            Request::Tare { .. } | Request::TareAnyway { .. } => {
                if let Some(outcome) = self.tare {
                    if outcome == Outcome::Done {
                        self.send(DeviceMessage::Tared(TareReport {
                            rest: self.settings.tare.unwrap(),
                            spread: Px(789),
                            moved: Some(MOVED),
                        }));
                    }
                    self.reply(id, outcome);
                }
                return false;
            }
            Request::GetSettings => {
                let settings = self.settings.clone();
                self.send(DeviceMessage::Settings(settings));
            }
            Request::GetHealth => self.send(DeviceMessage::Health(self.health.clone())),
            Request::SetName(name) => self.settings.name = name.clone(),
            Request::SetCamera(settings) => {
                let found = camera();
                self.settings.camera = CameraReport {
                    settings: *settings,
                    exposure: settings.exposure.unwrap_or(found.exposure),
                    gain: settings.gain.unwrap_or(found.gain),
                    ..found
                };
            }
            Request::SetContactShape(shape) => self.settings.contact_shape = *shape,
            Request::Keep(_) => {
                self.reply(id, self.flash);
                return false;
            }
            Request::Snapshot => {
                let messages = self.snapshots.pop_front().unwrap_or_default();
                messages.into_iter().for_each(|message| self.send(message));
            }
            _ => (),
        }
        self.reply(id, Outcome::Done);
        request == Request::Start
    }
}

/// The health of a device without problems.
pub const HEALTHY: Health = Health {
    reset: ResetReason::PowerOn,
    temperature_centidegrees: Some(4_150),
    stack_used: 6_120,
    stack_bytes: 24_576,
    problems: 0,
    at_start: 0,
    brown_out: BrownOut::High,
    failure: None,
};

/// The threshold that its model was made for.
pub const RED: Threshold = Threshold::Rgb565(HsvBox::of_limits([170, 10, 100, 255, 45, 255]));

pub fn hello() -> DeviceHello {
    DeviceHello {
        protocol: PROTOCOL_VERSION,
        schema: SCHEMA_HASH,
        device_id: [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 255],
        board: "fake board".try_into().unwrap(),
        firmware: "fake 1.0".try_into().unwrap(),
        model: Some(ModelIdentity {
            markers: 4,
            crc: 0xcafe,
            name: "11-64-64-3 ov7725".try_into().unwrap(),
            simulated: true,
            threshold: RED,
            source: ModelSource::BuiltIn,
        }),
        width: 320,
        height: 240,
        threshold: RED,
        preset: "ov7725".try_into().unwrap(),
        dilations: 1,
        centroid: CentroidEstimator::RednessWeighted,
        name: "thumb".try_into().unwrap(),
        filter: Filter::None,
    }
}

/// A tare's motion from the rest position before.
pub const MOVED: Moved = Moved {
    farthest: Px(20_316),
    shift: (Px(13_107), Px(-6_554)),
    turn: MilliDegrees(12),
    larger: Q::from_bits(197),
    beside: Px(524),
};

/// Settings with a kept name, a tare that is not kept, and the model's threshold.
pub fn settings() -> SettingsReport {
    let marker = |x: i32, y: i32| Marker {
        x: Px(x << 16),
        y: Px(y << 16),
        area: 190,
    };
    SettingsReport {
        name: "thumb".try_into().unwrap(),
        threshold: RED,
        tare: Some(RestPosition {
            format: PixelFormat::Rgb565,
            dilations: 1,
            centroid: CentroidEstimator::RednessWeighted,
            markers: MarkerList::from([
                marker(100, 60),
                marker(220, 60),
                marker(220, 180),
                marker(100, 180),
            ]),
            rect_center: (Px(160 << 16), Px(120 << 16)),
            rect_area: Q::from_int(14_400),
            down: None,
        }),
        kept: Selection {
            name: true,
            threshold: true,
            tare: false,
            temporal: true,
            camera: true,
            down: true,
            contact_shape: true,
        },
        found: Found::Settings,
        erases: 3,
        failures: 0,
        temporal: TemporalSettings::default(),
        rezeroed: Px(0),
        seen: None,
        drift: Some(Px(20_316)),
        camera: camera(),
        down: Down::Fixed,
        contact_shape: ContactShape::Unknown,
    }
}

/// A camera that adapts to the light.
fn camera() -> CameraReport {
    CameraReport {
        settings: CameraSettings::default(),
        exposure: Microseconds(5_922),
        gain: Sixteenths(24),
        limits: CameraLimits([
            RateLimits::new(156, [24, 6_405].map(Microseconds)),
            RateLimits::new(78, [47, 12_810].map(Microseconds)),
            RateLimits::new(39, [93, 25_620].map(Microseconds)),
        ]),
    }
}

pub fn sample(sequence: u32, frame: u32) -> DeviceMessage {
    DeviceMessage::Sample(Sample {
        sequence,
        frame,
        time_us: u64::from(frame) * 33_333,
        status: Status::NOT_CALIBRATED | Status::CONTACT,
        force: Some(Force {
            alpha: MilliDegrees(-5000),
            beta: MilliDegrees(2500),
            magnitude: MicroNewtons(100_000),
            cartesian: [-8707, 4362, -99_525].map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(480),
            magnitude_sigma: UnsignedMicroNewtons(900),
            place: Some(Place {
                x: SignedMicrometres(1250),
                y: SignedMicrometres(-730),
                sigma: Micrometres(85),
            }),
            torque: None,
        }),
        contacts: ContactList::default(),
        markers: MarkerList::default(),
    })
}

/// A device that plays one script for each connection, then goes away.
pub struct FakeDevice {
    /// For `--port`.
    pub port: String,
    pub commands: mpsc::Receiver<Request>,
}

fn conversation(stream: Box<dyn Stream>, commands: &mpsc::Sender<Request>) -> Conversation {
    Conversation {
        stream,
        decoder: Decoder::new(),
        stats: Stats::default(),
        commands: commands.clone(),
        tare: Some(Outcome::Done),
        hello: hello(),
        settings: settings(),
        health: HEALTHY,
        flash: Outcome::Done,
        snapshots: VecDeque::new(),
        host_is_gone: false,
        tcp: None,
    }
}

impl FakeDevice {
    pub fn on_tcp<const N: usize>(scripts: [Script; N]) -> FakeDevice {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = format!("tcp:{}", listener.local_addr().unwrap());
        let (sender, commands) = mpsc::channel();
        std::thread::spawn(move || {
            for script in scripts {
                let (stream, _) = listener.accept().unwrap();
                let tcp = Some(stream.try_clone().unwrap());
                let conversation = conversation(Box::new(stream), &sender);
                script(&mut Conversation {
                    tcp,
                    ..conversation
                });
            }
        });
        FakeDevice { port, commands }
    }

    /// A device on a pseudo-terminal; it vanishes after the script, as the port of a pulled cable
    /// does.
    pub fn on_pty(script: Script) -> FakeDevice {
        let (device, host_side, port) = pseudo_terminal().unwrap();
        let (sender, commands) = mpsc::channel();
        std::thread::spawn(move || {
            // Kept open, because the device's end must work before the tool opens its end.
            let _host_side = host_side;
            script(&mut conversation(Box::new(device), &sender));
        });
        FakeDevice { port, commands }
    }
}

/// A new pseudo-terminal: the device's end, the host's end, and the name by which the host opens
/// it. The tool inherits neither end: a terminal that it holds would never vanish.
fn pseudo_terminal() -> rustix::io::Result<(File, File, String)> {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let device = rustix::pty::openpt(flags)?;
    rustix::pty::grantpt(&device)?;
    rustix::pty::unlockpt(&device)?;
    let name = rustix::pty::ptsname(&device, Vec::new())?;
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let host_side = rustix::fs::open(&name, flags, Mode::empty())?;
    Ok((
        device.into(),
        host_side.into(),
        name.into_string().expect("a path in ASCII"),
    ))
}

/// A device that streams these messages after the start command, then answers until the host is
/// gone.
pub fn streaming(messages: Vec<DeviceMessage>) -> Script {
    Box::new(move |device| {
        if device.until_start() {
            messages
                .into_iter()
                .for_each(|message| device.send(message));
            device.serve();
        }
    })
}

/// Samples with these sequence and frame numbers.
pub fn samples(numbers: std::ops::Range<u32>) -> Vec<DeviceMessage> {
    numbers.map(|number| sample(number, number)).collect()
}
