//! `hivtac-rig`: runs a firmware ELF on the emulated sensor.

use std::io::Write;
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use clap::Parser;
use hivtac_rig::arrivals::Arrivals;
use hivtac_rig::board;
use hivtac_rig::camera::part;
use hivtac_rig::chip::Revision;
use hivtac_rig::faults::{Fault, Faults};
use hivtac_rig::flash::Cut;
use hivtac_rig::frame_source::{FrameSource, SceneSource, TestPicture};
use hivtac_rig::link::{Endpoint, Link, Pty, Tcp};
use hivtac_rig::machine::Entry;
use hivtac_rig::mpu::Protection;
use hivtac_rig::run::{INSTRUCTIONS_PER_SECOND, Limits, Options, Outcome, Program, run};
use hivtac_rig::script::Script;
use hivtac_rig::truth::TruthLog;

/// Runs the firmware on an emulated STM32H743 with a simulated camera and a USB host.
///
/// Prints `ready tcp=ADDRESS pty=PATH` once the serial port is there. Ends at a limit, on SIGTERM
/// or Ctrl-C, or, with --exit-on-hangup, when the client leaves. Exit code 0 when the run ended so,
/// 1 when it could not be done or the firmware broke a rule of the chip, 2 for wrong arguments.
#[derive(Parser, Debug)]
#[command(name = "hivtac-rig", version)]
struct Arguments {
    /// The firmware, as it is flashed.
    elf: PathBuf,
    /// What presses the film: rest, static, demo, sweep, press, drag, grasp, catch, vibration; or
    /// test-picture; or a scene file (FILE.toml), which has seed and preset of its own.
    #[arg(long, default_value = "demo")]
    scene: String,
    /// Decides the noise, where the demo starts, and what the camera's data sheets leave open.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The board.
    #[arg(long, value_enum, default_value_t)]
    board: board::Kind,
    /// The camera on it; the board's usual one unless told.
    #[arg(long, value_enum)]
    camera: Option<part::Kind>,
    /// Geometry of the simulated sensor: ov7725, mt9v034 or paper; the camera's own unless told.
    #[arg(long)]
    preset: Option<String>,
    /// Offer the serial port at this TCP port of 127.0.0.1; 0 takes a free one.
    #[arg(long, value_name = "PORT")]
    tcp: Option<u16>,
    /// Offer the serial port as a pseudo-terminal.
    #[arg(long)]
    pty: bool,
    /// Make a symbolic link to the pseudo-terminal.
    #[arg(long, value_name = "PATH", requires = "pty")]
    pty_link: Option<PathBuf>,
    /// Start without a client, and go on without one.
    #[arg(long)]
    no_wait: bool,
    /// End when the client leaves.
    #[arg(long)]
    exit_on_hangup: bool,
    /// Write one JSON object per exposure: frame, exposure, time_us, time_s, exposure_s, readout_s,
    /// and the true force and markers.
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Write one JSON object per sample that the device sends: frame, and time_s at which its last
    /// byte had left.
    #[arg(long, value_name = "FILE")]
    arrivals: Option<PathBuf>,
    /// End after so many captured frames.
    #[arg(long, value_name = "N")]
    frames: Option<u64>,
    /// End after so much virtual time, ms.
    #[arg(long, value_name = "N")]
    virtual_ms: Option<u64>,
    /// A scripted host instead of a client: the same bytes every time. Lines of `MS ACTION`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tcp", "pty"])]
    script: Option<PathBuf>,
    /// Write what the device sent to the scripted host.
    #[arg(long, value_name = "FILE", requires = "script")]
    out: Option<PathBuf>,
    /// Something that goes wrong, KIND[@MS[-MS]] in virtual time: camera-absent, camera-wrong-id,
    /// camera-used, sda-stuck, scl-stretch, berr-once, camera-silent, frame-short, frame-long,
    /// dcmi-overrun, bus-busy, host-not-reading, cable-pulled. May be repeated.
    #[arg(long, value_name = "KIND[@MS[-MS]]")]
    fault: Vec<Fault>,
    /// Keep the flash's second bank in this file, from run to run.
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Cut the power at the N-th operation of the flash's second bank (the first is 0), which
    /// leaves its word or sector as before, torn (the default), or as after it, and end.
    #[arg(long, value_name = "N[:LEAVES]", requires = "flash")]
    cut_power: Option<Cut>,
    /// Instructions per second of virtual time that the core is assumed to execute.
    #[arg(long, value_name = "N", default_value_t = INSTRUCTIONS_PER_SECOND)]
    instructions_per_second: u64,
    /// Revision of the silicon.
    #[arg(long, value_enum, default_value_t)]
    silicon: Revision,
    /// Enter the firmware as the ROM's loader does, with its vector table in use.
    #[arg(long)]
    by_loader: bool,
    /// Write the run's counters as JSON.
    #[arg(long, value_name = "FILE")]
    stats_json: Option<PathBuf>,
}

