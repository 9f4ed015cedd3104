//! The serial port as a pseudo-terminal.
//!
//! This program also holds the terminal's other side open: otherwise the system would reset the
//! terminal and end the stream with each host that leaves. A new host's hello ends the conversation
//! of the one before it.

use hivtac_host::failure::Failure;
use hivtac_host::live::line::converse;
use hivtac_host::live::run::Shared;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::{Errno, FdFlags, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::ffi::OsStr;
use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A host that takes no byte for this time does not read.
const WRITE_PATIENCE: Timespec = Timespec {
    tv_sec: 0,
    tv_nsec: 100_000_000,
};

/// Opens a raw terminal with a symbolic link to it, and serves hosts on a thread of its own.
/// Returns the link. An older link is replaced; another file is not.
///
/// # Errors
/// When the system has no terminal left, or the link cannot be made.
pub fn serve(link: &Path, shared: &Shared) -> Result<PathBuf, Failure> {
    let name = link.display().to_string();
    let failed = |error: io::Error| Failure::of_file(&name, error);
    let (device, terminal, path) = raw_terminal().map_err(|error| failed(error.into()))?;
    if link.is_symlink() {
        std::fs::remove_file(link).map_err(failed)?;
    }
    std::os::unix::fs::symlink(path, link).map_err(failed)?;
    let (shared, device) = (shared.clone(), Arc::new(device));
    std::thread::spawn(move || {
        converse(Side(device.clone()), Side(device), &shared);
        drop(terminal);
    });
    Ok(link.to_owned())
}

/// The device's side, the host's side, and the path of the latter.
fn raw_terminal() -> Result<(OwnedFd, OwnedFd, PathBuf), Errno> {
    let device = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    // Not every system takes it as a flag of `openpt`.
    fcntl_setfd(&device, FdFlags::CLOEXEC)?;
    grantpt(&device)?;
    unlockpt(&device)?;
    let name = ptsname(&device, Vec::new())?;
    let path = PathBuf::from(OsStr::from_bytes(name.as_bytes()));
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let terminal = open(&path, flags, Mode::empty())?;
    let mut settings = tcgetattr(&terminal)?;
    settings.make_raw();
    tcsetattr(&terminal, OptionalActions::Now, &settings)?;
    rustix::fs::fcntl_setfl(&device, OFlags::NONBLOCK)?;
    Ok((device, terminal, path))
}

/// The device's side.
struct Side(Arc<OwnedFd>);

impl Side {
    /// Waits until it can be read or written; returns false if that takes longer than `patience`.
    fn wait(&self, what: PollFlags, patience: Option<&Timespec>) -> io::Result<bool> {
        let mut sides = [PollFd::new(&*self.0, what)];
        Ok(poll(&mut sides, patience)? > 0)
    }
}

impl Read for Side {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.wait(PollFlags::IN, None)?;
        match rustix::io::read(&*self.0, buffer) {
            Err(Errno::AGAIN) => Err(io::ErrorKind::Interrupted.into()),
            result => Ok(result?),
        }
    }
}

impl Write for Side {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if !self.wait(PollFlags::OUT, Some(&WRITE_PATIENCE))? {
            return Err(io::ErrorKind::TimedOut.into());
        }
        match rustix::io::write(&*self.0, bytes) {
            Err(Errno::AGAIN) => Err(io::ErrorKind::TimedOut.into()),
            result => Ok(result?),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
