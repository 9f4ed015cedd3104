//! The command `hivtac-rig`: its arguments, the run that they describe, and its output files.

use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use clap::Parser;
use hivtac_twin::Layout;

use crate::arrivals::Arrivals;
use crate::board;
use crate::camera::part;
use crate::chip::Revision;
use crate::faults::{Fault, Faults};
use crate::frame_source::{FrameSource, SceneSource, TestPicture};
use crate::link::{Endpoint, Link, Plug, Pty, Tcp};
use crate::machine::Entry;
use crate::mpu::Protection;
use crate::peripherals::flash::Cut;
use crate::run::{INSTRUCTIONS_PER_SECOND, Limits, Options, Outcome, Program};
use crate::script::Script;
use crate::truth::TruthLog;
use crate::usbip::Server;

/// Runs the firmware on an emulated STM32H743 with a simulated camera and a USB host.
///
/// Prints `ready tcp=ADDRESS pty=PATH`, or `ready usbip=ADDRESS`, once the port is there. Ends at a
/// limit, on SIGTERM or Ctrl-C, or, with --exit-on-hangup, when the client leaves. Exit code 0 when
/// the run ended so, 1 when it could not be done or the firmware broke a rule of the chip, 2 for
/// wrong arguments.
#[derive(Parser, Debug)]
#[command(name = "hivtac-rig", version)]
pub struct Arguments {
    /// The firmware, as it is flashed.
    elf: PathBuf,
    /// What presses the film: rest, static, demo, sweep, press, drag, grasp, catch, vibration; or
    /// test-picture; or a scene file (FILE.toml), which has seed and preset of its own.
    #[arg(long, default_value = "demo")]
    scene: String,
    /// Decides the noise, the demo's start, and values that the camera's data sheets leave open.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The board.
    #[arg(long, value_enum, default_value_t)]
    board: board::Kind,
    /// The camera on it; the board's usual one by default.
    #[arg(long, value_enum)]
    camera: Option<part::Kind>,
    /// Geometry of the simulated sensor: ov7725, mt9v034 or paper; the camera's own by default.
    #[arg(long)]
    preset: Option<String>,
    /// The dots of a scene by name: 4 or 8v, which is for the OV7725.
    #[arg(long, default_value = "4", value_name = "NAME")]
    layout: Layout,
    /// Offer the serial port at this TCP port of 127.0.0.1; 0 takes a free one.
    #[arg(long, value_name = "PORT")]
    tcp: Option<u16>,
    /// Offer the serial port as a pseudo-terminal.
    #[arg(long)]
    pty: bool,
    /// Make a symbolic link to the pseudo-terminal.
    #[arg(long, value_name = "PATH", requires = "pty")]
    pty_link: Option<PathBuf>,
    /// Offer the device itself by USB/IP at this TCP port of 127.0.0.1, as `1-1`, instead of a
    /// serial port; 0 takes a free one. Linux attaches it: `usbip attach -r 127.0.0.1 -b 1-1`.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["tcp", "pty", "script"])]
    usbip: Option<u16>,
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
    /// End after this number of captured frames.
    #[arg(long, value_name = "N")]
    frames: Option<u64>,
    /// End after this virtual time, ms.
    #[arg(long, value_name = "N")]
    virtual_ms: Option<u64>,
    /// A scripted host instead of a client: the same bytes every time. Lines of `MS ACTION`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["tcp", "pty"])]
    script: Option<PathBuf>,
    /// Write the bytes that the device sent to the scripted host.
    #[arg(long, value_name = "FILE", requires = "script")]
    out: Option<PathBuf>,
    /// Something that goes wrong, KIND[@MS[-MS]] in virtual time: camera-absent, camera-wrong-id,
    /// camera-used, sda-stuck, scl-stretch, berr-once, camera-silent, frame-short, frame-long,
    /// dcmi-overrun, bus-busy, host-not-reading, cable-pulled. May be repeated.
    #[arg(long, value_name = "KIND[@MS[-MS]]")]
    fault: Vec<Fault>,
    /// Keep the flash's second bank and the options in this file, from run to run.
    #[arg(long, value_name = "FILE")]
    flash: Option<PathBuf>,
    /// Cut the power at the N-th operation of the flash (the first is 0), which leaves its word or
    /// sector as before, torn (the default), or as after it, and end. Torn options are as before.
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

/// The serial port of a run with a client.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Port {
    /// Port on 127.0.0.1.
    pub tcp: Option<u16>,
    /// Path of the pseudo-terminal.
    pub pty: Option<PathBuf>,
    /// Port on 127.0.0.1 for USB/IP.
    pub usbip: Option<u16>,
}

