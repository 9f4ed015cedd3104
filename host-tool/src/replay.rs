//! `hivtac replay`: a recording that answers like the device that it was made of.

use crate::output::{Reader, note, print};
use crate::record::{BEFORE_BYTES, WIRE};
use hivtac_host::failure::Failure;
use hivtac_host::stop;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::{DEVICE_FRAME_LIMIT, HOST_FRAME_LIMIT, MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{
    Command, DeviceHello, DeviceMessage, HostMessage, Outcome, Reply, Request, Stats,
};
use mcap::records::Record;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use serde_json::json;
use std::fmt::Display;
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::time::{Duration, Instant};

/// How often is looked whether there is a command, or a program at the port.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Longest record of a recording.
const LONGEST_RECORD: usize = 1 << 24;

/// Waits for a program at a port of this computer, 0 for any, and plays the recording to it.
pub fn run(file: &Path, port: u16, fast: bool, json: bool) -> Result<(), Failure> {
    let mut recording = Recording::open(file)?;
    let hello = recording.hello()?;
    let listener = TcpListener::bind(("127.0.0.1", port))
        .map_err(|error| Failure::input(format!("cannot listen at port {port}: {error}")))?;
    let failed = |error| Failure::input(format!("cannot listen: {error}"));
    let address = listener.local_addr().map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    let ready = match json {
        true => json!({ "tcp": address.to_string() }).to_string(),
        false => format!("ready tcp={address}"),
    };
    if print(&ready)? == Reader::Gone {
        return Ok(());
    }
    let stream = loop {
        stop::check()?;
        match listener.accept() {
            Ok((stream, _)) => break stream,
            Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(LOOK_EVERY),
            Err(error) => return Err(failed(error)),
        }
    };
    let mut player = Player {
        stream,
        decoder: Decoder::new(),
        hello,
        stats: Stats::default(),
        streaming: None,
        is_gone: false,
    };
    player.play(&mut recording, fast)
}

/// A message and when it came, ns since 1970.
type Kept = (u64, DeviceMessage);

/// A recording that is read as it is played.
struct Recording {
    name: String,
    file: File,
    reader: LinearReader,
    /// The channel of the device's messages.
    channel: Option<u16>,
    is_over: bool,
}

impl Recording {
    fn open(path: &Path) -> Result<Recording, Failure> {
        let name = path.display().to_string();
        let file = File::open(path)
            .map_err(|error| Failure::input(format!("cannot read {name}: {error}")))?;
        let options = LinearReaderOptions::default().with_record_length_limit(LONGEST_RECORD);
        Ok(Recording {
            name,
            file,
            reader: LinearReader::new_with_options(options),
            channel: None,
            is_over: false,
        })
    }

    fn failure(&self, what: impl Display) -> Failure {
        let name = &self.name;
        Failure::input(format!("{name} is no recording of `hivtac record`: {what}"))
    }

    /// The device's hello, which a recording begins with.
    fn hello(&mut self) -> Result<DeviceHello, Failure> {
        match self.next()? {
            Some((_, DeviceMessage::Hello(hello))) => Ok(hello),
            _ => Err(self.failure("it does not begin with a hello of this release's version")),
        }
    }

    /// The next message; `None` at the end, also where the recording was cut.
    fn next(&mut self) -> Result<Option<Kept>, Failure> {
        while !self.is_over {
            let event = match self.reader.next_event() {
                None => break,
                Some(Ok(event)) => event,
                Some(Err(error)) if self.channel.is_none() => return Err(self.failure(error)),
                Some(Err(_)) => {
                    self.is_over = true;
                    note(&format!(
                        "hivtac: {} is cut: it ends before its end",
                        self.name
                    ));
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
                            self.channel = Some(channel.id);
                        }
                        Ok(Record::Message { header, data })
                            if Some(header.channel_id) == self.channel =>
                        {
                            if let Some(message) = decoded(&data) {
                                return Ok(Some((header.log_time, message)));
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

/// The message in a frame that was kept; `None` of another version's.
fn decoded(data: &[u8]) -> Option<DeviceMessage> {
    let mut frame = data.get(BEFORE_BYTES..)?;
    match Decoder::<DEVICE_FRAME_LIMIT>::new().feed(&mut frame)? {
        Received::Message(message) => Some(message),
        Received::ForeignHello(_) => None,
    }
}

/// The other program, and what it is told.
struct Player {
    stream: TcpStream,
    decoder: Decoder<HOST_FRAME_LIMIT>,
    hello: DeviceHello,
    stats: Stats,
    /// Whether samples flow, and with their markers.
    streaming: Option<bool>,
    is_gone: bool,
}

impl Player {
    /// Until the recording is over, or the other program gone.
    fn play(&mut self, recording: &mut Recording, fast: bool) -> Result<(), Failure> {
        // It was accepted by a listener that does not wait.
        let patience = self.stream.set_nonblocking(false);
        let patience = patience.and_then(|()| self.stream.set_read_timeout(Some(LOOK_EVERY)));
        patience.map_err(|error| recording.failure(error))?;
        let mut begun: Option<(Instant, u64)> = None;
        while !self.is_gone {
            if self.streaming.is_none() {
                self.listen();
                stop::check()?;
                continue;
            }
            let Some((came_ns, message)) = recording.next()? else {
                break;
            };
            let (since, first_ns) = *begun.get_or_insert((Instant::now(), came_ns));
            let due = since + Duration::from_nanos(came_ns.saturating_sub(first_ns));
            loop {
                stop::check()?;
                let left = due.saturating_duration_since(Instant::now());
                if fast || left.is_zero() {
                    break;
                }
                std::thread::sleep(left.min(LOOK_EVERY));
            }
            self.tell(message);
            self.listen_without_waiting();
        }
        Ok(())
    }

    fn tell(&mut self, mut message: DeviceMessage) {
        match &mut message {
            DeviceMessage::Stats(stats) => self.stats = *stats,
            DeviceMessage::Sample(sample) if self.streaming != Some(true) => sample.markers = None,
            _ => (),
        }
        if self.streaming.is_some() {
            self.send(&message);
        }
    }

    fn listen_without_waiting(&mut self) {
        if self.stream.set_nonblocking(true).is_ok() {
            self.listen();
        }
        self.is_gone |= self.stream.set_nonblocking(false).is_err();
    }

    /// Answers what has come.
    fn listen(&mut self) {
        let mut bytes = [0; 256];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.is_gone = true,
            Ok(count) => {
                let mut rest = &bytes[..count];
                while let Some(received) = self.decoder.feed(&mut rest) {
                    self.answer(received);
                }
            }
            Err(error) => {
                let waits = [
                    ErrorKind::WouldBlock,
                    ErrorKind::TimedOut,
                    ErrorKind::Interrupted,
                ];
                self.is_gone |= !waits.contains(&error.kind());
            }
        }
    }

    fn answer(&mut self, received: Received<HostMessage>) {
        let hello = DeviceMessage::Hello(self.hello.clone());
        let Received::Message(HostMessage::Command(Command { id, request })) = received else {
            self.streaming = None;
            return self.send(&hello);
        };
        let outcome = match request {
            Request::GetInfo => {
                self.send(&hello);
                self.send(&DeviceMessage::Stats(self.stats));
                Outcome::Done
            }
            Request::Start | Request::StartWithMarkers => {
                self.streaming = Some(request == Request::StartWithMarkers);
                Outcome::Done
            }
            Request::Stop => {
                self.streaming = None;
                Outcome::Done
            }
            // What was recorded cannot be changed, and has no pictures.
            Request::SetThreshold(_)
            | Request::Tare { .. }
            | Request::Expose
            | Request::Snapshot
            | Request::Inspect
            | Request::GetSettings
            | Request::SetName(_)
            | Request::SetTemporal(_)
            | Request::SetTare(_)
            | Request::Keep(_)
            | Request::BeginModel { .. }
            | Request::ModelPart(_)
            | Request::UseModel
            | Request::UseBuiltInModel
            | Request::Reset
            | Request::TareAnyway { .. }
            | Request::GetHealth
            | Request::StartLoader => Outcome::Unsupported,
        };
        self.send(&DeviceMessage::Reply(Reply { id, outcome }));
    }

    fn send(&mut self, message: &DeviceMessage) {
        let mut buffer = [0; MAX_DEVICE_FRAME];
        if let Ok(frame) = encode(message, &mut buffer) {
            self.is_gone |= self.stream.write_all(frame).is_err();
        }
    }
}
