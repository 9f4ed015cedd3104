//! `cargo xtask demo`: the firmware on the emulated board, a simulated tip that presses it, and the
//! forces.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, anyhow};
use clap::Args;

use crate::artifacts::Board;
use crate::rig::Rig;
use crate::summary::{self, Summary};
use crate::toolchain::Toolchain;
use crate::{artifacts, process, workspace};

/// Options of `cargo xtask demo`.
#[derive(Args)]
pub struct Demo {
    /// End after this many frames.
    #[arg(long, default_value_t = 150, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// The board and its camera: an OV7725 on the first, an MT9V034 on the second.
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Print one JSON object instead: frames, rate_hz, latency_ms, direction_deg, magnitude_mn,
    /// place_um.
    #[arg(long)]
    json: bool,
}

/// What the demo runs, and where it writes.
struct Stage {
    board: Board,
    firmware: PathBuf,
    rig: PathBuf,
    tool: PathBuf,
    truth: PathBuf,
    arrivals: PathBuf,
    log: PathBuf,
}

impl Demo {
    /// Builds what is needed, runs the rig, and shows what the host tool says.
    ///
    /// # Errors
    /// When something cannot be built or fails; names the rig's log when it was running.
    pub fn run(&self, toolchain: &Toolchain) -> Result<()> {
        let start = Instant::now();
        let stage = Stage::build(toolchain, self.board)?;
        let built = start.elapsed();
        let outcome = match self.json {
            true => self.summarize(&stage),
            false => self.show(&stage),
        };
        if outcome.is_err() {
            stage.show_log();
        }
        outcome.with_context(|| format!("the rig's log is {}", stage.log.display()))?;
        let shown = start.elapsed() - built;
        let (built, shown) = (built.as_secs_f64(), shown.as_secs_f64());
        eprintln!("\nbuilt in {built:.1} s, shown in {shown:.1} s");
        eprintln!("truth: {}", stage.truth.display());
        eprintln!("log:   {}", stage.log.display());
        Ok(())
    }

    fn show(&self, stage: &Stage) -> Result<()> {
        eprintln!(
            "The board boots, and {} frames pass: some half a minute.",
            self.frames
        );
        let rig = Rig::start(&mut stage.rig_command(), &stage.log)?;
        process::run(&mut self.monitor(stage, rig.port()))?;
        rig.finish()?;
        let (rate_hz, latency_ms) = (stage.rate_hz()?, stage.latency_ms()?);
        println!(
            "rate: {rate_hz:.1} forces a second; latency: {latency_ms:.2} ms from the middle of \
             the exposure to the last byte on USB"
        );
        Ok(())
    }

    fn summarize(&self, stage: &Stage) -> Result<()> {
        let rig = Rig::start(&mut stage.rig_command(), &stage.log)?;
        let mut monitor = self.monitor(stage, rig.port());
        process::show(monitor.arg("--json"));
        let lines = process::output(&mut monitor)?;
        rig.finish()?;
        let [truth, arrivals] = stage.logs()?;
        let summary = Summary::of(&lines, &truth, &arrivals)?;
        println!("{}", serde_json::to_string(&summary)?);
        Ok(())
    }

    fn monitor(&self, stage: &Stage, port: &str) -> Command {
        let mut command = stage.monitor_command(port, self.frames);
        command.arg("--truth").arg(&stage.truth);
        command
    }
}

/// The host tool's JSON lines for the first frames of the demo.
///
/// # Errors
/// As the demo.
pub fn json_lines(toolchain: &Toolchain, frames: u64) -> Result<String> {
    let stage = Stage::build(toolchain, Board::default())?;
    let rig = Rig::start(&mut stage.rig_command(), &stage.log)?;
    let mut monitor = stage.monitor_command(rig.port(), frames);
    process::show(monitor.arg("--json"));
    let lines = process::output(&mut monitor);
    let lines = lines.with_context(|| format!("the rig's log is {}", stage.log.display()))?;
    rig.finish()?;
    Ok(lines)
}

impl Stage {
    /// Builds the firmware beside the rig, whose emulator takes longest, and the host tool.
    fn build(toolchain: &Toolchain, board: Board) -> Result<Stage> {
        eprintln!(
            "Building the firmware, the emulated board and the host tool: some four minutes the \
             first time on two cores, a second from then on."
        );
        let folder = workspace::work_folder("demo")?;
        let (firmware, tools) = std::thread::scope(|scope| {
            let firmware = scope.spawn(|| artifacts::firmware_for(toolchain, board, ""));
            (firmware.join(), artifacts::rig_and_host_tool())
        });
        let firmware = firmware.map_err(|_| anyhow!("building the firmware panicked"))??;
        let [rig, tool] = tools?;
        Ok(Stage {
            board,
            firmware,
            rig,
            tool,
            truth: folder.join("truth.jsonl"),
            arrivals: folder.join("arrivals.jsonl"),
            log: folder.join("rig.log"),
        })
    }

    fn rig_command(&self) -> Command {
        let mut command = Command::new(&self.rig);
        command
            .args(["--board", self.board.name(), "--scene", "demo"])
            .args(["--pty", "--exit-on-hangup", "--truth"])
            .arg(&self.truth)
            .arg("--arrivals")
            .arg(&self.arrivals)
            .arg(&self.firmware);
        command
    }

    fn monitor_command(&self, port: &str, frames: u64) -> Command {
        let mut command = Command::new(&self.tool);
        command
            .args(["monitor", "--port", port, "--frames", &frames.to_string()])
            // The emulated board boots slower than a real one.
            .args(["--timeout", "120"]);
        command
    }

    /// What the rig wrote of truth and arrivals.
    fn logs(&self) -> Result<[String; 2]> {
        let read = |path: &Path| {
            fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))
        };
        Ok([read(&self.truth)?, read(&self.arrivals)?])
    }

    /// Samples a second.
    fn rate_hz(&self) -> Result<f64> {
        let [truth, arrivals] = self.logs()?;
        summary::rate_hz(&truth, &arrivals)
    }

    /// Mean latency of all samples, ms.
    fn latency_ms(&self) -> Result<f64> {
        let [truth, arrivals] = self.logs()?;
        summary::latency_ms(&summary::parsed(&arrivals)?, &truth, &arrivals)
    }

    fn show_log(&self) {
        eprintln!("\nThe last lines of the rig's log:");
        for line in last_lines(&self.log, 20) {
            eprintln!("  {line}");
        }
    }
}

fn last_lines(file: &Path, count: usize) -> Vec<String> {
    let text = fs::read_to_string(file).unwrap_or_default();
    let lines: Vec<_> = text.lines().map(str::to_owned).collect();
    lines[lines.len().saturating_sub(count)..].to_vec()
}
