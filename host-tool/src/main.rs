//! `hivtac`: shows a HiVTac sensor's forces, queries and commands it, and reads pictures.

mod auto_threshold;
mod bring_up;
mod check;
mod device;
mod ended;
mod expose;
mod finding;
mod firmware;
mod focus_command;
mod follow;
mod grip_command;
mod health;
mod help;
mod hsv;
mod info;
mod lines;
mod list;
mod monitor;
mod output;
mod record;
mod replay;
mod request;
mod sense;
#[cfg_attr(
    not(all(feature = "ros2", feature = "foxglove")),
    allow(dead_code, reason = "only what these features add uses it")
)]
mod serve;
mod set_threshold;
mod settings;
#[cfg(test)]
#[path = "focus/simulated.rs"]
mod simulated;
mod snapshot;
mod tare;
mod template;
mod threshold_command;
#[cfg(feature = "twin")]
mod twin;
mod update;
mod view;
mod white;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::stop;
use std::process::ExitCode;

/// Shows the forces of a HiVTac sensor.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Monitor(monitor::MonitorArguments),
    Check(check::CheckArguments),
    Record(record::RecordArguments),
    Replay(replay::ReplayArguments),
    List(list::ListArguments),
    Info(info::InfoArguments),
    SelfTest(health::SelfTestArguments),
    Tare(tare::TareArguments),
    Threshold(threshold_command::ThresholdArguments),
    #[command(subcommand)]
    Settings(settings::SettingsCommand),
    #[command(subcommand)]
    Update(update::UpdateCommand),
    Expose(expose::ExposeArguments),
    White(white::WhiteArguments),
    Snapshot(snapshot::SnapshotArguments),
    Focus(focus_command::FocusArguments),
    BringUp(bring_up::BringUpArguments),
    View(view::ViewArguments),
    #[cfg(feature = "twin")]
    Twin(twin::TwinArguments),
    Serve(serve::ServeArguments),
    Grip(grip_command::GripCommand),
    Template(template::TemplateArguments),
    Sense(sense::SenseArguments),
    Completion(help::CompletionArguments),
    Man(help::ManArguments),
}

impl Command {
    fn run(self) -> Result<(), Failure> {
        match self {
            Command::Monitor(arguments) => monitor::run(&arguments),
            Command::Check(arguments) => check::run(&arguments),
            Command::Record(arguments) => record::run(&arguments),
            Command::Replay(arguments) => replay::run(&arguments),
            Command::List(arguments) => list::run(&arguments),
            Command::Info(arguments) => info::run(&arguments),
            Command::SelfTest(arguments) => health::run(&arguments),
            Command::Tare(arguments) => tare::run(&arguments),
            Command::Threshold(arguments) => threshold_command::run(&arguments),
            Command::Settings(command) => command.run(),
            Command::Update(command) => update::run(&command),
            Command::Expose(arguments) => expose::run(&arguments),
            Command::White(arguments) => white::run(&arguments),
            Command::Snapshot(arguments) => snapshot::run(&arguments),
            Command::Focus(arguments) => focus_command::run(&arguments),
            Command::BringUp(arguments) => bring_up::run(&arguments),
            Command::View(arguments) => view::run(&arguments),
            #[cfg(feature = "twin")]
            Command::Twin(arguments) => twin::run(&arguments),
            Command::Serve(arguments) => serve::run(&arguments),
            Command::Grip(arguments) => grip_command::run(&arguments),
            Command::Template(arguments) => template::run(&arguments),
            Command::Sense(arguments) => sense::run(&arguments),
            Command::Completion(arguments) => help::completion(&arguments, command()),
            Command::Man(arguments) => help::man(&arguments, command()),
        }
    }
}

fn command() -> clap::Command {
    help::with_help(Arguments::command())
}

fn run(command: Command) -> Result<(), Failure> {
    stop::install()?;
    command.run()
}

fn main() -> ExitCode {
    let matches = command().get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    match run(arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if failure.kind != Kind::Interrupted {
                output::note(&format!("hivtac: {failure}"));
            }
            ExitCode::from(failure.kind.exit_code())
        }
    }
}
