//! The device's serial port for programs on this machine: a TCP port, a pseudo-terminal, or both;
//! one client at a time. [`crate::usbip`] has the device itself.

mod pty;
mod tcp;

use std::collections::VecDeque;
use std::net::{Ipv4Addr, TcpListener};
use std::time::Duration;

use anyhow::Context;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::os::fd::{AsFd, BorrowedFd};

pub use pty::Pty;
pub use tcp::Tcp;

use crate::usb_host::Host;

/// The longest duration of one check for a client, ms.
const LOOK: u8 = 20;
/// The most bytes of one read call.
const PART: usize = 1 << 12;
/// The most bytes that are read at a time: a client that sends on and on does not hold the run.
pub(crate) const ROUND: usize = 16 * PART;

/// A byte stream with or without a client at its other end.
pub trait Endpoint: Send + std::fmt::Debug {
    /// Returns whether the client still holds the other end.
    fn held(&mut self) -> bool;

    /// Returns whether a client has come to the other end.
    fn offered(&mut self) -> bool;

    /// Appends the client's bytes to `to`, if there are any.
    fn read(&mut self, to: &mut VecDeque<u8>);

    /// Writes as many bytes of `from` as the client takes, without waiting.
    fn write(&mut self, from: &mut VecDeque<u8>);

    /// Returns the descriptor that becomes ready when the client can take more.
    fn writable(&self) -> Option<BorrowedFd<'_>>;
}

/// The near end of the clients' port.
pub trait Plug: Send + std::fmt::Debug {
    /// Returns whether the client is a USB host itself, not a program on the serial port.
    fn is_host(&self) -> bool {
        false
    }

    /// Returns whether a client is there; looks for one if not.
    fn connected(&mut self) -> bool;

    /// Moves bytes between client and host, without waiting; `is_here` says whether a client is
    /// connected.
    fn exchange(&mut self, host: &mut Host, is_here: bool) -> Traffic;

    /// Waits a short time for the client to take more, or for a client to come.
    fn wait(&self);
}

/// The result of an exchange with a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traffic {
    /// Whether bytes moved.
    pub moved: bool,
    /// Whether bytes wait for the client.
    pub waits: bool,
}

/// The port's endpoints.
#[derive(Debug, Default)]
pub struct Link {
    endpoints: Vec<Box<dyn Endpoint>>,
    /// The endpoint that holds the port.
    holder: Option<usize>,
}

impl Link {
    /// Returns a link over the given endpoints.
    pub fn new(endpoints: Vec<Box<dyn Endpoint>>) -> Self {
        Self {
            endpoints,
            holder: None,
        }
    }
}

impl Plug for Link {
    /// The departure of a client is reported before the arrival of the next one.
    fn connected(&mut self) -> bool {
        match self.holder {
            Some(holder) => {
                if !self.endpoints[holder].held() {
                    self.holder = None;
                }
            }
            None => {
                self.holder = self
                    .endpoints
                    .iter_mut()
                    .position(|endpoint| endpoint.offered())
            }
        }
        self.holder.is_some()
    }

    fn exchange(&mut self, host: &mut Host, is_here: bool) -> Traffic {
        host.set_open(is_here);
        let Host {
            from_device,
            to_device,
            ..
        } = host;
        let before = (from_device.len(), to_device.len());
        if let Some(holder) = self.holder {
            self.endpoints[holder].write(from_device);
            self.endpoints[holder].read(to_device);
        }
        Traffic {
            moved: before != (from_device.len(), to_device.len()),
            waits: !from_device.is_empty(),
        }
    }

    fn wait(&self) {
        let holder = self.holder.map(|holder| &self.endpoints[holder]);
        wait_for(holder.and_then(|holder| holder.writable()));
    }
}

/// Listens on 127.0.0.1 for an option of the command line; port 0 takes a free one.
///
/// # Errors
/// If the port is taken.
pub(crate) fn listen(option: &str, port: u16) -> anyhow::Result<TcpListener> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
        .with_context(|| format!("{option} {port}"))?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Waits a short time until one of these descriptors takes more, or, without any, for a client.
pub(crate) fn wait_for<'a>(descriptors: impl IntoIterator<Item = BorrowedFd<'a>>) {
    let polled = |descriptor| PollFd::new(descriptor, PollFlags::POLLOUT);
    let mut descriptors: Vec<_> = descriptors.into_iter().map(polled).collect();
    if descriptors.is_empty() {
        return std::thread::sleep(Duration::from_millis(LOOK.into()));
    }
    // After an error or an interruption the caller checks again.
    let _ = poll(&mut descriptors, PollTimeout::from(LOOK));
}

/// Makes reads and writes of a descriptor return instead of wait.
fn nonblocking(descriptor: impl AsFd) -> anyhow::Result<()> {
    use nix::fcntl::{FcntlArg, OFlag, fcntl};
    fcntl(descriptor, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).context("O_NONBLOCK")?;
    Ok(())
}

/// Reads the available bytes, at most [`ROUND`]. Returns false if the other end is gone.
pub(crate) fn read_some(descriptor: impl AsFd, to: &mut VecDeque<u8>) -> bool {
    use nix::errno::Errno;
    let mut buffer = [0; PART];
    for _ in 0..ROUND / PART {
        match nix::unistd::read(&descriptor, &mut buffer) {
            Ok(0) => return false,
            Ok(length) => to.extend(&buffer[..length]),
            Err(Errno::EAGAIN) => return true,
            Err(Errno::EINTR) => {}
            Err(_) => return false,
        }
    }
    true
}

/// Writes until the other end takes no more. Returns false if it is gone.
pub(crate) fn write_all(descriptor: impl AsFd, from: &mut VecDeque<u8>) -> bool {
    use nix::errno::Errno;
    while !from.is_empty() {
        match nix::unistd::write(&descriptor, from.as_slices().0) {
            Ok(length) => drop(from.drain(..length)),
            Err(Errno::EAGAIN) => return true,
            Err(Errno::EINTR) => {}
            Err(_) => return false,
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::os::unix::net::UnixStream;

    #[test]
    fn a_client_that_sends_much_is_read_in_rounds() {
        let (near, mut far) = UnixStream::pair().unwrap();
        for stream in [&near, &far] {
            stream.set_nonblocking(true).unwrap();
        }
        let mut sent = 0;
        while let Ok(length) = far.write(&[7; PART]) {
            sent += length;
        }
        assert!(sent > ROUND, "the system takes {sent} bytes");
        let mut got = VecDeque::new();
        while got.len() < sent {
            let before = got.len();
            assert!(read_some(&near, &mut got));
            assert!(got.len() <= before + ROUND);
        }
        drop(far);
        assert!(!read_some(&near, &mut got));
    }
}
