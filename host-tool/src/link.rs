//! A conversation with the device (`docs/wire.md`): hello, commands, messages.

use crate::failure::{Failure, Kind};
use crate::port::{Address, Port};
use crate::shown::shown;
use crate::stop;
use hivtac_terms::down::Down;
use hivtac_wire::decoder::{Decoder, Received, Rejected};
use hivtac_wire::frame::{DEVICE_FRAME_LIMIT, MAX_HOST_FRAME, encode};
use hivtac_wire::message::{
    Command, DeviceHello, DeviceMessage, HostMessage, LogLevel, LogLine, Outcome, Request,
};
use hivtac_wire::version::HelloPrefix;
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

/// Time from the first hello to the second. It doubles with each unanswered hello, and few of them
/// wait in the line for a device that is still booting.
const HELLO_AGAIN: Duration = Duration::from_millis(250);
/// Longest time between two hellos while none is answered.
const HELLO_AT_LEAST_EVERY: Duration = Duration::from_secs(2);
/// Longest time for which the device may accept no byte of a command.
const WRITE_PATIENCE: Duration = Duration::from_secs(2);

/// An open connection to a device.
pub struct Link {
    port: Box<dyn Port>,
    /// The port's name, for messages.
    pub name: String,
    decoder: Decoder<DEVICE_FRAME_LIMIT>,
    /// Bytes that were read; those before `decoded` are already decoded.
    inbox: Vec<u8>,
    decoded: usize,
    last_id: u16,
    /// Bytes that came, whatever they were.
    came: u64,
}

impl Link {
    /// Opens the port and exchanges hellos.
    ///
    /// # Errors
    /// [`Kind::NoDevice`] when the port cannot be opened or no hello comes within `patience`;
    /// [`Kind::Version`] when the device has another version of the protocol.
    pub fn connect(address: &Address, patience: Duration) -> Result<(Link, DeviceHello), Failure> {
        let (port, name) = address.open()?;
        let decoder = Decoder::new();
        let mut link = Link {
            port,
            name,
            decoder,
            inbox: Vec::new(),
            decoded: 0,
            last_id: 0,
            came: 0,
        };
        let hello = link.exchange_hellos(patience)?;
        Ok((link, hello))
    }

    fn exchange_hellos(&mut self, patience: Duration) -> Result<DeviceHello, Failure> {
        let end = Instant::now() + patience;
        let mut pause = HELLO_AGAIN;
        while Instant::now() < end {
            self.say_hello()?;
            let next = end.min(Instant::now() + pause);
            pause = HELLO_AT_LEAST_EVERY.min(pause * 2);
            while let Some(message) = self.receive(next)? {
                // Any other message is left over from an earlier conversation.
                if let DeviceMessage::Hello(hello) = message {
                    // The decoder is between two frames here; what it rejected before does not
                    // count.
                    self.decoder = Decoder::new();
                    return Ok(hello);
                }
            }
        }
        Err(self.no_hello(patience))
    }

    fn no_hello(&self, patience: Duration) -> Failure {
        let name = &self.name;
        let seconds = patience.as_secs_f32();
        // Text without a zero is no frame yet, which the decoder does not reject.
        let bytes = match self.came {
            0 => "nothing came".to_owned(),
            bytes => format!("{bytes} bytes came, and none was a hello"),
        };
        Failure::new(
            Kind::NoDevice,
            format!(
                "no hello from {name} within {seconds} s ({bytes}); is it a HiVTac sensor, \
                 and running? (choose another port with --port, or wait longer with --timeout)"
            ),
        )
    }

    /// Sends a hello after a zero, which ends any half frame in the line.
    fn say_hello(&mut self) -> Result<(), Failure> {
        self.write(&[0])?;
        self.send(&HostMessage::Hello(HelloPrefix::OURS.into()))
    }

    fn send(&mut self, message: &HostMessage) -> Result<(), Failure> {
        let mut buffer = [0; MAX_HOST_FRAME];
        match encode(message, &mut buffer) {
            Ok(frame) => self.write(frame),
            Err(error) => unreachable!("{error:?}: MAX_HOST_FRAME holds every message"),
        }
    }

    fn write(&mut self, mut bytes: &[u8]) -> Result<(), Failure> {
        let mut end = Instant::now() + WRITE_PATIENCE;
        while !bytes.is_empty() {
            stop::check()?;
            match self.port.write(bytes) {
                // Windows tells a write that timed out like this.
                Ok(0) if Instant::now() < end => (),
                Ok(0) => return Err(self.lost("it takes no bytes")),
                Ok(written) => {
                    bytes = &bytes[written..];
                    end = Instant::now() + WRITE_PATIENCE;
                }
                Err(error) if is_patience(&error) && Instant::now() < end => (),
                Err(error) => return Err(self.lost(&error.to_string())),
            }
        }
        Ok(())
    }

