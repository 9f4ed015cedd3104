//! The device itself, for a USB host on another system, by USB/IP: the host's own drivers use it.
//!
//! One client at a time imports the device; others may ask for the list meanwhile. The cable is
//! plugged in while a client has the device or waits for it. When the client's connection ends, the
//! cable is pulled; when the device leaves the bus, the connection ends.

pub mod wire;

use std::collections::VecDeque;
use std::net::{TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use anyhow::ensure;

use crate::link::{Plug, ROUND, Traffic, listen, read_some, wait_for, write_all};
use crate::usb_host::{Host, Presence};
use wire::{Command, Refusal, Request};

/// The most connections at a time.
const MOST: usize = 16;
/// The longest duration, by the clock on the wall, until a connection has asked for something.
const ASKING: Duration = Duration::from_secs(10);
/// The most bytes that a connection without the device sends ahead.
const AHEAD: usize = ROUND;
/// The most bytes that wait for a connection to read them.
const BEHIND: usize = 4 * wire::LARGEST_TRANSFER;

/// A server for one device.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    visitors: Vec<Visitor>,
}

/// The state of a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
enum State {
    /// Its request is not complete.
    Asks,
    /// It waits for the answer.
    Waits(Request),
    /// It has the device.
    Has,
    /// It ends once the last bytes have gone.
    Leaves,
    /// It has ended.
    Gone,
}

/// A connection.
#[derive(Debug)]
struct Visitor {
    stream: TcpStream,
    input: VecDeque<u8>,
    output: VecDeque<u8>,
    state: State,
    /// The time at which its request must be complete.
    until: Instant,
}

impl Server {
    /// Listens on 127.0.0.1; port 0 takes a free one.
    ///
    /// # Errors
    /// If the port is taken.
    pub fn listen(port: u16) -> anyhow::Result<Self> {
        Ok(Self {
            listener: listen("--usbip", port)?,
            visitors: Vec::new(),
        })
    }

    /// Returns the port's number.
    ///
    /// # Errors
    /// If the system does not report it.
    pub fn port(&self) -> anyhow::Result<u16> {
        Ok(self.listener.local_addr()?.port())
    }

    fn accept(&mut self) {
        while self.visitors.len() < MOST
            && let Ok((stream, _)) = self.listener.accept()
        {
            // A client that cannot be set up does not count.
            if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                self.visitors.push(Visitor {
                    stream,
                    input: VecDeque::new(),
                    output: VecDeque::new(),
                    state: State::Asks,
                    until: Instant::now() + ASKING,
                });
            }
        }
    }

    /// Returns whether a visitor has the device.
    fn has_device(&self) -> bool {
        let has = |visitor: &Visitor| visitor.state == State::Has;
        self.visitors.iter().any(has)
    }

    /// Answers a visitor that waits, if the device is ready.
    fn answer(&mut self, nth: usize, host: &mut Host) {
        let is_busy = self.has_device();
        let State::Waits(request) = self.visitors[nth].state.clone() else {
            return;
        };
        let presence = host.presence();
        let (bytes, state) = match (request, &presence) {
            (Request::Import(name), _) if name != wire::NAME => {
                (wire::refused(Refusal::Unknown), State::Leaves)
            }
            (Request::Import(_), _) if is_busy => (wire::refused(Refusal::Busy), State::Leaves),
            (_, Presence::None) => return,
            (Request::List, Presence::Ready(device)) => (wire::list(Some(device)), State::Leaves),
            (Request::List, Presence::Failed) => (wire::list(None), State::Leaves),
            (Request::Import(_), Presence::Ready(device)) => (wire::imported(device), State::Has),
            (Request::Import(_), Presence::Failed) => {
                (wire::refused(Refusal::Failed), State::Leaves)
            }
        };
        self.visitors[nth].output.extend(bytes);
        self.visitors[nth].state = state;
    }
}

impl Plug for Server {
    fn is_host(&self) -> bool {
        true
    }

    fn connected(&mut self) -> bool {
        self.accept();
        !self.visitors.is_empty()
    }

    fn exchange(&mut self, host: &mut Host, _is_here: bool) -> Traffic {
        let (mut moved, had_device) = (false, self.has_device());
        for nth in 0..self.visitors.len() {
            moved |= self.visitors[nth].read();
            let refused = self.visitors[nth].serve(host);
            if let Err(why) = refused {
                eprintln!("hivtac-rig: a client of USB/IP was sent away: {why:#}");
                self.visitors[nth].state = State::Gone;
            }
            self.answer(nth, host);
            moved |= self.visitors[nth].write();
        }
        self.visitors.retain(|visitor| visitor.state != State::Gone);
        let needs = |visitor: &Visitor| matches!(visitor.state, State::Has | State::Waits(_));
        let has_left = had_device && !self.has_device();
        host.set_client(!has_left && self.visitors.iter().any(needs));
        Traffic {
            moved,
            waits: self
                .visitors
                .iter()
                .any(|visitor| !visitor.output.is_empty()),
        }
    }

