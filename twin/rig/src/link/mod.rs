//! The serial port for programs on this machine: a TCP port, a pseudo-terminal, or both; one client
//! at a time.

mod pty;
mod tcp;

use std::collections::VecDeque;
use std::time::Duration;

use anyhow::Context;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::os::fd::{AsFd, BorrowedFd};

pub use pty::Pty;
pub use tcp::Tcp;

/// The longest duration of one check for a client, ms.
const LOOK: u8 = 20;

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

    /// Returns whether a client holds the port; looks for a new one if not. The departure of a
    /// client is reported before the arrival of the next one.
    pub fn connected(&mut self) -> bool {
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

    /// Moves bytes in both directions, without waiting.
    pub fn exchange(&mut self, from_device: &mut VecDeque<u8>, to_device: &mut VecDeque<u8>) {
        if let Some(holder) = self.holder {
            self.endpoints[holder].write(from_device);
            self.endpoints[holder].read(to_device);
        }
    }

    /// Waits a short time for the client to take more, or for a client to come.
    pub fn wait(&self) {
        match self
            .holder
            .and_then(|holder| self.endpoints[holder].writable())
        {
            Some(descriptor) => {
                let mut descriptors = [PollFd::new(descriptor, PollFlags::POLLOUT)];
                // After an error or an interruption the caller checks again.
                let _ = poll(&mut descriptors, PollTimeout::from(LOOK));
            }
            None => std::thread::sleep(Duration::from_millis(LOOK.into())),
        }
    }
}

/// Makes reads and writes of a descriptor return instead of wait.
fn nonblocking(descriptor: impl AsFd) -> anyhow::Result<()> {
    use nix::fcntl::{FcntlArg, OFlag, fcntl};
    fcntl(descriptor, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).context("O_NONBLOCK")?;
    Ok(())
}

/// Reads all available bytes. Returns false if the other end is gone.
fn read_all(descriptor: impl AsFd, to: &mut VecDeque<u8>) -> bool {
    use nix::errno::Errno;
    let mut buffer = [0; 4096];
    loop {
        match nix::unistd::read(&descriptor, &mut buffer) {
            Ok(0) => return false,
            Ok(length) => to.extend(&buffer[..length]),
            Err(Errno::EAGAIN) => return true,
            Err(Errno::EINTR) => {}
            Err(_) => return false,
        }
    }
}

/// Writes until the other end takes no more. Returns false if it is gone.
fn write_all(descriptor: impl AsFd, from: &mut VecDeque<u8>) -> bool {
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
