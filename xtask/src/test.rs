//! `cargo xtask test`: every check and every test of the project.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::sync::OnceLock;
use std::thread;

use anyhow::{Context, Result, anyhow, ensure};
use clap::Args;

use crate::artifacts::{self, Board, Programs};
use crate::report::{Report, Tally, run_tests};
use crate::toolchain::{self, cargo};
use crate::{bench, fuzz, packages, process, python};

/// Options of `cargo xtask test`.
#[derive(Args)]
pub struct Test {
    /// Run only the steps whose names contain one of these words, and the builds that they need.
    steps: Vec<String>,
    /// Run the slow tests, too: some minutes more.
    #[arg(long)]
    all: bool,
}

/// Its name, what it does, and for one that runs only with `--all`, why it cannot run here.
type Step = (&'static str, Work, Option<fn() -> Option<&'static str>>);
type Work = fn(&Shared, &mut Tally) -> Result<()>;

/// What runs on this computer.
static FIRST: [Step; 4] = [
    ("format", |_, _| format(), None),
    ("lints: host", |_, _| host_lints(), None),
    ("tests: host", host_tests, None),
    ("tests: across rooms", cross_room_tests, None),
];

/// About half of the work: what is for the microcontroller, attacks and the rig's tests, and around
/// them what the others need nothing of. What is for the microcontroller is first: it is built in a
/// folder of its own while the lints hold the common one.
static BESIDE: [Step; 10] = [
    ("lints: microcontroller", |_, _| target_lints(), None),
    (BUILD, |shared, _| shared.build(), None),
    ("tests: rig", rig_tests, None),
    ("tests: rig at half speed", rig_tests_at_half_speed, None),
    ("attacks", |_, _| fuzz::run(), Some(fuzz::obstacle)),
    ("benchmark", |_, _| bench::Bench::default().run(), None),
    ("build: board benchmark", |_, _| bench::board::lint(), None),
    ("licences", |_, _| licences(), Some(no_cargo_deny)),
    (
        "tests: python",
        |_, tally| python::test_package(tally),
        Some(python::no_package),
    ),
    (
        "tests: serve",
        |_, tally| python::test_serve(tally),
        Some(python::no_serve),
    ),
];

/// It runs for the steps that need it.
const BUILD: &str = "build: firmware";
const NEED_BUILD: [&str; 2] = ["tests: rig at half speed", "tests: across rooms"];

/// The project's workspaces, as folders.
const WORKSPACES: [&str; 2] = ["", "tests/qemu"];

/// What the steps share.
struct Shared {
    all: bool,
    /// Set by the step that builds them; to nothing when that fails.
    programs: OnceLock<Option<Programs>>,
}

impl Test {
    /// Runs every step, past those that fail, and prints the table; on two threads, so that no core
    /// waits while one of both builds or tests with the other alone.
    pub fn run(&self) -> Result<()> {
        let wanted = |steps: &'static [Step]| steps.iter().filter(|step| self.wants(step));
        let all = wanted(&FIRST).chain(wanted(&BESIDE)).count();
        ensure!(all > 0, "no step is called so; some need `--all`");
        if toolchain::has("clippy") {
            artifacts::lint_as_built();
        }
        let shared = Shared {
            all: self.all,
            programs: OnceLock::new(),
        };
        let report = Report::new(all, toolchain::work_folder("test")?);
        let run = |steps| {
            for &(name, work, slow) in wanted(steps) {
                let obstacle = || slow.and_then(|obstacle| obstacle());
                report.step(name, obstacle, |tally| work(&shared, tally));
            }
        };
        let beside = thread::scope(|scope| {
            let beside = scope.spawn(|| {
                let ended = catch_unwind(AssertUnwindSafe(|| run(&BESIDE)));
                // Who still waits for them waits no longer.
                shared.programs.get_or_init(|| None);
                ended
            });
            run(&FIRST);
            beside.join().flatten()
        });
        beside.map_err(|_| anyhow!("the steps beside the others panicked"))?;
        report.finish()
    }

    fn wants(&self, (name, _, slow): &Step) -> bool {
        let named = |name: &str| self.steps.iter().any(|word| name.contains(word.as_str()));
        let is_named = match *name {
            BUILD => NEED_BUILD.iter().any(|name| named(name)),
            name => named(name),
        };
        (self.all || slow.is_none()) && (self.steps.is_empty() || is_named)
    }
}

impl Shared {
    fn build(&self) -> Result<()> {
        let built = Programs::build();
        let problem = built.as_ref().err().map(|error| anyhow!("{error:#}"));
        self.programs.get_or_init(|| built.ok());
        problem.map_or(Ok(()), Err)
    }