    fn wait(&self) {
        let visitors = self.visitors.iter();
        let behind = visitors.filter(|visitor| !visitor.output.is_empty());
        wait_for(behind.map(|visitor| visitor.stream.as_fd()));
    }
}

impl Visitor {
    /// Reads the bytes that have come. Returns whether any have.
    fn read(&mut self) -> bool {
        let before = self.input.len();
        if !read_some(&self.stream, &mut self.input) {
            self.state = State::Gone;
        }
        self.input.len() > before
    }

    /// Handles its requests and commands.
    fn serve(&mut self, host: &mut Host) -> anyhow::Result<()> {
        if self.state == State::Asks
            && let Some(request) = wire::request(&mut self.input)?
        {
            self.state = State::Waits(request);
        }
        self.check_limits()?;
        if self.state != State::Has {
            return Ok(());
        }
        if host.has_lost_device() {
            self.state = State::Gone;
            return Ok(());
        }
        while let Some(command) = wire::command(&mut self.input)? {
            match command {
                Command::Submit(urb) => host.submit(urb)?,
                Command::Unlink { number, target } => {
                    // The end of a transfer that has ended before comes first.
                    self.take_done(host);
                    let status = host.unlink(target);
                    self.output.extend(wire::unlinked(number, status));
                }
            }
        }
        self.take_done(host);
        Ok(())
    }

    /// Checks that it asks in time, waits for its answer, and reads.
    fn check_limits(&self) -> anyhow::Result<()> {
        ensure!(
            self.state != State::Asks || Instant::now() < self.until,
            "it asked for nothing within {} s",
            ASKING.as_secs()
        );
        let (ahead, behind) = (self.input.len(), self.output.len());
        ensure!(
            self.state == State::Has || ahead <= AHEAD,
            "it sent {ahead} bytes on without the device; at most {AHEAD} are possible"
        );
        ensure!(
            behind <= BEHIND,
            "it does not read: {behind} bytes wait for it; at most {BEHIND} are possible"
        );
        Ok(())
    }

    fn take_done(&mut self, host: &mut Host) {
        while let Some(done) = host.next_done() {
            self.output.extend(wire::submitted(&done));
        }
    }

    /// Writes waiting bytes. Returns whether any went.
    fn write(&mut self) -> bool {
        let before = self.output.len();
        if self.state != State::Gone && !write_all(&self.stream, &mut self.output) {
            self.state = State::Gone;
        }
        if self.state == State::Leaves && self.output.is_empty() {
            self.state = State::Gone;
        }
        self.output.len() < before
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arrivals::Arrivals;
    use crate::faults::Faults;
    use std::io::Write;
    use std::net::Ipv4Addr;

    const LIST: [u8; 8] = [1, 0x11, 0x80, 5, 0, 0, 0, 0];

    /// Returns a server, and a host without a device: who asks for it waits.
    fn server() -> (Server, Host) {
        let host = Host::new(Faults::default(), Arrivals::default());
        (Server::listen(0).unwrap(), host.of_client())
    }

    fn connect(server: &mut Server) -> TcpStream {
        let before = server.visitors.len();
        let address = (Ipv4Addr::LOCALHOST, server.port().unwrap());
        let client = TcpStream::connect(address).unwrap();
        while server.visitors.len() == before {
            server.accept();
        }
        client
    }

    #[test]
    fn one_that_sends_on_before_its_answer_is_sent_away() {
        let (mut server, mut host) = server();
        let mut client = connect(&mut server);
        client.write_all(&LIST).unwrap();
        client.set_nonblocking(true).unwrap();
        for _ in 0..1000 {
            // The system may take no more for now.
            let _ = client.write(&[0; ROUND]);
            server.exchange(&mut host, true);
            let held = server.visitors.iter().map(|visitor| visitor.input.len());
            assert!(held.sum::<usize>() <= AHEAD);
        }
        assert!(!server.connected());
    }

    #[test]
    fn one_that_does_not_read_is_sent_away() {
        for (length, is_kept) in [(BEHIND, true), (2 * BEHIND, false)] {
            let (mut server, mut host) = server();
            let _client = connect(&mut server);
            let visitor = &mut server.visitors[0];
            visitor.state = State::Leaves;
            // Fills the system's own buffer, which does not count.
            while visitor.stream.write(&[0; ROUND]).is_ok() {}
            visitor.output.resize(length, 0);
            let _ = [(); 2].map(|()| server.exchange(&mut host, true));
            assert_eq!(server.connected(), is_kept);
        }
    }

    #[test]
    fn those_that_ask_for_nothing_are_sent_away_in_time() {
        let (mut server, mut host) = server();
        let mut clients: Vec<TcpStream> = (0..MOST).map(|_| connect(&mut server)).collect();
        clients[0].write_all(&LIST).unwrap();
        clients[1].write_all(&LIST[..7]).unwrap();
        while server.visitors[0].state == State::Asks {
            server.exchange(&mut host, true);
        }
        assert_eq!(server.visitors.len(), MOST);
        for visitor in &mut server.visitors {
            visitor.until = Instant::now();
        }
        server.exchange(&mut host, true);
        assert_eq!(server.visitors.len(), 1, "one has asked");
        connect(&mut server);
    }
}
