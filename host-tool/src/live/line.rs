//! Bytes to and from a host: one at a time, over TCP, or over anything that reads and writes.

use super::run::Shared;
use hivtac_wire::frame::{MAX_DEVICE_FRAME, encode};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Longest wait for a message, after which a sender looks whether its host is still there.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// A host that takes no byte for this time does not read.
const WRITE_PATIENCE: Duration = Duration::from_millis(100);

/// A port of this computer at which hosts may connect.
#[derive(Debug)]
pub struct Tcp {
    listener: TcpListener,
    port: u16,
}

impl Tcp {
    /// Listens on 127.0.0.1; port 0 takes a free one.
    ///
    /// # Errors
    /// When the port is taken or not allowed.
    pub fn listen(port: u16) -> io::Result<Tcp> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        let port = listener.local_addr()?.port();
        Ok(Tcp { listener, port })
    }

    /// The port's number.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Serves one host after the other, for ever. Further ones wait until the present one leaves.
    pub fn serve(&self, shared: &Shared) {
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else {
                // Too many open files, for example: later there may be fewer.
                std::thread::sleep(LOOK_EVERY);
                continue;
            };
            // A host that has left again does not count.
            let _ = converse_over(&stream, shared);
        }
    }
}

fn converse_over(stream: &TcpStream, shared: &Shared) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
    converse(stream, stream, shared);
    Ok(())
}

/// Serves a host until its bytes end. `write` gives up with an error when the host does not read.
pub fn converse(mut read: impl Read, write: impl Write + Send, shared: &Shared) {
    let is_there = AtomicBool::new(true);
    std::thread::scope(|scope| {
        scope.spawn(|| send(write, shared, &is_there));
        let mut buffer = [0; 4096];
        loop {
            match read.read(&mut buffer) {
                Ok(0) => break,
                Ok(length) => {
                    let bytes = buffer.get(..length).unwrap_or(&buffer);
                    shared.act(|device| device.receive(bytes, shared.now_us()));
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => break,
            }
        }
        is_there.store(false, Ordering::Relaxed);
    });
    shared.act(|device| device.hang_up());
}

fn send(mut write: impl Write, shared: &Shared, is_there: &AtomicBool) {
    // A zero byte precedes the first frame, and each frame after a cut one.
    let mut buffer = [0; 1 + MAX_DEVICE_FRAME];
    let mut cut = true;
    while is_there.load(Ordering::Relaxed) {
        let Some(message) = shared.message(LOOK_EVERY) else {
            continue;
        };
        let Some(Ok(frame)) = buffer.get_mut(1..).map(|rest| encode(&message, rest)) else {
            // Never happens: the longest frame fits.
            continue;
        };
        let length = 1 + frame.len();
        let bytes = buffer.get(usize::from(!cut)..length).unwrap_or(&[]);
        cut = write.write_all(bytes).and_then(|()| write.flush()).is_err();
        if cut {
            shared.act(|device| device.cut(&message));
        }
    }
}