    /// What tests with these programs, once they are built.
    fn tests(&self, which: [&str; 2]) -> Result<Command> {
        let programs = self.programs.wait().as_ref();
        let programs = programs.context("not run: the firmware could not be built")?;
        let mut command = artifacts::test();
        command.args(which);
        programs.name_to(&mut command);
        Ok(command)
    }

    /// Has a test runner run what it would leave out for its time, if asked to.
    fn run(&self, mut command: Command, tally: &mut Tally) -> Result<()> {
        if self.all {
            command.args(["--", "--include-ignored"]);
        }
        run_tests(&mut command, tally)
    }
}

fn format() -> Result<()> {
    toolchain::ensure_component("fmt", "rustfmt")?;
    for folder in WORKSPACES {
        process::run(&mut cargo("fmt --all --check", folder))?;
    }
    Ok(())
}

/// Of what [`artifacts::lint_as_built`] had linted, and of what is only checked.
fn host_lints() -> Result<()> {
    toolchain::ensure_component("clippy", "clippy")?;
    for command in artifacts::everything() {
        artifacts::without_warnings(command)?;
    }
    Ok(())
}

/// Both boards' firmware and the image for QEMU are built for this alone, with what they depend on
/// as it is built for those that run: what is flashed does not depend on a linter.
fn target_lints() -> Result<()> {
    toolchain::ensure_component("clippy", "clippy")?;
    let firmware = |board| artifacts::firmware_command(board, "");
    let [weact, openmv] = [Board::Weact, Board::OpenmvH7].map(firmware);
    for mut command in [weact, openmv, artifacts::qemu_image_command()] {
        toolchain::lint_for_target(&mut command)?;
        artifacts::without_warnings(command)?;
    }
    Ok(())
}

fn host_tests(shared: &Shared, tally: &mut Tally) -> Result<()> {
    shared.run(artifacts::test(), tally)
}

fn cross_room_tests(shared: &Shared, tally: &mut Tally) -> Result<()> {
    let mut command = shared.tests(artifacts::ROOMS_TESTS)?;
    packages::ensure_qemu()?;
    command.env("HIVTAC_TOOL", artifacts::host_tool()?);
    command.env("HIVTAC_QEMU_IMAGE", artifacts::qemu_image()?);
    if shared.all {
        // Only slow tests run these.
        command.env(
            "HIVTAC_CALIBRATE",
            artifacts::host_program("hivtac-calibrate")?,
        );
        command.env("HIVTAC_CHROMIUM", packages::chromium()?);
    }
    shared.run(command, tally)
}

fn rig_tests(shared: &Shared, tally: &mut Tally) -> Result<()> {
    shared.run(shared.tests(artifacts::RIG_TESTS)?, tally)
}

/// Those in which it matters how fast the core is, at half of the speed that the rig assumes, and
/// on a busy bus.
fn rig_tests_at_half_speed(shared: &Shared, tally: &mut Tally) -> Result<()> {
    let mut command = shared.tests(artifacts::RIG_TESTS)?;
    command.env("HIVTAC_INSTRUCTIONS_PER_SECOND", "200000000");
    command.env("HIVTAC_BUSY_BUS", "1");
    command.args(["--", "camera::", "faults::", "firmware::", "threshold::"]);
    run_tests(&mut command, tally)
}

fn no_cargo_deny() -> Option<&'static str> {
    let missing = "cargo-deny is not installed: `cargo install cargo-deny`";
    (!toolchain::has("deny")).then_some(missing)
}

/// Licences and sources of packages from elsewhere, as `deny.toml` allows them. Known flaws
/// (`cargo deny check advisories`) are left out: which there are needs the network, and changes
/// from day to day.
fn licences() -> Result<()> {
    for folder in WORKSPACES {
        let mut command = cargo("deny --log-level error --config", folder);
        command.arg(toolchain::at("deny.toml"));
        process::run(command.args(["check", "licenses", "bans", "sources"]))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_choose_steps_and_the_builds_that_they_need() {
        let wanted = |words: &[&str], all| -> Vec<&str> {
            let steps = words.iter().map(|&word| word.to_owned()).collect();
            let test = Test { steps, all };
            let steps = FIRST.iter().chain(&BESIDE).filter(|step| test.wants(step));
            steps.map(|step| step.0).collect()
        };
        assert_eq!(wanted(&[], true).len(), FIRST.len() + BESIDE.len());
        assert!(!wanted(&[], false).contains(&"attacks"));
        assert_eq!(wanted(&["format"], false), ["format"]);
        assert_eq!(wanted(&["rooms"], false), ["tests: across rooms", BUILD]);
        assert!(wanted(&["firmware"], false).is_empty());
    }
}