    /// The next message; `None` once `end` has passed, even if messages wait.
    ///
    /// # Errors
    /// [`Kind::Lost`], [`Kind::Version`] or [`Kind::Interrupted`].
    pub fn receive(&mut self, end: Instant) -> Result<Option<DeviceMessage>, Failure> {
        while Instant::now() < end {
            stop::check()?;
            match self.decode() {
                Some(Received::Message(message)) => return Ok(Some(message)),
                Some(Received::ForeignHello(hello)) => return Err(self.foreign(hello)),
                None => self.read()?,
            }
        }
        Ok(None)
    }

    fn decode(&mut self) -> Option<Received<DeviceMessage>> {
        let mut rest = &self.inbox[self.decoded..];
        let received = self.decoder.feed(&mut rest);
        self.decoded = self.inbox.len() - rest.len();
        received
    }

    fn read(&mut self) -> Result<(), Failure> {
        self.inbox.resize(4096, 0);
        self.decoded = 0;
        let result = self.port.read(&mut self.inbox);
        self.inbox.truncate(*result.as_ref().unwrap_or(&0));
        self.came += self.inbox.len() as u64;
        match result {
            Ok(0) => Err(self.lost("the other end closed it")),
            Ok(_) => Ok(()),
            Err(error) if is_patience(&error) => Ok(()),
            Err(error) => Err(self.lost(&error.to_string())),
        }
    }

    /// The failure for a broken connection.
    pub fn lost(&self, why: &str) -> Failure {
        let name = &self.name;
        let message = format!(
            "connection to {name} lost: {why}; cable pulled or device reset? \
             (`monitor --reconnect`, `view` and `serve` go on when it is back)"
        );
        Failure::new(Kind::Lost, message)
    }

    fn foreign(&self, device: HelloPrefix) -> Failure {
        let host = HelloPrefix::OURS;
        let message = format!(
            "the device at {} speaks protocol {} (schema {:#018x}), this tool protocol {} (schema \
             {:#018x}); use the hivtac and the firmware of one release",
            self.name, device.protocol, device.schema, host.protocol, host.schema
        );
        Failure::new(Kind::Version, message)
    }

    /// Sends a command without waiting for its reply; returns its id.
    pub fn command(&mut self, request: Request) -> Result<u16, Failure> {
        self.last_id = self.last_id.wrapping_add(1);
        let id = self.last_id;
        self.send(&HostMessage::Command(Command { id, request }))?;
        Ok(id)
    }

    /// Sends what is known of gravity, which the sensor uses from its next frame on. The device
    /// sends no reply, and this may be called at any rate.
    ///
    /// # Errors
    /// [`Kind::Lost`] or [`Kind::Interrupted`].
    pub fn set_down(&mut self, down: Down) -> Result<(), Failure> {
        self.send(&HostMessage::Down(down))
    }

    /// Sends a command and waits for its reply; other messages that come first go to `other`.
    ///
    /// # Errors
    /// [`Kind::Refused`] when the reply is not `Done` or does not come within `patience`; those of
    /// [`Link::receive`].
    pub fn request(
        &mut self,
        request: Request,
        patience: Duration,
        mut other: impl FnMut(DeviceMessage),
    ) -> Result<(), Failure> {
        let (what, advice) = (name_of(&request), after_silence(&request));
        let id = self.command(request)?;
        let end = Instant::now() + patience;
        while let Some(message) = self.receive(end)? {
            match message {
                DeviceMessage::Reply(reply) if reply.id == id => return judge(what, reply.outcome),
                message => other(message),
            }
        }
        let seconds = patience.as_secs_f32();
        Err(refused(format!(
            "the device did not answer \"{what}\" within {seconds} s; {advice}"
        )))
    }

    /// What the decoder rejected since the device's hello.
    pub fn rejected(&self) -> Rejected {
        self.decoder.rejected()
    }
}

/// True for a timeout, where nothing has failed.
fn is_patience(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

fn name_of(request: &Request) -> &'static str {
    match request {
        Request::GetInfo => "get info",
        Request::Start => "start",
        Request::Stop => "stop",
        Request::SetThreshold(_) => "set threshold",
        Request::Tare { .. } => "tare",
        Request::StartWithMarkers => "start with markers",
        Request::Expose => "expose",
        Request::Snapshot => "snapshot",
        Request::Inspect => "inspect",
        Request::GetSettings => "get settings",
        Request::SetName(_) => "set name",
        Request::SetTemporal(_) => "set limits of touch, slip, filter and re-zeroing",
        Request::SetTare(_) => "set tare",
        Request::Keep(_) => "keep settings",
        Request::BeginModel { .. } => "begin model",
        Request::ModelPart(_) => "model part",
        Request::UseModel => "use model",
        Request::UseBuiltInModel => "use built-in model",
        Request::Reset => "reset",
        Request::TareAnyway { .. } => "tare",
        Request::GetHealth => "get health",
        Request::StartLoader => "start loader",
        Request::SetCamera(_) => "set the camera",
        Request::SetContactShape(_) => "set the shape of what presses",
    }
}

