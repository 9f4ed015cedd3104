//! The rig as a program beside this one.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::process;

/// How long the rig may take to end once its client has left.
const FAREWELL: Duration = Duration::from_secs(30);

/// A running rig. Killed when this is dropped.
pub struct Rig {
    process: Child,
    port: String,
}

impl Rig {
    /// Starts the rig and waits until its serial port is there. What it says goes to the log.
    ///
    /// # Errors
    /// When it cannot be started, or ends before it is ready.
    pub fn start(command: &mut Command, log: &Path) -> Result<Rig> {
        process::show(command);
        let file = File::create(log).with_context(|| format!("creating {}", log.display()))?;
        let process = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(file)
            .spawn()
            .with_context(|| format!("cannot start `{}`", process::display(command)))?;
        let mut rig = Rig {
            process,
            port: String::new(),
        };
        let stdout = rig
            .process
            .stdout
            .take()
            .context("the rig's output is not piped")?;
        let mut line = String::new();
        BufReader::new(stdout)
            .read_line(&mut line)
            .context("reading what the rig says")?;
        rig.port = pty(&line).with_context(|| format!("the rig did not get ready: `{line}`"))?;
        Ok(rig)
    }

    /// The pseudo-terminal that is its serial port.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Waits for the rig to end by itself, as it does when its client has left.
    ///
    /// # Errors
    /// When it does not end, or says that something went wrong.
    pub fn finish(mut self) -> Result<()> {
        let start = Instant::now();
        while start.elapsed() < FAREWELL {
            if let Some(status) = self.process.try_wait().context("waiting for the rig")? {
                ensure!(status.success(), "the rig failed ({status})");
                return Ok(());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        bail!("the rig did not end within {} s", FAREWELL.as_secs());
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // Fails only when it has ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The terminal's path in the line `ready … pty=PATH`.
fn pty(line: &str) -> Option<String> {
    let rest = line.strip_prefix("ready ")?;
    let (_, path) = rest.split_once("pty=")?;
    Some(path.trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_terminal_is_found_in_the_first_line() {
        assert_eq!(pty("ready pty=/dev/pts/4\n").as_deref(), Some("/dev/pts/4"));
        let both = "ready tcp=127.0.0.1:4000 pty=/dev/pts/4\n";
        assert_eq!(pty(both).as_deref(), Some("/dev/pts/4"));
        assert_eq!(pty("hivtac-rig: no such file\n"), None);
    }

    #[test]
    fn a_rig_that_ends_at_once_is_an_error() {
        let log = std::env::temp_dir().join(format!("xtask-rig-{}.log", std::process::id()));
        assert!(Rig::start(&mut Command::new("true"), &log).is_err());
        let _ = std::fs::remove_file(log);
    }
}
