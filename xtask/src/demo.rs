//! `cargo xtask demo`: runs the firmware on the emulated board with a simulated tip, and shows the
//! forces.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::{Args, ValueEnum};
use serde::Deserialize;

use crate::artifacts::{self, Board};
use crate::rig::Rig;
use crate::{process, toolchain};

/// Options of `cargo xtask demo`.
#[derive(Args)]
pub struct Demo {
    /// End after this many frames.
    #[arg(long, default_value_t = 150, value_parser = clap::value_parser!(u64).range(1..))]
    frames: u64,
    /// The board: the first has an OV7725 unless --camera says otherwise, the second an MT9V034.
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// The camera in the first board's socket, of 156 or 119 frames a second: the firmware takes
    /// either.
    #[arg(long, value_parser = ["ov7725", "ov5640"])]
    camera: Option<String>,
    /// Dots on the film: four, which the built-in model is for, or eight, whose model is sent
    /// first.
    #[arg(long, default_value = "4", value_parser = ["4", EIGHT])]
    dots: String,
}

/// The other number of dots, and its model.
const EIGHT: &str = "8";
const MODEL_OF_EIGHT: &str = "calibration/models/8v/default.hvtm";

/// The demo's programs, and the folder of its logs.
struct Programs {
    firmware: PathBuf,
    rig: PathBuf,
    tool: PathBuf,
    folder: PathBuf,
}

impl Demo {
    /// Builds the programs, runs the rig, and shows the host tool's output; names the rig's log
    /// after a failure.
    pub fn run(&self) -> Result<()> {
        let is_usual = self.dots != EIGHT && self.camera.is_none();
        ensure!(
            is_usual || self.board == Board::default(),
            "--dots and --camera are for the first board: leave --board out"
        );
        let start = Instant::now();
        let programs = self.build()?;
        let built = start.elapsed().as_secs_f64();
        let log = programs.folder.join("rig.log");
        if let Err(error) = self.show(&programs, &log) {
            let text = std::fs::read_to_string(&log).unwrap_or_default();
            let lines: Vec<&str> = text.lines().collect();
            let last = lines[lines.len().saturating_sub(20)..].join("\n");
            eprintln!("\nThe last lines of the rig's log:\n{last}");
            return Err(error.context(format!("the rig's log is {}", log.display())));
        }
        let shown = start.elapsed().as_secs_f64() - built;
        eprintln!("\nbuilt in {built:.1} s, shown in {shown:.1} s");
        eprintln!("truth and logs: {}", programs.folder.display());
        eprintln!(
            "\nGo on in real time, without the emulator: press a simulated film in a browser with\n\
             \n  cargo install --path host-tool && hivtac view --twin\n\nor run `hivtac twin`, \
             which every command of hivtac, Python and ROS 2 use as a device."
        );
        Ok(())
    }

    /// Builds the firmware while the rig is built, whose emulator takes longest, and the host tool.
    fn build(&self) -> Result<Programs> {
        eprintln!(
            "Building the firmware, the emulated board and the host tool: some four minutes the \
             first time on two cores, a second from then on."
        );
        std::thread::scope(|scope| {
            let firmware = scope.spawn(|| artifacts::firmware(self.board));
            let rig = artifacts::host_program("hivtac-rig");
            let tool = artifacts::host_tool();
            let firmware = firmware.join();
            Ok(Programs {
                firmware: firmware.map_err(|_| anyhow!("building the firmware panicked"))??,
                rig: rig?,
                tool: tool?,
                folder: toolchain::work_folder("demo")?,
            })
        })
    }

