//! `hivtac-rig`: runs a firmware ELF on the emulated sensor.

use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Context;
use clap::Parser;
use hivtac_rig::command::{Arguments, Port};
use hivtac_rig::run::run;

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
    let (options, port) = arguments.prepare(interrupt)?;
    if let Some(port) = &port {
        say_ready(port)?;
    }
    let outcome = run(options)?;
    eprintln!("hivtac-rig: {}", outcome.report.line());
    arguments.leave(&outcome)
}

fn say_ready(port: &Port) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout();
    writeln!(stdout, "{}", port.ready_line())
        .and_then(|()| stdout.flush())
        .context("standard output")
}
