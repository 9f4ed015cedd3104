//! `cargo xtask test`: runs every check and every test of the project.

use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::thread;

use anyhow::{Result, anyhow, ensure};
use clap::Args;

use crate::artifacts;
use crate::python::{self, KIT, LEROBOT, MUJOCO, PACKAGE, RERUN, SERVE, ZENOH};
use crate::report::{Report, Tally, run_tests};
use crate::toolchain::{self, cargo};
use crate::{bench, fuzz, linux_host, packages, process, web};

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
/// here. The work's argument says whether to run slow tests, too.
type Step = (&'static str, Work, Option<Obstacle>);
type Work = fn(bool, &mut Tally) -> Result<()>;
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
    always("lints: microcontroller", |_, _| target_lints()),
    always("lints: host", |all, _| host_lints(all)),
    always("build: firmware", |_, _| firmware().map(drop)),
    always("tests: rig", rig_tests),
    always("tests: host", host_tests),
    always("tests: across rooms", cross_room_tests),
    slow("attacks", fuzz::obstacle, |_, _| fuzz::run()),
    slow("tests: linux host", linux_host::obstacle, |_, tally| {
        linux_host::test(firmware()?, tally)
    }),
    slow("tests: rig at half speed", || None, rig_tests_at_half_speed),
    slow("tests: python", || PACKAGE.obstacle(), python_tests),
    slow("tests: serve", || SERVE.obstacle(), |_, it| SERVE.run(it)),
    slow("tests: zenoh", || ZENOH.obstacle(), |_, it| ZENOH.run(it)),
    slow(
        "tests: lerobot",
        || LEROBOT.obstacle(),
        |_, it| LEROBOT.run(it),
    ),
    slow("tests: rerun", || RERUN.obstacle(), |_, it| RERUN.run(it)),
    slow(
        "tests: mujoco",
        || MUJOCO.obstacle(),
        |_, it| MUJOCO.run(it),
    ),
    slow("tests: kit", || KIT.obstacle(), |_, it| KIT.run(it)),
    always("benchmark", |_, _| benchmark()),
    always("build: board benchmark", |_, _| bench::board::lint()),
    slow("build: other systems", no_other_systems, |_, _| {
        other_systems()
    }),
    slow("licences", no_cargo_deny, |_, _| licences()),
];

/// The project's workspaces, as folders.
const WORKSPACES: [&str; 2] = ["", "tests/qemu"];

/// Held by steps that write the microcontroller's files: lints leave others than builds.
static TARGET_FILES: Mutex<()> = Mutex::new(());

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
        let report = Report::new(wanted.len(), toolchain::work_folder("test")?);
        let next = AtomicUsize::new(0);
        let take = || wanted.get(next.fetch_add(1, Ordering::Relaxed));
        let work = || {
            while let Some(&&(name, work, slow)) = take() {
                let obstacle = || slow.and_then(|obstacle| obstacle());
                report.step(name, obstacle, |tally| work(self.all, tally));
            }
        };
        thread::scope(|scope| {
            scope.spawn(work);
            work();
        });
        report.finish()
    }

    fn wants(&self, (name, _, slow): &Step) -> bool {
        let is_named = self.steps.iter().any(|word| name.contains(word.as_str()));
        (self.all || slow.is_none()) && (self.steps.is_empty() || is_named)
    }
}

/// The firmware as it is flashed. Whoever needs it first builds it, and that of all tests; others
/// wait.
fn firmware() -> Result<&'static Path> {
    static FIRMWARE: OnceLock<Result<std::path::PathBuf, String>> = OnceLock::new();
    let built = FIRMWARE.get_or_init(|| {
        let _no_lints = TARGET_FILES.lock();
        artifacts::test_firmware().map_err(|error| format!("{error:#}"))
    });
    let built = built.as_ref();
    Ok(built.map_err(|why| anyhow!("the firmware could not be built: {why}"))?)
}

