//! `cargo xtask …`: set-up, demo, tests, benchmarks and sizes of this project.

mod artifacts;
mod bench;
mod columns;
mod demo;
mod fuzz;
mod licences;
mod numbers;
mod packages;
mod process;
mod pypi;
mod python;
mod raw_strings;
mod report;
mod rig;
mod served;
mod size;
mod summary;
mod test;
mod toolchain;
mod workspace;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use toolchain::{Choice, Toolchain};

/// Set-up, demo, tests, benchmarks and sizes. Each command installs what it needs.
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
    /// Where the compiler for the microcontroller may come from.
    #[arg(
        long,
        value_enum,
        default_value = "auto",
        global = true,
        hide_short_help = true
    )]
    toolchain: Choice,
}

#[derive(Subcommand)]
enum Task {
    /// Run the firmware on the emulated board with a simulated tip, and show the forces.
    Demo(demo::Demo),
    /// Run every test, and print a table of how they went.
    Test(test::Test),
    /// What a frame and an inference cost on the microcontroller, measured in QEMU.
    Bench(bench::Bench),
    /// Show what the firmware takes of each memory.
    Size(size::Size),
}

fn main() -> ExitCode {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    match run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: Arguments) -> Result<()> {
    let toolchain = Toolchain::prepare(arguments.toolchain)?;
    match arguments.task {
        Task::Demo(demo) => demo.run(&toolchain),
        Task::Test(test) => test.run(&toolchain),
        Task::Bench(bench) => bench.run(&toolchain),
        Task::Size(size) => size.run(&toolchain),
    }
}
