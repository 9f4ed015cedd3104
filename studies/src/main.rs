//! `hivtac-studies`: what only proves or compares: the project's numbers beside what is possible,
//! on units drawn at random, and beside the paper's pipeline.

mod anywhere;
mod maps;
mod page;
mod paper;
mod press;
mod scene;
mod slip;
mod tradeoff;
mod units;
mod unseen;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// What only proves or compares.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Press anywhere within ±4 mm and hold the errors against the Cramér–Rao bound.
    Anywhere(anywhere::Anywhere),
    /// Train the paper's network with the place as two more outputs, and judge it beside ours.
    Paper(paper::Paper),
    /// Look at the simulated sensor: its frames and its film.
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    /// Press, drag, release, grasp and catch, and count what contact and slip miss, invent, and how
    /// late they come.
    Slip(slip::Slip),
    /// Pick the configuration that is best under limits of time and error.
    Tradeoff(tradeoff::TradeoffArgs),
    /// Displace one marker and see what the residual does not tell.
    Unseen(unseen::Unseen),
    /// Draw units as people build them; measure them with a tare alone, and after ten loads.
    Units(units::Units),
}

fn main() -> Result<()> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    match Cli::parse().command {
        Command::Anywhere(study) => study.run(),
        Command::Paper(study) => study.run(),
        Command::Scene(command) => command.run(),
        Command::Slip(study) => study.run(),
        Command::Tradeoff(study) => study.run(),
        Command::Unseen(study) => study.run(),
        Command::Units(study) => study.run(),
    }
}
