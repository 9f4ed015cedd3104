//! `hivtac-studies`: runs the studies whose figures change with the models: randomly drawn units,
//! objects that press them, and their errors compared with the Cramér–Rao bound.

mod anywhere;
mod contacts;
mod page;
mod press;
mod scene;
mod touches;
mod tradeoff;
mod units;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Studies that prove or compare.
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
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    Touches(Box<touches::Touches>),
    Tradeoff(tradeoff::TradeoffArgs),
    Units(units::Units),
}

fn main() -> Result<()> {
    // The reader of the output may end early.
    sigpipe::reset();
    match Cli::parse().command {
        Command::Anywhere(study) => study.run(),
        Command::Contacts(study) => study.run(),
        Command::Scene(command) => command.run(),
        Command::Touches(study) => study.run(),
        Command::Tradeoff(study) => study.run(),
        Command::Units(study) => study.run(),
    }
}
