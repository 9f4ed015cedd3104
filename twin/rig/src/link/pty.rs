//! The serial port as a pseudo-terminal.
//!
//! The rig itself keeps the terminal side open to keep it raw: the system resets a terminal that no
//! program holds. For this reason a hang-up on the other side does not show that a client left;
//! inotify does.

use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};

use anyhow::Context;
use nix::fcntl::{OFlag, open};
use nix::pty::{PtyMaster, grantpt, posix_openpt, ptsname_r, unlockpt};
use nix::sys::inotify::{AddWatchFlags, InitFlags, Inotify};
use nix::sys::stat::Mode;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

use super::{Endpoint, nonblocking, read_some, write_all};

/// A pseudo-terminal whose other side a client may open.
#[derive(Debug)]
pub struct Pty {
    master: PtyMaster,
    terminal: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    events: Inotify,
    clients: i32,
}

impl Pty {
    /// Opens a raw terminal, with a symbolic link to it if `link` is given. An older link is
    /// replaced.
    ///
    /// # Errors
    /// If the system has no terminal left, or the link cannot be made.
    pub fn open(link: Option<&Path>) -> anyhow::Result<Self> {
        // Programs that are started meanwhile must not inherit it.
        let flags = OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC;
        let master = posix_openpt(flags).context("pseudo-terminal")?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let path = PathBuf::from(ptsname_r(&master)?);
        let terminal = open(&path, flags, Mode::empty())?;
        let mut settings = tcgetattr(&terminal)?;
        cfmakeraw(&mut settings);
        tcsetattr(&terminal, SetArg::TCSANOW, &settings)?;
        nonblocking(&master)?;
        let events = Inotify::init(InitFlags::IN_NONBLOCK | InitFlags::IN_CLOEXEC)?;
        events.add_watch(&path, AddWatchFlags::IN_OPEN | AddWatchFlags::IN_CLOSE)?;
        if let Some(link) = link {
            make_link(&path, link)?;
        }
        Ok(Self {
            master,
            terminal,
            path,
            link: link.map(Path::to_owned),
            events,
            clients: 0,
        })
    }

    /// Returns the terminal's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn count_clients(&mut self) {
        for event in self.events.read_events().unwrap_or_default() {
            self.clients += i32::from(event.mask.contains(AddWatchFlags::IN_OPEN));
            self.clients -= i32::from(event.mask.intersects(AddWatchFlags::IN_CLOSE));
        }
    }
}

fn make_link(path: &Path, link: &Path) -> anyhow::Result<()> {
    if link.is_symlink() {
        std::fs::remove_file(link).with_context(|| format!("--pty-link {}", link.display()))?;
    }
    std::os::unix::fs::symlink(path, link).with_context(|| format!("--pty-link {}", link.display()))
}

impl Endpoint for Pty {
    fn held(&mut self) -> bool {
        self.count_clients();
        self.clients > 0
    }

    fn offered(&mut self) -> bool {
        self.held()
    }

    fn read(&mut self, to: &mut VecDeque<u8>) {
        // While the rig holds the terminal, the other side is never gone.
        read_some(&self.master, to);
    }

    fn write(&mut self, from: &mut VecDeque<u8>) {
        write_all(&self.master, from);
    }

    fn writable(&self) -> Option<BorrowedFd<'_>> {
        Some(self.master.as_fd())
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        // Bytes that were not read go away with the terminal.
        let _ = nix::sys::termios::tcflush(&self.terminal, nix::sys::termios::FlushArg::TCIOFLUSH);
        if let Some(link) = &self.link {
            let _ = std::fs::remove_file(link);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::OpenOptions;
    use std::io::{Read, Write};

    #[test]
    fn a_client_comes_talks_raw_and_goes() {
        let directory = tempfile::tempdir().unwrap();
        let link = directory.path().join("port");
        let mut pty = Pty::open(Some(&link)).unwrap();
        assert!(!pty.held());
        let mut client = OpenOptions::new()
            .read(true)
            .write(true)
            .open(&link)
            .unwrap();
        assert!(pty.held());
        client.write_all(b"a\r\n\x03").unwrap();
        let mut got = VecDeque::new();
        while got.len() < 4 {
            pty.read(&mut got);
        }
        assert_eq!(got, b"a\r\n\x03");
        pty.write(&mut VecDeque::from(b"\n\x00\x04".to_vec()));
        let mut answer = [0; 3];
        client.read_exact(&mut answer).unwrap();
        assert_eq!(&answer, b"\n\x00\x04");
        drop(client);
        assert!(!pty.held());
        drop(pty);
        assert!(!link.is_symlink());
    }
}
