//! `hivtac-calibrate`: from data to a model on the chip.

mod commands;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};
use commands::data::DatasetArgs;
use commands::default_model::DefaultModelArgs;
use commands::layout::LayoutArgs;
use commands::model::{CheckArgs, EvaluateArgs, ExportArgs};
use commands::network::{FilmArgs, TrainArgs, UnitArgs};
use hivtac_calibration::data::collect::CollectCommand;

/// From data to a model on the chip: a unit's own, or that of the simulated sensor.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Calibration data from a real unit and a force gauge.
    #[command(subcommand)]
    Collect(CollectCommand),
    /// A unit's own model from ten known loads, step by step (`--into FOLDER`): instructions, live
    /// numbers, and at the end the model and its errors on loads left out. Or from a data set
    /// (`--data`): 4 loads and more, some tilted, four of them 2 to 3 mm off the middle, several
    /// frames each; prints the unit's numbers and writes its weights file.
    Unit(UnitArgs),
    /// Quantize a weights file; writes a model file. The same weights give the same bytes on every
    /// machine.
    Export(ExportArgs),
    /// Judge a model file on a data set: the paper's figures and numbers as one HTML file.
    Evaluate(EvaluateArgs),
    /// Render frames of known forces, let the pipeline measure them, write forces and features as
    /// CSV. An interrupted run goes on where it was.
    Dataset(DatasetArgs),
    /// Train a network on a data set; writes a weights file.
    Train(TrainArgs),
    /// Add the nominal film's forward model to a weights file whose network gives places, with the
    /// noise of markers from a data set. Writes a weights file.
    Film(FilmArgs),
    /// Measure freshly rendered frames with a model file and print the errors of its forces.
    Check(CheckArgs),
    /// The model file of the nominal sensor with another layout of dots, for presses anywhere on
    /// the film. It has no network: its steps begin where the dots moved most.
    Layout(LayoutArgs),
    /// Dataset, train, film, export and check in one, for the model that firmware and host tool
    /// embed: a tip anywhere within ±4 mm.
    DefaultModel(DefaultModelArgs),
}

fn main() -> ExitCode {
    // A reader of the output may close it early.
    sigpipe::reset();
    match run(Cli::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("hivtac-calibrate: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(command: Command) -> Result<()> {
    match command {
        Command::Collect(command) => command.run(),
        Command::Unit(args) => args.run(),
        Command::Export(args) => args.run(),
        Command::Evaluate(args) => args.run(),
        Command::Dataset(args) => args.run(),
        Command::Train(args) => args.run(),
        Command::Film(args) => args.run(),
        Command::Check(args) => args.run(),
        Command::Layout(args) => args.run(),
        Command::DefaultModel(args) => args.run(),
    }
}
