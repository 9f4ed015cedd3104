//! `hivtac-studies`: runs the project's studies. They compare its results with what is possible and
//! with the paper's pipeline, and test units drawn at random.

mod anywhere;
mod contacts;
mod page;
mod paper;
mod press;
mod scene;
mod slip;
mod touches;
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
    Anywhere(anywhere::Anywhere),
    Contacts(contacts::Contacts),
    Paper(paper::Paper),
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    Slip(slip::Slip),
    Touches(Box<touches::Touches>),
    Tradeoff(tradeoff::TradeoffArgs),
    Unseen(unseen::Unseen),
    Units(units::Units),
}

fn main() -> Result<()> {
    // The reader of the output may end early.
    sigpipe::reset();
    match Cli::parse().command {
        Command::Anywhere(study) => study.run(),
        Command::Contacts(study) => study.run(),
        Command::Paper(study) => study.run(),
        Command::Scene(command) => command.run(),
        Command::Slip(study) => study.run(),
        Command::Touches(study) => study.run(),
        Command::Tradeoff(study) => study.run(),
        Command::Unseen(study) => study.run(),
        Command::Units(study) => study.run(),
    }
}