impl Arguments {
    fn camera(&self) -> part::Kind {
        self.camera.unwrap_or(self.board.usual_camera())
    }
}

fn main() -> ExitCode {
    match work(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("hivtac-rig: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn work(arguments: Arguments) -> anyhow::Result<()> {
    let interrupt = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGTERM, signal_hook::consts::SIGINT] {
        signal_hook::flag::register(signal, interrupt.clone())?;
    }
    let options = options(&arguments, interrupt)?;
    let outcome = run(options)?;
    finish(&arguments, &outcome)
}

fn options(arguments: &Arguments, interrupt: Arc<AtomicBool>) -> anyhow::Result<Options> {
    let truth = arguments
        .truth
        .as_deref()
        .map(TruthLog::create)
        .transpose()?
        .unwrap_or_default();
    let arrivals = (arguments.arrivals.as_deref())
        .map(Arrivals::create)
        .transpose()?
        .unwrap_or_default();
    let rate = arguments.instructions_per_second;
    Ok(Options {
        elf: arguments.elf.clone(),
        board: arguments.board,
        camera: arguments.camera(),
        source: source(arguments)?,
        truth,
        arrivals,
        faults: Faults::new(arguments.fault.clone()),
        flash: arguments.flash.clone(),
        cut: arguments.cut_power,
        seed: arguments.seed,
        revision: arguments.silicon,
        protection: Protection::Enforced,
        entry: match arguments.by_loader {
            true => Entry::Loader,
            false => Entry::Reset,
        },
        program: program(arguments)?,
        limits: Limits {
            frames: arguments.frames,
            virtual_ns: arguments.virtual_ms.map(|ms| ms.saturating_mul(1_000_000)),
        },
        instructions_per_second: NonZeroU64::new(rate)
            .context("--instructions-per-second must not be 0")?,
        interrupt,
    })
}

fn source(arguments: &Arguments) -> anyhow::Result<Box<dyn FrameSource>> {
    if arguments.scene == "test-picture" {
        return Ok(Box::new(TestPicture));
    }
    if arguments.scene.ends_with(".toml") {
        let file = Path::new(&arguments.scene);
        return Ok(Box::new(SceneSource::load(file, arguments.camera())?));
    }
    Ok(Box::new(SceneSource::new(
        &arguments.scene,
        arguments.preset.as_deref(),
        arguments.seed,
        arguments.camera(),
    )?))
}

fn program(arguments: &Arguments) -> anyhow::Result<Program> {
    if let Some(path) = &arguments.script {
        if arguments.frames.is_none() && arguments.virtual_ms.is_none() {
            anyhow::bail!("--script needs an end: give --frames or --virtual-ms");
        }
        return Ok(Program::Script(Script::load(path)?));
    }
    let link = open_link(arguments)?;
    Ok(Program::Client {
        link,
        wait: !arguments.no_wait,
        exit_on_hangup: arguments.exit_on_hangup,
    })
}

/// Opens the endpoints and says where they are. Without any wish it is a TCP port.
fn open_link(arguments: &Arguments) -> anyhow::Result<Link> {
    let mut endpoints: Vec<Box<dyn Endpoint>> = Vec::new();
    let mut ready = String::from("ready");
    if arguments.tcp.is_some() || !arguments.pty {
        let tcp = Tcp::listen(arguments.tcp.unwrap_or(0))?;
        ready += &format!(" tcp=127.0.0.1:{}", tcp.port()?);
        endpoints.push(Box::new(tcp));
    }
    if arguments.pty {
        let pty = Pty::open(arguments.pty_link.as_deref())?;
        ready += &format!(" pty={}", pty.path().display());
        endpoints.push(Box::new(pty));
    }
    let mut stdout = std::io::stdout();
    writeln!(stdout, "{ready}")
        .and_then(|()| stdout.flush())
        .context("standard output")?;
    Ok(Link::new(endpoints))
}

fn finish(arguments: &Arguments, outcome: &Outcome) -> anyhow::Result<()> {
    eprintln!("hivtac-rig: {}", outcome.report.line());
    let write = |path: &PathBuf, bytes: &[u8]| {
        std::fs::write(path, bytes).with_context(|| path.display().to_string())
    };
    if let Some(path) = &arguments.out {
        write(path, &outcome.bytes)?;
    }
    if let Some(path) = &arguments.stats_json {
        write(path, format!("{:#}\n", outcome.report.json()).as_bytes())?;
    }
    if let Some(why) = &outcome.report.truth_failure {
        anyhow::bail!("the truth log ended early: {why}");
    }
    if let Some(why) = &outcome.report.arrivals_failure {
        anyhow::bail!("the log of arrivals is not whole: {why}");
    }
    Ok(())
}