impl Arguments {
    /// Returns the run that the arguments describe, and its open port; no port if a script is the
    /// host. `interrupt` ends the run when it is set.
    ///
    /// # Errors
    /// If a file cannot be read or created, a port cannot be opened, or a script has no end.
    pub fn prepare(&self, interrupt: Arc<AtomicBool>) -> anyhow::Result<(Options, Option<Port>)> {
        let truth = (self.truth.as_deref())
            .map(TruthLog::create)
            .transpose()?
            .unwrap_or_default();
        let arrivals = (self.arrivals.as_deref())
            .map(Arrivals::create)
            .transpose()?
            .unwrap_or_default();
        let rate = self.instructions_per_second;
        let instructions_per_second =
            NonZeroU64::new(rate).context("--instructions-per-second must not be 0")?;
        let source = self.source()?;
        let (program, port) = self.program()?;
        let options = Options {
            elf: self.elf.clone(),
            board: self.board,
            camera: self.camera(),
            source,
            truth,
            arrivals,
            faults: Faults::new(self.fault.clone()),
            flash: self.flash.clone(),
            cut: self.cut_power,
            seed: self.seed,
            revision: self.silicon,
            protection: Protection::Enforced,
            entry: match self.by_loader {
                true => Entry::Loader,
                false => Entry::Reset,
            },
            program,
            limits: Limits {
                frames: self.frames,
                virtual_ns: self.virtual_ms.map(|ms| ms.saturating_mul(1_000_000)),
            },
            instructions_per_second,
            interrupt,
        };
        Ok((options, port))
    }

    /// Writes the files of a run for which the arguments ask.
    ///
    /// # Errors
    /// If one cannot be written, or a log that was written during the run is incomplete.
    pub fn leave(&self, outcome: &Outcome) -> anyhow::Result<()> {
        let write = |path: &PathBuf, bytes: &[u8]| {
            std::fs::write(path, bytes).with_context(|| path.display().to_string())
        };
        if let Some(path) = &self.out {
            write(path, &outcome.bytes)?;
        }
        if let Some(path) = &self.stats_json {
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

    fn camera(&self) -> part::Kind {
        self.camera.unwrap_or(self.board.usual_camera())
    }

    fn source(&self) -> anyhow::Result<Box<dyn FrameSource>> {
        if self.scene == "test-picture" {
            return Ok(Box::new(TestPicture));
        }
        if self.scene.ends_with(".toml") {
            let file = Path::new(&self.scene);
            return Ok(Box::new(SceneSource::load(file, self.camera())?));
        }
        let preset = self.preset.as_deref();
        let scene = SceneSource::new(&self.scene, preset, self.seed, self.camera())?;
        Ok(Box::new(scene.with_layout(self.layout)?))
    }

    fn program(&self) -> anyhow::Result<(Program, Option<Port>)> {
        if let Some(path) = &self.script {
            if self.frames.is_none() && self.virtual_ms.is_none() {
                anyhow::bail!("--script needs an end: give --frames or --virtual-ms");
            }
            return Ok((Program::Script(Script::load(path)?), None));
        }
        let (plug, port) = self.open()?;
        let program = Program::Client {
            plug,
            wait: !self.no_wait,
            exit_on_hangup: self.exit_on_hangup,
        };
        Ok((program, Some(port)))
    }

    /// Opens the client's ports; by default a TCP port with the serial port.
    fn open(&self) -> anyhow::Result<(Box<dyn Plug>, Port)> {
        if let Some(wanted) = self.usbip {
            let server = Server::listen(wanted)?;
            let port = Port {
                usbip: Some(server.port()?),
                ..Port::default()
            };
            return Ok((Box::new(server), port));
        }
        let mut endpoints: Vec<Box<dyn Endpoint>> = Vec::new();
        let mut port = Port::default();
        if self.tcp.is_some() || !self.pty {
            let tcp = Tcp::listen(self.tcp.unwrap_or(0))?;
            port.tcp = Some(tcp.port()?);
            endpoints.push(Box::new(tcp));
        }
        if self.pty {
            let pty = Pty::open(self.pty_link.as_deref())?;
            port.pty = Some(pty.path().to_owned());
            endpoints.push(Box::new(pty));
        }
        Ok((Box::new(Link::new(endpoints)), port))
    }
}

impl Port {
    /// Returns the line that announces that a client may connect: `ready tcp=ADDRESS pty=PATH`,
    /// or `ready usbip=ADDRESS`.
    pub fn ready_line(&self) -> String {
        let tcp = self.tcp.map(|port| format!(" tcp=127.0.0.1:{port}"));
        let usbip = (self.usbip).map(|port| format!(" usbip=127.0.0.1:{port}"));
        let pty = (self.pty.as_ref()).map(|path| format!(" pty={}", path.display()));
        ["ready".to_owned()]
            .into_iter()
            .chain(tcp)
            .chain(pty)
            .chain(usbip)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_is_reported_in_one_line() {
        let tcp = Port {
            tcp: Some(4000),
            ..Port::default()
        };
        assert_eq!(tcp.ready_line(), "ready tcp=127.0.0.1:4000");
        let both = Port {
            pty: Some(PathBuf::from("/dev/pts/4")),
            ..tcp
        };
        assert_eq!(both.ready_line(), "ready tcp=127.0.0.1:4000 pty=/dev/pts/4");
    }
}
