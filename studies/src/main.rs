//! `hivtac-studies`: the project's own numbers beside those of programs that nobody here wrote.

mod calculix;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// The project's own numbers beside those of programs that nobody here wrote.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Press the film in CalculiX, too, and compare markers and tip. Needs the program `ccx`.
    Calculix(calculix::Calculix),
}

fn main() -> Result<()> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    match Cli::parse().command {
        Command::Calculix(study) => study.run(),
    }
}
