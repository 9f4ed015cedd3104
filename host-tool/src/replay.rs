//! `hivtac replay`: answers as the recorded device did.

use crate::output::{Reader, note, print};
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::recording::Recording;
use hivtac_host::stop;
use hivtac_terms::marker::MarkerList;
use hivtac_wire::decoder::{Decoder, Received};
use hivtac_wire::frame::{HOST_FRAME_LIMIT, MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::{
    Command, DeviceHello, DeviceMessage, HostMessage, Outcome, Reply, Request, Stats,
};
use serde_json::json;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Time between two checks for a command, or for a program at the port.
const LOOK_EVERY: Duration = Duration::from_millis(5);

/// Play a recording as if it were a device, for any other command, on a TCP port of this
/// computer
///
/// Prints `ready tcp=127.0.0.1:PORT`, waits for a program there, and ends with the recording:
/// `hivtac monitor --port tcp:127.0.0.1:7000` shows the forces of the example.
///
/// Example: hivtac replay press.mcap --tcp 7000
#[derive(Args)]
pub struct ReplayArguments {
    /// A recording of `record`, also one that was cut or damaged, or that other tools packed,
    /// trimmed or merged
    file: PathBuf,
    /// The sensor with this name or serial number, where it holds several
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// The port; one that is free when not given
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    tcp: u16,
    /// As fast as the other program reads, not as it was recorded
    #[arg(long)]
    fast: bool,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

/// Waits for a program at the port, and plays the recording to it.
pub fn run(arguments: &ReplayArguments) -> Result<(), Failure> {
    let port = arguments.tcp;
    let (mut recording, hello) = Recording::open(&arguments.file, arguments.device.as_deref())?;
    let listener = TcpListener::bind(("127.0.0.1", port))
        .map_err(|error| Failure::input(format!("cannot listen at port {port}: {error}")))?;
    let failed = |error| Failure::input(format!("cannot listen: {error}"));
    let address = listener.local_addr().map_err(failed)?;
    listener.set_nonblocking(true).map_err(failed)?;
    let ready = match arguments.json {
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
    player.play(&mut recording, arguments.fast)?;
    for damage in recording.damage() {
        note(&format!("hivtac: {}: {damage}", recording.name));
    }
    if recording.is_cut() {
        let name = &recording.name;
        note(&format!("hivtac: {name} is cut: it ends before its end"));
    }
    Ok(())
}

/// The program at the port, and the state of its conversation.
struct Player {
    stream: TcpStream,
    decoder: Decoder<HOST_FRAME_LIMIT>,
    hello: DeviceHello,
    stats: Stats,
    /// `None` while samples are stopped, else whether they have markers.
    streaming: Option<bool>,
    is_gone: bool,
}

impl Player {
    /// Plays until the recording is over or the program is gone.
    fn play(&mut self, recording: &mut Recording, fast: bool) -> Result<(), Failure> {
        // The listener that accepted the stream does not block.
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
            let Some((came_ns, message)) = recording.next_message()? else {
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
            DeviceMessage::Sample(sample) if self.streaming != Some(true) => {
                sample.markers = MarkerList::default();
            }
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

    /// Reads the program's messages and answers them.
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
            // A recording cannot be changed, and has no pictures.
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
            | Request::StartLoader
            | Request::SetCamera(_)
            | Request::SetContactShape(_) => Outcome::Unsupported,
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
