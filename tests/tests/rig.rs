//! The rig with the firmware, and the host tool, as programs: what a user would run.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::string::String;
use std::time::{Duration, Instant};
use std::{thread, vec::Vec};

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use tempfile::TempDir;

use crate::artifact;

/// How long anything may take here: the emulator runs at about a tenth of real time, and tests
/// share the processors.
const PATIENCE: Duration = Duration::from_secs(240);
/// How long the host tool waits for an answer, s: the emulated board boots slower than a real one.
pub const TIMEOUT_S: u32 = 40;

/// A running rig with its logs. Killed when it is dropped.
pub struct Rig {
    process: Child,
    port: String,
    folder: TempDir,
    /// Kept open: a rig that cannot print would fail.
    _stdout: BufReader<ChildStdout>,
}

impl Rig {
    /// Starts the rig (`HIVTAC_RIG`) with the firmware (`HIVTAC_ELF`) and further options. It runs
    /// while a client holds its port.
    ///
    /// # Errors
    /// When it does not get ready.
    pub fn start(options: &[&str]) -> Result<Rig> {
        Rig::start_with(&artifact::named_by("HIVTAC_ELF"), options)
    }

    /// The same with another firmware.
    ///
    /// # Errors
    /// When it does not get ready.
    pub fn start_with(elf: &Path, options: &[&str]) -> Result<Rig> {
        let folder = tempfile::tempdir().context("creating a temporary folder")?;
        let mut process = Command::new(artifact::named_by("HIVTAC_RIG"))
            .arg("--pty")
            .arg("--truth")
            .arg(folder.path().join("truth"))
            .arg("--stats-json")
            .arg(folder.path().join("stats"))
            .args(options)
            .arg(elf)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(File::create(folder.path().join("log"))?)
            .spawn()
            .context("starting the rig")?;
        let stdout = process
            .stdout
            .take()
            .context("the rig's output is not piped")?;
        let mut stdout = BufReader::new(stdout);
        let mut line = String::new();
        stdout
            .read_line(&mut line)
            .context("reading what the rig says")?;
        let port = line
            .trim_end()
            .split_once("pty=")
            .map(|(_, path)| String::from(path));
        let mut rig = Rig {
            process,
            port: String::new(),
            folder,
            _stdout: stdout,
        };
        rig.port = port.with_context(|| std::format!("not ready: {line}{}", rig.log()))?;
        Ok(rig)
    }

    /// The pseudo-terminal that is its serial port.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Where it logs what is true of every exposure.
    pub fn truth_file(&self) -> PathBuf {
        self.file("truth")
    }

    /// What is true of every exposure so far.
    ///
    /// # Errors
    /// When the log cannot be read.
    pub fn truth(&self) -> Result<Vec<Value>> {
        json_lines(&fs::read_to_string(self.file("truth")).context("reading the truth log")?)
    }

    /// What it said on standard error.
    pub fn log(&self) -> String {
        fs::read_to_string(self.file("log")).unwrap_or_default()
    }

    /// Ends it, and gives its counters.
    ///
    /// # Errors
    /// When it does not end, or failed.
    pub fn finish(mut self) -> Result<Value> {
        let id = std::format!("{}", self.process.id());
        // Fails when it has ended already, and its exit code says why.
        let _ = Command::new("kill")
            .args(["-TERM", &id])
            .stderr(Stdio::null())
            .status();
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Some(status) = self.process.try_wait()? {
                ensure!(
                    status.success(),
                    "the rig failed ({status}): {}",
                    self.log()
                );
                let text =
                    fs::read_to_string(self.file("stats")).context("reading the counters")?;
                return serde_json::from_str(&text).context("the counters are not JSON");
            }
            thread::sleep(Duration::from_millis(20));
        }
        bail!("the rig did not end: {}", self.log())
    }

    fn file(&self, name: &str) -> PathBuf {
        Path::join(self.folder.path(), name)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // Fails only when it has ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// What the host tool left.
#[derive(Clone, Debug)]
pub struct ToolOutput {
    /// Its exit code.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Runs a command of the host tool (`HIVTAC_TOOL`), such as `threshold auto`, on a rig's port until
/// it ends. It waits up to [`TIMEOUT_S`] for an answer.
///
/// # Errors
/// When it cannot be started, or does not end.
pub fn tool(rig: &Rig, command: &str, options: &[&str]) -> Result<ToolOutput> {
    tool_waiting(rig, TIMEOUT_S, command, options)
}

/// The same where a silence is meant, with so many seconds to wait: all the while the rig runs on.
///
/// # Errors
/// As [`tool`].
pub fn tool_waiting(
    rig: &Rig,
    timeout_s: u32,
    command: &str,
    options: &[&str],
) -> Result<ToolOutput> {
    let seconds = PATIENCE.as_secs();
    let output = Command::new("timeout")
        .arg(std::format!("{seconds}"))
        .arg(artifact::named_by("HIVTAC_TOOL"))
        .args(command.split(' '))
        .args(["--port", rig.port()])
        .args(["--timeout", &std::format!("{timeout_s}")])
        .args(options)
        .stdin(Stdio::null())
        .output()
        .context("starting hivtac")?;
    let text = |bytes: &[u8]| String::from(String::from_utf8_lossy(bytes));
    let result = ToolOutput {
        code: output.status.code(),
        out: text(&output.stdout),
        err: text(&output.stderr),
    };
    ensure!(
        result.code != Some(124),
        "hivtac did not end: {result:?}\nrig: {}",
        rig.log()
    );
    Ok(result)
}

/// One JSON value a line.
///
/// # Errors
/// Names the line that is none.
pub fn json_lines(text: &str) -> Result<Vec<Value>> {
    let parse = |line| serde_json::from_str(line).with_context(|| std::format!("no JSON: {line}"));
    text.lines().map(parse).collect()
}
