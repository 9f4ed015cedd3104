//! The serial port as programs on this machine see it: a TCP port, a pseudo-terminal, or both; one
//! client at a time.

mod pty;
mod tcp;

use std::collections::VecDeque;
use std::time::Duration;

use anyhow::Context;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use std::os::fd::{AsFd, BorrowedFd};

pub use pty::Pty;
pub use tcp::Tcp;

/// How long one look for a client may take.
const LOOK: u8 = 20;

/// A byte stream that a client may or may not hold.
pub trait Endpoint: Send + std::fmt::Debug {
    /// Whether the client still holds the other end.
    fn held(&mut self) -> bool;

    /// Whether a client has come to the other end.
    fn offered(&mut self) -> bool;

    /// Takes what the client sent into `to`. Nothing when there is nothing.
    fn read(&mut self, to: &mut VecDeque<u8>);

    /// Writes what the client takes of `from`, without waiting.
    fn write(&mut self, from: &mut VecDeque<u8>);

    /// What becomes ready when the client can take more.
    fn writable(&self) -> Option<BorrowedFd<'_>>;
}

/// The port's endpoints.
#[derive(Debug, Default)]
pub struct Link {
    endpoints: Vec<Box<dyn Endpoint>>,
    /// The one that holds the port.
    holder: Option<usize>,
}

impl Link {
    /// A link over the given endpoints.
    pub fn new(endpoints: Vec<Box<dyn Endpoint>>) -> Self {
        Self {
            endpoints,
            holder: None,
        }
    }

    /// Whether a client holds the port; looks for a new one when none did. A client that leaves is
    /// seen to leave before the next one is seen to come.
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

    /// Moves bytes both ways, without waiting.
    pub fn exchange(&mut self, from_device: &mut VecDeque<u8>, to_device: &mut VecDeque<u8>) {
        if let Some(holder) = self.holder {
            self.endpoints[holder].write(from_device);
            self.endpoints[holder].read(to_device);
        }
    }

    /// Waits a little for the client to take more, or for one to come.
    pub fn wait(&self) {
        match self
            .holder
            .and_then(|holder| self.endpoints[holder].writable())
        {
            Some(descriptor) => {
                let mut descriptors = [PollFd::new(descriptor, PollFlags::POLLOUT)];
                // An error or an interruption only means to look again.
                let _ = poll(&mut descriptors, PollTimeout::from(LOOK));
            }
            None => std::thread::sleep(Duration::from_millis(LOOK.into())),
        }
    }
}

/// Makes a descriptor return instead of wait.
fn nonblocking(descriptor: impl AsFd) -> anyhow::Result<()> {
    use nix::fcntl::{FcntlArg, OFlag, fcntl};
    fcntl(descriptor, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).context("O_NONBLOCK")?;
    Ok(())
}

/// Reads until nothing is left. Answers false when the other end is gone.
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

/// Writes until the other end takes no more. Answers false when it is gone.
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
