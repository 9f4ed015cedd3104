//! A conversation with the device (`docs/wire.md`): hello, commands, messages.

use crate::failure::{Failure, Kind};
use crate::frame::{Collected, DEVICE_PATIENCE, Taken, no_part};
use crate::port::{Address, Port};
use crate::reply::{foreign, judge, name_of, unanswered};
use crate::stop;
use hivtac_terms::down::Down;
use hivtac_wire::decoder::{Decoder, Received, Rejected};
use hivtac_wire::frame::{DEVICE_FRAME_LIMIT, MAX_HOST_FRAME, encode};
use hivtac_wire::message::{Command, DeviceHello, DeviceMessage, HostMessage, Outcome, Request};
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
    /// The device only sends over this port, and streams by itself.
    only_sends: bool,
}

impl Link {
    /// Opens the port and exchanges hellos. On a UART, waits for the device's.
    ///
    /// # Errors
    /// [`Kind::NoDevice`] when the port cannot be opened or no hello comes within `patience`;
    /// [`Kind::Version`] when the device has another version of the protocol.
    pub fn connect(address: &Address, patience: Duration) -> Result<(Link, DeviceHello), Failure> {
        let mut link = Link::open(address)?;
        let hello = link.exchange_hellos(patience)?;
        Ok((link, hello))
    }

    /// Has a device that speaks another version of the protocol start its own loader.
    ///
    /// # Errors
    /// [`Kind::NoDevice`] when the port cannot be opened; [`Kind::Lost`] when it takes no bytes;
    /// [`Kind::Refused`] over a UART.
    pub fn start_loader(address: &Address, patience: Duration) -> Result<(), Failure> {
        let mut link = Link::open(address)?;
        if link.only_sends {
            return Err(link.cannot_ask("start loader"));
        }
        link.write(&[0])?;
        link.send(&HostMessage::Hello(HelloPrefix::START_LOADER.into()))?;
        // Its hello, which is of that version: then it has read ours.
        let _ = link.receive(Instant::now() + patience);
        Ok(())
    }

    fn open(address: &Address) -> Result<Link, Failure> {
        let (port, name) = address.open()?;
        let decoder = Decoder::new();
        Ok(Link {
            port,
            name,
            decoder,
            inbox: Vec::new(),
            decoded: 0,
            last_id: 0,
            came: 0,
            only_sends: address.only_sends(),
        })
    }

