//! Runs the rig with the firmware, and the host tool as a user runs it.
//!
//! The rig runs inside the test program: the translation of the firmware from one run serves the
//! next. The tests of `twin/rig/` and those in Python run the rig as a separate program.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, Result, anyhow, ensure};
use clap::Parser;
use hivtac_rig::command::Arguments;
use hivtac_rig::frame_source::FrameSource;
use hivtac_rig::mpu::Protection;
use hivtac_rig::run::run;
use hivtac_tests::artifact;
use hivtac_twin::{Frame, Scene, Shutter};
use serde_json::Value;
use tempfile::TempDir;

/// The longest duration of the host tool: the emulator runs at about a tenth of real time, and
/// tests share the processors.
const PATIENCE: Duration = Duration::from_secs(240);
/// Timeout of the host tool for an answer, s: the emulated board boots slower than a real one.
pub const TIMEOUT_S: u32 = 40;
/// The same for an intended silence, during which the rig runs on.
pub const SILENCE_S: u32 = 20;

/// Returns the frame of an exposure, from its line in the truth log.
pub fn exposed(scene: &Scene, line: &Value) -> Frame {
    let number = |key: &str| line[key].as_f64().unwrap();
    let shutter = Shutter {
        exposure_s: number("exposure_s"),
        readout_s: number("readout_s"),
    };
    let exposure = line["exposure"].as_u64().unwrap();
    scene.frame_by(&shutter, exposure, number("time_s"))
}

/// A running rig with its logs; it ends when it is dropped.
pub struct Rig {
    running: Option<JoinHandle<Result<()>>>,
    interrupt: Arc<AtomicBool>,
    port: String,
    folder: TempDir,
}

impl Rig {
    /// Starts the rig with the firmware (`HIVTAC_ELF`) and further options. It runs while a client
    /// holds its port.
    ///
    /// # Errors
    /// If it does not become ready.
    pub fn start(options: &[&str]) -> Result<Rig> {
        Rig::start_with(&artifact::named_by("HIVTAC_ELF"), options)
    }

    /// As [`Rig::start`], with a scene by its text.
    ///
    /// # Errors
    /// If it does not become ready.
    pub fn start_under(scene: &str, options: &[&str]) -> Result<Rig> {
        let folder = tempfile::tempdir().context("creating a temporary folder")?;
        let file = folder.path().join("scene.toml");
        fs::write(&file, scene).context("writing the scene")?;
        let file = file.to_str().context("a path in UTF-8")?;
        Rig::start(&[&["--scene", file], options].concat())
    }

    /// As [`Rig::start`], with another firmware.
    ///
    /// # Errors
    /// If it does not become ready.
    pub fn start_with(elf: &Path, options: &[&str]) -> Result<Rig> {
        Rig::start_before(elf, options, |source| source)
    }

    /// As [`Rig::start_with`]; the camera sees the scene as changed by `look`.
    ///
    /// # Errors
    /// If it does not become ready.
    pub fn start_before(
        elf: &Path,
        options: &[&str],
        look: impl FnOnce(Box<dyn FrameSource>) -> Box<dyn FrameSource>,
    ) -> Result<Rig> {
        let folder = tempfile::tempdir().context("creating a temporary folder")?;
        let [truth, stats] = ["truth", "stats"].map(|name| folder.path().join(name));
        let mut arguments = Vec::from(["hivtac-rig", "--pty"].map(OsString::from));
        arguments.extend(["--truth".into(), truth.into()]);
        arguments.extend(["--stats-json".into(), stats.into()]);
        arguments.extend(options.iter().map(OsString::from));
        arguments.push(elf.into());
        let arguments = Arguments::try_parse_from(arguments)?;
        let interrupt = Arc::new(AtomicBool::new(false));
        let (mut run_options, port) = arguments.prepare(interrupt.clone())?;
        // The rig's own tests enforce the firmware's regions, and show that this changes nothing.
        run_options.protection = Protection::Ignored;
        run_options.source = look(run_options.source);
        let terminal = port.and_then(|port| port.pty);
        let port = terminal.as_ref().and_then(|path| path.to_str());
        let port = port.context("it has a terminal")?.to_owned();
        let running = thread::spawn(move || {
            let outcome = run(run_options).and_then(|outcome| arguments.leave(&outcome));
            // Printed at once, because the host tool only sees that its port is silent.
            outcome.inspect_err(|error| eprintln!("the rig failed: {error:#}"))
        });
        Ok(Rig {
            running: Some(running),
            interrupt,
            port,
            folder,
        })
    }

    /// Returns the path of the pseudo-terminal that is its serial port.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Returns the path of its log of every exposure's truth.
    pub fn truth_file(&self) -> PathBuf {
        self.file("truth")
    }

    /// Returns the truth of every exposure until now, without an incomplete last line.
    ///
    /// # Errors
    /// If the log cannot be read.
    pub fn truth(&self) -> Result<Vec<Value>> {
        let text = fs::read_to_string(self.truth_file()).context("reading the truth log")?;
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        json_lines(whole)
    }

    /// Ends the rig, and returns its counters.
    ///
    /// # Errors
    /// If the rig failed.
    pub fn finish(mut self) -> Result<Value> {
        self.end()?;
        let text = fs::read_to_string(self.file("stats")).context("reading the counters")?;
        serde_json::from_str(&text).context("the counters are not JSON")
    }

    /// Makes the rig end, which takes it less than a millisecond of its own time.
    fn end(&mut self) -> Result<()> {
        self.interrupt.store(true, Ordering::Relaxed);
        let ended = self.running.take().map(JoinHandle::join);
        let ended = ended.context("it runs")?;
        ended
            .map_err(|_| anyhow!("the rig panicked"))?
            .context("the rig failed")
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        // Fails if the rig has already ended; a failing test does not need this error.
        let _ = self.end();
    }
}

/// The results of the host tool.
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
/// If it cannot be started, or does not end.
pub fn tool(rig: &Rig, command: &str, options: &[&str]) -> Result<ToolOutput> {
    tool_waiting(rig, TIMEOUT_S, command, options)
}

/// As [`tool`], with this timeout in seconds.
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
        .arg(format!("{seconds}"))
        .arg(artifact::named_by("HIVTAC_TOOL"))
        .args(command.split(' '))
        .args(["--port", rig.port()])
        .args(["--timeout", &format!("{timeout_s}")])
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
    ensure!(result.code != Some(124), "hivtac did not end: {result:?}");
    Ok(result)
}

/// Tells the firmware that a needle presses, as it does in most scenes.
///
/// # Errors
/// As [`tool`], or if the tool fails.
pub fn set_needle(rig: &Rig) -> Result<()> {
    let set = tool(rig, "settings set contact needle", &[])?;
    ensure!(set.code == Some(0), "{set:?}");
    Ok(())
}

/// Reads one JSON value per line.
///
/// # Errors
/// If a line is not JSON; the error names the line.
pub fn json_lines(text: &str) -> Result<Vec<Value>> {
    let parse = |line| serde_json::from_str(line).with_context(|| format!("no JSON: {line}"));
    text.lines().map(parse).collect()
}
