//! Runs the rig for other commands.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::process;

/// A running rig, which is killed when this value is dropped.
pub struct Rig {
    process: Child,
    /// The address or path of its port.
    pub port: String,
}

impl Rig {
    /// Starts the rig and waits for its port. Its messages go to the log.
    pub fn start(command: &mut Command, log: &Path) -> Result<Rig> {
        process::say(&format!("+ {command:?}"));
        let file = File::create(log).with_context(|| format!("creating {}", log.display()))?;
        command.stdin(Stdio::null()).stdout(Stdio::piped());
        let process = command.stderr(file).spawn().context("starting the rig")?;
        let port = String::new();
        let mut rig = Rig { process, port };
        let stdout = rig.process.stdout.take().context("the rig's output")?;
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line)?;
        // `ready pty=PATH`, `ready usbip=ADDRESS`
        let ready = line.trim_end().strip_prefix("ready ");
        let port = ready.and_then(|ready| ready.split_once('='));
        let (_, port) = port.with_context(|| format!("the rig did not get ready: `{line}`"))?;
        rig.port = port.to_owned();
        Ok(rig)
    }

    /// A command of the host tool at the rig's port. The emulated board boots slower than a real
    /// one.
    pub fn ask(&self, tool: &Path, arguments: &[&str]) -> Command {
        let mut command = Command::new(tool);
        command.args(arguments);
        command.args(["--port", &self.port, "--timeout", "120"]);
        command
    }

    /// Makes the rig end, and waits for that.
    pub fn finish(self) -> Result<()> {
        let id = self.process.id().to_string();
        let is_signalled = process::succeeds(Command::new("kill").args(["-TERM", &id]));
        ensure!(is_signalled, "the rig is gone");
        self.ended()
    }

    /// Waits for its end.
    pub fn ended(mut self) -> Result<()> {
        let status = self.process.wait()?;
        ensure!(status.success(), "the rig failed ({status})");
        Ok(())
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // Fails only if it has ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