    fn exchange_hellos(&mut self, patience: Duration) -> Result<DeviceHello, Failure> {
        let end = Instant::now() + patience;
        let mut pause = HELLO_AGAIN;
        while Instant::now() < end {
            if !self.only_sends {
                self.say_hello()?;
            }
            let next = end.min(Instant::now() + pause);
            pause = HELLO_AT_LEAST_EVERY.min(pause * 2);
            while let Some(message) = self.receive(next)? {
                // Any other message is left over from an earlier conversation.
                if let DeviceMessage::Hello(hello) = message {
                    // The decoder is between two frames here; its earlier rejects do not count.
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
                // Windows reports a write that timed out like this.
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
                Some(Received::ForeignHello(hello)) => return Err(foreign(&self.name, hello)),
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

    /// The failure of a request over a port on which a device only sends.
    fn cannot_ask(&self, what: &str) -> Failure {
        let message = format!(
            "cannot ask the device over {}: \"{what}\": it only sends samples there; use its USB port",
            self.name
        );
        Failure::new(Kind::Refused, message)
    }

    /// The failure for a broken connection.
    pub fn lost(&self, why: &str) -> Failure {
        let name = &self.name;
        let question = match name.starts_with("tcp:") {
            true => "is a replay over, or has the program there ended?",
            false => "cable pulled or device reset?",
        };
        let message = format!(
            "connection to {name} lost: {why}; {question} \
             (`monitor --reconnect`, `view` and `serve` go on when it is back)"
        );
        Failure::new(Kind::Lost, message)
    }

    /// Sends a command without waiting for its reply; returns its id. Over a UART it is not sent:
    /// samples, hello and statistics come without one.
    ///
    /// # Errors
    /// [`Kind::Lost`] or [`Kind::Interrupted`]; [`Kind::Refused`] for any other command over a
    /// UART.
    pub fn command(&mut self, request: Request) -> Result<u16, Failure> {
        self.last_id = self.last_id.wrapping_add(1);
        let id = self.last_id;
        if self.only_sends {
            return match request {
                Request::GetInfo | Request::Start | Request::StartWithMarkers | Request::Stop => {
                    Ok(id)
                }
                other => Err(self.cannot_ask(name_of(&other))),
            };
        }
        self.send(&HostMessage::Command(Command { id, request }))?;
        Ok(id)
    }

    /// Sends the direction of gravity, which the sensor uses from its next frame on. The device
    /// sends no reply, and this may be called at any rate.
    ///
    /// # Errors
    /// [`Kind::Lost`] or [`Kind::Interrupted`]; [`Kind::Refused`] over a UART.
    pub fn set_down(&mut self, down: Down) -> Result<(), Failure> {
        if self.only_sends {
            return Err(self.cannot_ask("set gravity"));
        }
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
        let (asked, id) = (request.clone(), self.command(request)?);
        if self.only_sends {
            return Ok(());
        }
        let end = Instant::now() + patience;
        while let Some(message) = self.receive(end)? {
            match message {
                DeviceMessage::Reply(reply) if reply.id == id => {
                    return judge(name_of(&asked), reply.outcome);
                }
                message => other(message),
            }
        }
        Err(unanswered(&asked, patience))
    }

    /// Asks a silent device whether it takes part in this conversation; earlier messages go to
    /// `other`. Returns true if it answers, false if a sample comes first: the answer may be lost
    /// when this host did not read for a while.
    ///
    /// # Errors
    /// [`Kind::Lost`] when neither comes within `patience`; those of [`Link::receive`].
    pub fn probe(
        &mut self,
        patience: Duration,
        mut other: impl FnMut(DeviceMessage),
    ) -> Result<bool, Failure> {
        let end = Instant::now() + patience;
        if self.only_sends {
            return self.is_status(end, other);
        }
        let id = self.command(Request::GetInfo)?;
        while let Some(message) = self.receive(end)? {
            match message {
                DeviceMessage::Reply(reply) if reply.id == id => {
                    if reply.outcome == Outcome::Done {
                        return Ok(true);
                    }
                    break;
                }
                DeviceMessage::Sample(_) => {
                    other(message);
                    return Ok(false);
                }
                message => other(message),
            }
        }
        Err(self.lost("the device sends nothing and does not answer"))
    }

    /// Whether a line that only sends carries a hello or statistics, rather than samples.
    fn is_status(
        &mut self,
        end: Instant,
        mut other: impl FnMut(DeviceMessage),
    ) -> Result<bool, Failure> {
        while let Some(message) = self.receive(end)? {
            let is_status = match message {
                DeviceMessage::Hello(_) | DeviceMessage::Stats(_) => Some(true),
                DeviceMessage::Sample(_) => Some(false),
                _ => None,
            };
            other(message);
            if let Some(is_status) = is_status {
                return Ok(is_status);
            }
        }
        Err(self.lost("the device sends nothing"))
    }

    /// Requests the device's next whole frame and waits for it; all other messages go to `other`.
    /// The longest silence is `patience`, plus the device's own patience before the first message.
    ///
    /// # Errors
    /// [`Kind::Refused`] when the device cannot send a frame or does not answer; [`Kind::Lost`]
    /// when a part was damaged on the way; those of [`Link::receive`].
    pub fn snapshot(
        &mut self,
        patience: Duration,
        mut other: impl FnMut(DeviceMessage),
    ) -> Result<Taken, Failure> {
        let id = self.command(Request::Snapshot)?;
        let mut collected = Collected::default();
        let mut end = Instant::now() + DEVICE_PATIENCE + patience;
        while let Some(message) = self.receive(end)? {
            match message {
                DeviceMessage::Reply(reply) if reply.id == id => {
                    return collected.whole(reply.outcome);
                }
                DeviceMessage::Snapshot(_) | DeviceMessage::SnapshotPart(_) => {
                    end = Instant::now() + patience;
                    collected.add(&message)?;
                }
                message => {
                    if let DeviceMessage::Sample(sample) = &message {
                        collected.remember(sample.clone());
                    }
                    other(message);
                }
            }
        }
        Err(no_part(patience))
    }

    /// The decoder's rejects since the device's hello.
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

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::ContactList;
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::status::Status;
    use hivtac_wire::frame::MAX_DEVICE_FRAME;
    use hivtac_wire::message::{Sample, Stats};
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
        let mut link = link_at(Slow { refusals: 3, taken }, false);
        link.write(&[1, 2, 3]).unwrap();
        drop(link);
        assert_eq!(bytes.iter().collect::<Vec<_>>(), [1, 2, 3]);
    }

    /// A device that answers nothing, with the bytes that it sends.
    struct Sending(io::Cursor<Vec<u8>>);

    impl Write for Sending {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Read for Sending {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            match self.0.read(buffer)? {
                0 => Err(ErrorKind::TimedOut.into()),
                bytes => Ok(bytes),
            }
        }
    }

    #[test]
    fn a_device_whose_answer_is_lost_is_there_while_samples_come() {
        let sample = DeviceMessage::Sample(Sample {
            sequence: 7,
            frame: 7,
            time_us: 1,
            status: Status::OK,
            force: None,
            contacts: ContactList::default(),
            markers: MarkerList::default(),
        });
        let frame = framed(&sample);
        let probed = |only_sends: bool, sent: Vec<u8>| {
            let mut link = link_at(Sending(io::Cursor::new(sent)), only_sends);
            let mut seen = Vec::new();
            let result = link.probe(Duration::from_millis(20), |message| seen.push(message));
            (result.map_err(|failure| failure.kind), seen)
        };
        for only_sends in [false, true] {
            let probed = |sent| probed(only_sends, sent);
            assert_eq!(probed(frame.clone()), (Ok(false), vec![sample.clone()]));
            assert_eq!(probed(Vec::new()), (Err(Kind::Lost), Vec::new()));
        }
        // On a line on which it only sends, its statistics say that it is there.
        let stats = DeviceMessage::Stats(Stats::default());
        assert_eq!(probed(true, framed(&stats)), (Ok(true), vec![stats]));
    }

    fn link_at(port: impl Port + 'static, only_sends: bool) -> Link {
        Link {
            port: Box::new(port),
            name: "a port".to_owned(),
            decoder: Decoder::new(),
            inbox: Vec::new(),
            came: 0,
            decoded: 0,
            last_id: 0,
            only_sends,
        }
    }

    fn framed(message: &DeviceMessage) -> Vec<u8> {
        let mut buffer = [0; MAX_DEVICE_FRAME];
        encode(message, &mut buffer).unwrap().to_vec()
    }
}
