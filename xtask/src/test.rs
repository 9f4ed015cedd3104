//! `cargo xtask test`: runs every check and every test of the project.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::thread;

use anyhow::{Context, Result, anyhow, ensure};
use clap::Args;

use crate::artifacts::{self, Programs};
use crate::python::{KIT, LEROBOT, MUJOCO, PACKAGE, RERUN, SERVE, ZENOH};
use crate::report::{Report, Tally, run_tests};
use crate::toolchain::{self, cargo};
use crate::{bench, fuzz, linux_host, packages, process, python, web};

/// Options of `cargo xtask test`.
#[derive(Args)]
pub struct Test {
    /// Run only the steps whose names contain one of these words, and the builds that they need.
    steps: Vec<String>,
    /// Run the slow tests, too: some minutes more.
    #[arg(long)]
    all: bool,
}

/// A step: its name, its work, and for a step of `--all` a function that finds an obstacle to it
/// here.
type Step = (&'static str, Work, Option<Obstacle>);
type Work = fn(&Shared, &mut Tally) -> Result<()>;
type Obstacle = fn() -> Option<String>;

const fn always(name: &'static str, work: Work) -> Step {
    (name, work, None)
}

const fn slow(name: &'static str, obstacle: Obstacle, work: Work) -> Step {
    (name, work, Some(obstacle))
}

/// The steps. Two threads take them in this order, each the next one when it is free. Builds for
/// the microcontroller come first, in their own folder, while the lints hold the common one. Long
/// steps follow; those after them fill the time until both threads end.
static STEPS: [Step; 21] = [
    always("format", |_, _| format()),
    always("lints: microcontroller", |shared, _| shared.target_lints()),
    always("lints: host", |shared, _| host_lints(shared.all)),
    always(BUILD, |shared, _| shared.build()),
    always("tests: rig", rig_tests),
    always("tests: host", host_tests),
    always("tests: across rooms", cross_room_tests),
    slow("attacks", fuzz::obstacle, |_, _| fuzz::run()),
    slow(
        "tests: linux host",
        linux_host::obstacle,
        |shared, tally| shared.linux_host(tally),
    ),
    slow("tests: rig at half speed", || None, rig_tests_at_half_speed),
    slow("tests: python", || PACKAGE.obstacle(), python::test_package),
    slow("tests: serve", || SERVE.obstacle(), python::test_serve),
    slow("tests: zenoh", || ZENOH.obstacle(), python::test_zenoh),
    slow(
        "tests: lerobot",
        || LEROBOT.obstacle(),
        python::test_lerobot,
    ),
    slow("tests: rerun", || RERUN.obstacle(), python::test_rerun),
    slow("tests: mujoco", || MUJOCO.obstacle(), python::test_mujoco),
    slow("tests: kit", || KIT.obstacle(), python::test_kit),
    always("benchmark", |shared, _| shared.benchmark()),
    always("build: board benchmark", |_, _| bench::board::lint()),
    slow("build: other systems", no_other_systems, |_, _| {
        other_systems()
    }),
    slow("licences", no_cargo_deny, |_, _| licences()),
];

/// The build, which also runs if a chosen step needs it.
const BUILD: &str = "build: firmware";
const NEED_BUILD: [&str; 3] = [
    "tests: rig at half speed",
    "tests: across rooms",
    "tests: linux host",
];

/// The project's workspaces, as folders.
const WORKSPACES: [&str; 2] = ["", "tests/qemu"];

/// The state that the steps share.
pub struct Shared {
    all: bool,
    /// Set by the step that builds them; `None` after a failure.
    programs: OnceLock<Option<Programs>>,
    /// Held by steps that write the microcontroller's files: lints leave others than builds.
    target: Mutex<()>,
}

impl Test {
    /// Runs every step, including those after a failure, and prints the table. It uses two threads,
    /// because a single build or test would leave cores idle.
    pub fn run(&self) -> Result<()> {
        let wanted: Vec<&Step> = STEPS.iter().filter(|step| self.wants(step)).collect();
        ensure!(
            !wanted.is_empty(),
            "no step is called so; some need `--all`"
        );
        if toolchain::has("clippy") {
            artifacts::lint_as_built();
        }
        let shared = Shared {
            all: self.all,
            programs: OnceLock::new(),
            target: Mutex::default(),
        };
        let report = Report::new(wanted.len(), toolchain::work_folder("test")?);
        let next = AtomicUsize::new(0);
        let take = || wanted.get(next.fetch_add(1, Ordering::Relaxed));
        let work = || {
            while let Some(&&(name, work, slow)) = take() {
                let obstacle = || slow.and_then(|obstacle| obstacle());
                report.step(name, obstacle, |tally| work(&shared, tally));
            }
        };
        let caught = || {
            let ended = catch_unwind(AssertUnwindSafe(work));
            if ended.is_err() {
                // Ends the wait of any step for the programs.
                shared.programs.get_or_init(|| None);
            }
            ended
        };
        let [one, other] = thread::scope(|scope| {
            let beside = scope.spawn(caught);
            [caught(), beside.join().flatten()]
        });
        one.and(other)
            .map_err(|_| anyhow!("a thread of steps panicked"))?;
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
    fn target_lints(&self) -> Result<()> {
        let _no_build = self.target.lock();
        target_lints()
    }

    fn benchmark(&self) -> Result<()> {
        let _no_lints = self.target.lock();
        bench::Bench::default().run()
    }

    fn build(&self) -> Result<()> {
        let _no_lints = self.target.lock();
        let built = Programs::build();
        let problem = built.as_ref().err().map(|error| anyhow!("{error:#}"));
        self.programs.get_or_init(|| built.ok());
        problem.map_or(Ok(()), Err)
    }

    /// The programs, once they are built.
    fn built(&self) -> Result<&Programs> {
        let programs = self.programs.wait().as_ref();
        programs.context("not run: the firmware could not be built")
    }

    fn linux_host(&self, tally: &mut Tally) -> Result<()> {
        linux_host::test(self.built()?.firmware(), tally)
    }

    /// The cargo command of tests with these programs, once they are built.
    fn tests(&self, which: [&str; 2]) -> Result<Command> {
        let programs = self.built()?;
        let mut command = artifacts::test(&which);
        programs.name_to(&mut command);
        Ok(command)
    }

    /// Runs a test runner, with the slow tests if `all` is set.
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

/// Checks the builds that [`artifacts::lint_as_built`] linted, and lints the rest. What only slow
/// tests run is left out unless `all` is set.
fn host_lints(all: bool) -> Result<()> {
    toolchain::ensure_component("clippy", "clippy")?;
    for command in artifacts::everything(all) {
        artifacts::without_warnings(command)?;
    }
    Ok(())
}

/// Lints both boards' firmware and the image for QEMU. The firmware has seeded bugs, and is
/// what its tests run: a linter must not change what is flashed.
fn target_lints() -> Result<()> {
    toolchain::ensure_component("clippy", "clippy")?;
    for mut command in artifacts::for_target() {
        toolchain::lint_for_target(&mut command)?;
        artifacts::without_warnings(command)?;
    }
    Ok(())
}

fn host_tests(shared: &Shared, tally: &mut Tally) -> Result<()> {
    let tests = shared.run(artifacts::test(&["--tests"]), tally);
    let of_studies = match shared.all {
        true => shared.run(artifacts::test(&artifacts::STUDIES_TESTS), tally),
        false => Ok(()),
    };
    let of_docs = run_tests(&mut artifacts::test(&["--doc"]), tally);
    tests.and(of_studies).and(of_docs)
}

fn cross_room_tests(shared: &Shared, tally: &mut Tally) -> Result<()> {
    let mut command = shared.tests(artifacts::ROOMS_TESTS)?;
    packages::ensure_qemu()?;
    command.env("HIVTAC_TOOL", artifacts::host_tool()?);
    command.env("HIVTAC_QEMU_IMAGE", artifacts::qemu_image()?);
    if shared.all {
        // Only slow tests run these programs.
        command.env("HIVTAC_M55_IMAGE", artifacts::m55_image()?);
        command.env(
            "HIVTAC_CALIBRATE",
            artifacts::host_program("hivtac-calibrate")?,
        );
        command.env("HIVTAC_CHROMIUM", packages::chromium()?);
        command.env("HIVTAC_WEB", web::page(&[])?);
    }
    shared.run(command, tally)
}

fn rig_tests(shared: &Shared, tally: &mut Tally) -> Result<()> {
    let mut command = shared.tests(artifacts::RIG_TESTS)?;
    if shared.all {
        command.env("HIVTAC_ATTACKS", "3");
    }
    shared.run(command, tally)
}

/// The tests that depend on the core's speed, at half of the speed that the rig assumes, and on a
/// busy bus.
fn rig_tests_at_half_speed(shared: &Shared, tally: &mut Tally) -> Result<()> {
    let mut command = shared.tests(artifacts::RIG_TESTS)?;
    command.env("HIVTAC_INSTRUCTIONS_PER_SECOND", "200000000");
    command.env("HIVTAC_BUSY_BUS", "1");
    command.args(["--", "camera::", "faults::", "firmware::", "threshold::"]);
    run_tests(&mut command, tally)
}

/// Systems on which the host tool is not tested, but compiles.
const OTHER_SYSTEMS: [&str; 2] = ["x86_64-pc-windows-gnu", "aarch64-apple-darwin"];

fn no_other_systems() -> Option<String> {
    let mut add = process::command("rustup target add");
    let added = process::succeeds(add.args(OTHER_SYSTEMS).env("RUSTUP_AUTO_INSTALL", "0"));
    (!added).then(|| "rustup cannot add the targets of Windows and macOS".to_owned())
}

fn other_systems() -> Result<()> {
    for system in OTHER_SYSTEMS {
        let words = "check --profile tools --package hivtac --bin hivtac --target";
        process::run(cargo(words, "").arg(system))?;
    }
    Ok(())
}

fn no_cargo_deny() -> Option<String> {
    let missing = "cargo-deny is not installed: `cargo install cargo-deny`";
    (!toolchain::has("deny")).then(|| missing.to_owned())
}

/// Checks licences and sources of foreign packages against `deny.toml`. Known flaws (`cargo deny
/// check advisories`) are left out, because their list needs the network and changes from day to
/// day.
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
            let steps = STEPS.iter().filter(|step| test.wants(step));
            steps.map(|step| step.0).collect()
        };
        assert_eq!(wanted(&[], true).len(), STEPS.len());
        assert!(!wanted(&[], false).contains(&"attacks"));
        assert_eq!(wanted(&["format"], false), ["format"]);
        assert_eq!(wanted(&["rooms"], false), [BUILD, "tests: across rooms"]);
        assert!(wanted(&["firmware"], false).is_empty());
    }
}