/// The cargo command of tests that run the firmware.
fn firmware_tests(which: [&str; 2]) -> Result<Command> {
    let mut command = artifacts::test(&which);
    command.env("HIVTAC_ELF", firmware()?);
    command.env("HIVTAC_BUG_ELFS", toolchain::work_folder("bugs")?);
    Ok(command)
}

/// Runs tests, with the slow ones if `all` is set.
fn run(mut command: Command, all: bool, tally: &mut Tally) -> Result<()> {
    if all {
        command.args(["--", "--include-ignored"]);
    }
    run_tests(&mut command, tally)
}

fn benchmark() -> Result<()> {
    let _no_lints = TARGET_FILES.lock();
    bench::Bench::default().run()
}

fn python_tests(_: bool, tally: &mut Tally) -> Result<()> {
    PACKAGE.run(tally).and(python::check_types())
}

fn format() -> Result<()> {
    toolchain::ensure_component("fmt", "rustfmt")?;
    for folder in WORKSPACES {
        process::run(&mut cargo("fmt --all --check", folder))?;
    }
    Ok(())
}

/// Checks the builds that [`artifacts::lint_as_built`] linted, and lints the rest. Programs of slow
/// tests are left out unless `all` is set.
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
    let _no_build = TARGET_FILES.lock();
    for mut command in artifacts::for_target() {
        toolchain::lint(&mut command);
        artifacts::without_warnings(command)?;
    }
    Ok(())
}

fn host_tests(all: bool, tally: &mut Tally) -> Result<()> {
    let tests = run(artifacts::test(&["--tests"]), all, tally);
    let of_studies = match all {
        true => run(artifacts::test(&artifacts::STUDIES_TESTS), all, tally),
        false => Ok(()),
    };
    let of_docs = run_tests(&mut artifacts::test(&["--doc"]), tally);
    tests.and(of_studies).and(of_docs)
}

fn cross_room_tests(all: bool, tally: &mut Tally) -> Result<()> {
    let mut command = firmware_tests(artifacts::ROOMS_TESTS)?;
    packages::ensure("qemu-system-arm", "qemu-system-arm")?;
    command.env("HIVTAC_TOOL", artifacts::host_tool()?);
    command.env("HIVTAC_QEMU_IMAGE", artifacts::qemu_image()?);
    if all {
        // Only slow tests run these programs.
        let calibrate = artifacts::host_program("hivtac-calibrate")?;
        command.env("HIVTAC_M55_IMAGE", artifacts::m55_image()?);
        command.env("HIVTAC_CALIBRATE", calibrate);
        command.env("HIVTAC_CHROMIUM", packages::chromium()?);
        command.env("HIVTAC_WEB", web::page(&[])?);
    }
    run(command, all, tally)
}

fn rig_tests(all: bool, tally: &mut Tally) -> Result<()> {
    let mut command = firmware_tests(artifacts::RIG_TESTS)?;
    if all {
        command.env("HIVTAC_ATTACKS", "3");
    }
    run(command, all, tally)
}

/// The tests that depend on the core's speed, at half of the speed that the rig assumes, and on a
/// busy bus.
fn rig_tests_at_half_speed(_: bool, tally: &mut Tally) -> Result<()> {
    let mut command = firmware_tests(artifacts::RIG_TESTS)?;
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
    fn words_choose_steps() {
        let wanted = |words: &[&str], all| -> Vec<&str> {
            let steps = words.iter().map(|&word| word.to_owned()).collect();
            let test = Test { steps, all };
            let steps = STEPS.iter().filter(|step| test.wants(step));
            steps.map(|step| step.0).collect()
        };
        assert_eq!(wanted(&[], true).len(), STEPS.len());
        assert!(!wanted(&[], false).contains(&"attacks"));
        let both = ["format", "tests: across rooms"];
        assert_eq!(wanted(&["rooms", "format"], false), both);
        assert!(wanted(&["attacks"], false).is_empty());
    }
}