/// Advice when no reply came. The device may still carry the command out.
fn after_silence(request: &Request) -> &'static str {
    match request {
        Request::Keep(_) => {
            "it may be writing still and keep them all the same: wait 10 s, see what is kept with \
             `hivtac settings get`, and try again if it is not"
        }
        Request::UseModel | Request::UseBuiltInModel | Request::Reset => {
            "it may be writing still and do it all the same: wait 10 s, see with `hivtac info` \
             which model it uses, and try again if it is another one"
        }
        _ => {
            "it may do it all the same: wait 10 s and try again; when it repeats, `hivtac info` \
             tells whether it restarts"
        }
    }
}

fn refused(message: String) -> Failure {
    Failure::new(Kind::Refused, message)
}

/// Turns the outcome of the command `what` into a result.
///
/// # Errors
/// [`Kind::Refused`] with the reason unless the outcome is `Done`.
pub fn judge(what: &str, outcome: Outcome) -> Result<(), Failure> {
    let why = match outcome {
        Outcome::Done => return Ok(()),
        Outcome::InvalidArgument => "an argument is outside its range",
        Outcome::Unsupported => "its camera does not send that pixel format; choose another",
        Outcome::Busy => {
            "it is still busy with an earlier command, perhaps one that was not answered or of \
             another program: wait 10 s and try again"
        }
        Outcome::NotRead => "this computer took no bytes for 0.1 s; is it busy? try again",
        Outcome::NoCamera => {
            "its camera does not answer, or is another one; `hivtac bring-up` says what to do"
        }
        Outcome::Worn => {
            "its flash is worn and keeps nothing new; it works on, with what it kept before at \
             each start"
        }
        Outcome::ModelUnusable => {
            "it cannot use this model file; the one in use goes on, and the device's line above \
             says why"
        }
        Outcome::AnotherSensor => {
            "the model was made for another sensor, camera or frame; the one in use goes on, and \
             the device's line above says which"
        }
        Outcome::NotAtRest => {
            "the markers are not where a film at rest has them; take away what touches it, and \
             check the film's distance"
        }
        Outcome::MarkersImplausible => {
            "the images at rest are not those of four whole, equal markers: one may be covered, \
             cut, stained or glare; look at the film and its light, and clean it"
        }
        Outcome::Touched { looks_like } => {
            let millinewtons = f64::from(looks_like.0) * 1e-3;
            &format!(
                "the film looks touched, by {millinewtons:.1} mN, beside where it rested before, \
                 when it was calibrated, or as sensors are built; take away what touches it, or \
                 say --force when nothing does"
            )
        }
        Outcome::Unsteady => {
            "the markers moved meanwhile; take away what touches or shakes the film"
        }
        Outcome::NoGoodFrames => {
            "not enough good frames came in time; does the camera see all four markers? (hivtac \
             monitor)"
        }
    };
    Err(refused(format!("the device refused \"{what}\": {why}")))
}

/// The text of a device's log line, for standard error.
pub fn log_text(line: &LogLine) -> String {
    let level = match line.level {
        LogLevel::Error => "error",
        LogLevel::Warning => "warning",
        LogLevel::Info => "info",
    };
    let seconds = line.time_us as f64 / 1e6;
    format!("device, {seconds:.3} s, {level}: {}", shown(&line.text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    /// A port that takes no byte at first, and then as many as it shall at a time.
    struct Slow {
        refusals: usize,
        taken: std::sync::mpsc::Sender<u8>,
    }

    impl Write for Slow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.refusals > 0 {
                self.refusals -= 1;
                return Ok(0);
            }
            self.taken.send(bytes[0]).map_err(io::Error::other)?;
            Ok(1)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Read for Slow {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(ErrorKind::TimedOut.into())
        }
    }

    /// On Windows a write that timed out returns 0.
    #[test]
    fn a_port_that_takes_nothing_for_a_moment_is_not_lost() {
        let (taken, bytes) = std::sync::mpsc::channel();
        let mut link = Link {
            port: Box::new(Slow { refusals: 3, taken }),
            name: "slow".to_owned(),
            decoder: Decoder::new(),
            inbox: Vec::new(),
            came: 0,
            decoded: 0,
            last_id: 0,
        };
        link.write(&[1, 2, 3]).unwrap();
        drop(link);
        assert_eq!(bytes.iter().collect::<Vec<_>>(), [1, 2, 3]);
    }
}
