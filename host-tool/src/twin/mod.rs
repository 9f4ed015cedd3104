//! `hivtac twin`: a simulated sensor in real time, which every other command uses as a device.

mod log;
mod options;
#[cfg(unix)]
mod pty;

use crate::output::{Reader, print};
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::live::hand::Hand;
use hivtac_host::live::line::Tcp;
use hivtac_host::live::run::{Clock, FrameTruth, Shared};
use hivtac_host::shown::to_json;
use hivtac_host::stop;
pub use options::{Before, Simulated};
use serde::Serialize;
use std::path::PathBuf;

/// Simulate a sensor in real time, for every other command
///
/// Prints `ready tcp=ADDRESS` once hosts may connect: `--port tcp:ADDRESS` of any command, of
/// Python and of `serve`. Frames come at the camera's rate, and forces from the very sensing that
/// the device runs. Ends with Ctrl-C; what was kept ends with it. One host at a time; further ones
/// wait.
///
/// Example: hivtac twin --listen 7007
#[derive(Args)]
pub struct TwinArguments {
    #[command(flatten)]
    simulated: Simulated,
    /// The port on 127.0.0.1; one that is free when not given
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    listen: u16,
    /// A pseudo-terminal in place of the TCP port, with a symbolic link to it at PATH
    #[cfg(unix)]
    #[arg(long, value_name = "PATH", conflicts_with = "listen")]
    pty: Option<PathBuf>,
    /// Write one JSON object per frame: its number, and the true force and place; for
    /// `monitor --truth`
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Print one JSON object in place of the line: `port`, as `--port` takes it
    #[arg(long)]
    json: bool,
}

/// Simulates a sensor until the program is interrupted.
///
/// # Errors
/// When the scene, a file or the port cannot be used.
pub fn run(arguments: &TwinArguments) -> Result<(), Failure> {
    let (shared, mut clock) = start(&arguments.simulated, Before::Demo, Hand::default())?;
    let mut log = arguments
        .truth
        .as_deref()
        .map(log::TruthLog::create)
        .transpose()?;
    let ready = arguments.open(&shared)?;
    let line = match arguments.json {
        true => to_json(&ready),
        false => ready.line(),
    };
    if print(&line)? == Reader::Gone {
        return Ok(());
    }
    let mut failed = None;
    clock.run(stop::requested, |frame| {
        if let Some(Err(failure)) = log.as_mut().map(|log| log.write(&frame)) {
            failed = Some(failure);
            log = None;
        }
    });
    match failed {
        Some(failure) => Err(failure),
        None => stop::check(),
    }
}

/// Makes a simulated sensor, and the clock that runs it.
///
/// # Errors
/// When the scene or a file cannot be used.
pub fn start(
    simulated: &Simulated,
    before: Before,
    hand: Hand,
) -> Result<(Shared, Clock), Failure> {
    let (device, eye) = simulated.build(before, hand)?;
    let shared = Shared::new(device);
    let clock = Clock::new(shared.clone(), eye);
    Ok((shared, clock))
}

/// A simulated sensor in this process, for `hivtac view --twin`.
pub struct Inside {
    /// Where it listens, as `--port` takes it.
    pub port: String,
    clock: Clock,
}

impl Inside {
    /// Starts it on a free port of 127.0.0.1.
    ///
    /// # Errors
    /// When the scene or a file cannot be used, or there is no port.
    pub fn start(simulated: &Simulated, hand: Hand) -> Result<Inside, Failure> {
        let (shared, clock) = start(simulated, Before::Rest, hand)?;
        let port = listen(0, &shared)?;
        Ok(Inside {
            port: format!("tcp:127.0.0.1:{port}"),
            clock,
        })
    }

    /// Runs it until the program is interrupted; calls `tell` with each frame's true press.
    pub fn run(mut self, tell: impl FnMut(FrameTruth)) {
        self.clock.run(stop::requested, tell);
    }
}

/// Serves hosts at a TCP port, on a thread of its own; returns the port.
fn listen(port: u16, shared: &Shared) -> Result<u16, Failure> {
    let tcp = Tcp::listen(port).map_err(|error| {
        Failure::input(format!(
            "cannot listen at port {port} of this computer: {error}; choose another with --listen"
        ))
    })?;
    let (own, shared) = (tcp.port(), shared.clone());
    std::thread::spawn(move || tcp.serve(&shared));
    Ok(own)
}

/// Where hosts connect.
#[derive(Serialize)]
struct Ready {
    /// As `--port` takes it.
    port: String,
}

impl Ready {
    fn line(&self) -> String {
        match self.port.strip_prefix("tcp:") {
            Some(address) => format!("ready tcp={address}"),
            None => format!("ready pty={}", self.port),
        }
    }
}

impl TwinArguments {
    /// Opens the port.
    fn open(&self, shared: &Shared) -> Result<Ready, Failure> {
        #[cfg(unix)]
        if let Some(link) = &self.pty {
            let port = pty::serve(link, shared)?.display().to_string();
            return Ok(Ready { port });
        }
        let port = format!("tcp:127.0.0.1:{}", listen(self.listen, shared)?);
        Ok(Ready { port })
    }
}
