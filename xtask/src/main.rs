//! `cargo xtask …`: set-up, demo, tests and benchmarks of this project.

mod artifacts;
mod bench;
mod debian;
mod demo;
mod fuzz;
mod linux_host;
mod mutants;
mod packages;
mod process;
mod python;
mod release;
mod report;
mod rig;
mod test;
mod toolchain;
mod web;

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;

/// Set-up, demo, tests and benchmarks. Each command installs what it needs.
#[derive(Parser)]
#[command(name = "cargo xtask")]
enum Task {
    /// Run the firmware on the emulated board with a simulated tip, and show the forces.
    Demo(demo::Demo),
    /// Run every test, and print a table of results. Each step's output is in target/xtask/test.
    Test(test::Test),
    /// Count the instructions of a frame and an inference on the microcontroller, in QEMU.
    Bench(bench::Bench),
    /// Put small mistakes into the firmware, one at a time, and list those that no test notices:
    /// two to three hours of a core. Run `cargo xtask test rig` before.
    Mutants(mutants::Mutants),
    /// Make the files of a release: programs, Python wheels and firmware, and install them.
    Release(release::Release),
    /// Write the sensor's printed parts: STL, STEP, drawings and pictures (docs/kit.md).
    Kit(python::Kit),
    /// Build the page that needs no server: a simulated sensor and a real one in a browser.
    Web,
}

fn main() -> ExitCode {
    // The reader of the output may end early.
    sigpipe::reset();
    match run(Task::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(task: Task) -> Result<()> {
    if !matches!(task, Task::Kit(_) | Task::Web) {
        toolchain::ensure_microcontroller()?;
    }
    match task {
        Task::Demo(demo) => demo.run(),
        Task::Test(test) => test.run(),
        Task::Bench(bench) => bench.run(),
        Task::Release(release) => release.run(),
        Task::Mutants(mutants) => mutants.run(),
        Task::Kit(kit) => kit.run(),
        Task::Web => web::run(),
    }
}