    fn show(&self, programs: &Programs, log: &Path) -> Result<()> {
        let [truth, arrivals, flash] =
            ["truth.jsonl", "arrivals.jsonl", "flash"].map(|name| programs.folder.join(name));
        let board = self.board.to_possible_value();
        let board = board.context("a board without a name")?;
        let mut command = Command::new(&programs.rig);
        if self.dots == EIGHT {
            send_model(programs, &flash, log)?;
            command.args(["--layout", "8v", "--flash"]).arg(flash);
        }
        let frames = self.frames.to_string();
        eprintln!("The board boots, and {frames} frames pass: some half a minute.");
        command.args("--scene demo --pty --board".split(' '));
        command.arg(board.get_name()).arg("--truth").arg(&truth);
        if let Some(camera) = &self.camera {
            command.args(["--camera", camera]);
        }
        command.arg("--arrivals").arg(&arrivals);
        let rig = Rig::start(command.arg(&programs.firmware), log)?;
        // The demo's tip is a needle; on a new device it could be anything.
        let needle = ["settings", "set", "contact", "needle"];
        process::run(&mut rig.ask(&programs.tool, &needle))?;
        let mut monitor = rig.ask(&programs.tool, &["monitor", "--frames", &frames]);
        process::run(monitor.arg("--truth").arg(&truth))?;
        rig.finish()?;
        let (rate_hz, latency_ms) = rate_and_latency(&times(&truth)?, &times(&arrivals)?)?;
        println!(
            "rate: {rate_hz:.1} forces a second; latency: {latency_ms:.2} ms from the middle of \
             the exposure to the last byte on USB"
        );
        Ok(())
    }
}

/// Sends the model of eight dots to a new device, which keeps it in its flash. The camera is left
/// out, as it takes most of the emulator's time.
fn send_model(programs: &Programs, flash: &Path, log: &Path) -> Result<()> {
    eprintln!("A device gets the model of eight dots: some half a minute.");
    if flash.exists() {
        std::fs::remove_file(flash).with_context(|| format!("removing {}", flash.display()))?;
    }
    let mut command = Command::new(&programs.rig);
    command.args("--pty --exit-on-hangup --fault camera-absent --flash".split(' '));
    let rig = Rig::start(command.arg(flash).arg(&programs.firmware), log)?;
    let update = ["update", "model", MODEL_OF_EIGHT];
    process::run(&mut rig.ask(&programs.tool, &update))?;
    rig.ended()
}

/// A time for each frame, s.
type Times = BTreeMap<u64, f64>;

/// A line of the rig's logs.
#[derive(Deserialize)]
struct Line {
    frame: u64,
    time_s: f64,
}

/// Reads the times from a log of the rig.
fn times(log: &Path) -> Result<Times> {
    let text = process::read(log)?;
    let lines = text.lines().map(serde_json::from_str);
    let times = lines.map(|line| line.map(|line: Line| (line.frame, line.time_s)));
    let times: Result<Times, _> = times.collect();
    times.with_context(|| format!("reading {}", log.display()))
}

/// The rate of the frames whose samples arrived, by the middles of their exposures, Hz. And the
/// mean time from there to the last byte of a sample on USB, ms.
fn rate_and_latency(exposed: &Times, arrived: &Times) -> Result<(f64, f64)> {
    let both = |(frame, there): (&u64, &f64)| Some((*exposed.get(frame)?, *there));
    let both: Vec<(f64, f64)> = arrived.iter().filter_map(both).collect();
    let [(first, _), .., (last, _)] = both[..] else {
        bail!("fewer than two samples arrived");
    };
    let latency_s: f64 = both.iter().map(|(exposed, there)| there - exposed).sum();
    let count = both.len() as f64;
    Ok(((count - 1.0) / (last - first), 1e3 * latency_s / count))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_latency_are_those_of_frames_that_both_logs_tell_of() {
        let exposed = Times::from([(7, 0.1), (8, 0.106), (9, 0.112)]);
        let arrived = Times::from([(7, 0.105), (8, 0.113)]);
        let (rate_hz, latency_ms) = rate_and_latency(&exposed, &arrived).unwrap();
        assert!((rate_hz - 1.0 / 0.006).abs() < 1e-6 && (latency_ms - 6.0).abs() < 1e-9);
        assert!(rate_and_latency(&exposed, &Times::new()).is_err());
    }
}
