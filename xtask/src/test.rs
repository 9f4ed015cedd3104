//! `cargo xtask test`: every check and every test of the project.

use std::fs::File;
use std::path::PathBuf;
use std::process::Command;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;

use anyhow::{Context, Result, anyhow};
use clap::Args;

use crate::artifacts::Board;
use crate::report::{Report, run_tests};
use crate::toolchain::{self, Toolchain, cargo};
use crate::{
    artifacts, bench, columns, fuzz, licences, packages, process, python, served, workspace,
};

/// The workspaces: folder, and whether it has more than one package.
const WORKSPACES: [(&str, bool); 3] = [
    ("", true),
    ("tests/qemu", false),
    ("xtask/instruction-counter", false),
];

/// Options of `cargo xtask test`.
#[derive(Args)]
pub struct Test {
    /// Run only the steps whose names contain one of these words, and the builds that they need.
    steps: Vec<String>,
    /// Run the slow tests, too: some minutes more.
    #[arg(long)]
    all: bool,
}

/// The rig's tests in which it matters how fast the core is.
const TIMED: [&str; 4] = ["camera::", "faults::", "firmware::", "threshold::"];

/// The programs that the tests of the rig and those across rooms run.
#[derive(Clone)]
struct Programs {
    firmware: PathBuf,
    /// One ELF per seeded bug or feature, named by it, those with the model for YUV422, and those
    /// for the second board.
    bugs: PathBuf,
}

impl Test {
    /// Runs every step, past those that fail, and prints the table. The rig's tests and some steps
    /// run beside the others, so that no core waits while one of both builds or tests with the
    /// other alone; what they print comes when the others are done.
    ///
    /// # Errors
    /// When a step failed.
    pub fn run(&self, toolchain: &Toolchain) -> Result<()> {
        let log = workspace::work_folder("test")?.join("beside.txt");
        let printed = File::create(&log).with_context(|| format!("writing {}", log.display()))?;
        let (built, programs) = mpsc::channel();
        let mut report = Report::default();
        let components = self.components(&mut report);
        if toolchain::has("clippy") {
            artifacts::lint_as_built();
        }
        let beside = thread::scope(|scope| {
            let beside = || self.beside(toolchain, components, built);
            let beside = scope.spawn(|| process::aside(printed, beside));
            if components {
                self.checks(&mut report);
            }
            self.host_tests(&mut report);
            self.cross_room_tests(&mut report, toolchain, &programs);
            beside.join()
        });
        process::print_through(&String::from_utf8_lossy(&std::fs::read(&log)?));
        report.append(beside.map_err(|_| anyhow!("the steps beside the others panicked"))?);
        report.finish()
    }

    /// About half of the work: what is for the microcontroller, attacks and the rig's tests, and
    /// around them what the others need nothing of. What is for the microcontroller is first: it is
    /// built in a folder of its own while the lints hold the common one.
    fn beside(&self, toolchain: &Toolchain, components: bool, built: Sender<Programs>) -> Report {
        let mut report = Report::default();
        if components && self.wants("lints: microcontroller") {
            report.step("lints: microcontroller", |_| target_lints(toolchain));
        }
        if self.wants_one_of(&["tests: rig at half speed", "tests: across rooms"]) {
            let programs = report.step("build: firmware", |_| Programs::build(toolchain));
            if let Some(programs) = &programs {
                // Nobody waits for them where no step across rooms is wanted.
                let _ = built.send(programs.clone());
            }
            drop(built);
            self.rig_tests(&mut report, programs.as_ref());
        }
        if self.all && self.wants("attacks") {
            report.optional("attacks", fuzz::obstacle(), |_| fuzz::run());
        }
        self.benchmarks(&mut report, toolchain);
        if self.all {
            self.optional(&mut report, toolchain);
        }
        report
    }

    fn benchmarks(&self, report: &mut Report, toolchain: &Toolchain) {
        if self.wants("benchmark") {
            report.step("benchmark", |_| bench::Bench::default().run(toolchain));
        }
        if self.wants("build: board benchmark") {
            report.step("build: board benchmark", |_| bench::board::lint(toolchain));
        }
    }

    /// What needs programs that nothing else here does.
    fn optional(&self, report: &mut Report, toolchain: &Toolchain) {
        if self.wants("licences") {
            let folders = WORKSPACES.iter().map(|(folder, _)| *folder);
            report.optional("licences", licences::obstacle(), |_| {
                licences::check(folders)
            });
        }
        if self.wants("tests: python") {
            report.optional("tests: python", python::obstacle(), |tally| {
                python::test(&artifacts::firmware(toolchain)?, tally)
            });
        }
        if self.wants("tests: serve") {
            report.optional("tests: serve", served::obstacle(), |tally| {
                served::test(&artifacts::firmware(toolchain)?, tally)
            });
        }
    }

    fn wants(&self, step: &str) -> bool {
        self.steps.is_empty() || self.steps.iter().any(|word| step.contains(word))
    }

    fn wants_one_of(&self, steps: &[&str]) -> bool {
        steps.iter().any(|step| self.wants(step))
    }

    /// Whether the programs are there that format and lint, where they are wanted.
    fn components(&self, report: &mut Report) -> bool {
        let wanted = self.wants_one_of(&["format", "lints: host", "lints: microcontroller"]);
        let ensure = |_: &mut _| toolchain::ensure_components();
        wanted && report.step("components", ensure).is_some()
    }

    fn checks(&self, report: &mut Report) {
        if self.wants("format") {
            report.step("format", |_| check_format().and_then(|()| columns::check()));
        }
        if self.wants("lints: host") {
            report.step("lints: host", |_| host_lints());
        }
    }

    fn host_tests(&self, report: &mut Report) {
        if self.wants("tests: host") {
            report.step("tests: host", |tally| {
                run_tests(self.slow_ones(&mut artifacts::test()), tally)
            });
        }
    }

    /// The rig's tests at the speed that it assumes of the core, and those in which time matters
    /// at half of it and on a busy bus.
    fn rig_tests(&self, report: &mut Report, programs: Option<&Programs>) {
        let mut test = |step, prepare: &dyn Fn(&mut Command)| {
            if self.wants(step) {
                report.step(step, |tally| {
                    let programs = programs.context("not run: the firmware could not be built")?;
                    let mut command = artifacts::test();
                    programs.name_to(command.args(artifacts::RIG_TESTS));
                    prepare(&mut command);
                    run_tests(&mut command, tally)
                });
            }
        };
        test("tests: rig", &|command| {
            self.slow_ones(command);
        });
        test("tests: rig at half speed", &|command| {
            command.env("HIVTAC_INSTRUCTIONS_PER_SECOND", "200000000");
            command.env("HIVTAC_BUSY_BUS", "1");
            command.arg("--").args(TIMED);
        });
    }

    fn cross_room_tests(
        &self,
        report: &mut Report,
        toolchain: &Toolchain,
        programs: &Receiver<Programs>,
    ) {
        if self.wants("tests: across rooms") {
            report.step("tests: across rooms", |tally| {
                let programs = programs.recv();
                let programs = programs.context("not run: the firmware could not be built")?;
                let mut command = cross_room_tests(toolchain, &programs)?;
                if self.all {
                    // Only slow tests run these.
                    command
                        .env("HIVTAC_CALIBRATE", artifacts::calibrate()?)
                        .env("HIVTAC_CHROMIUM", packages::chromium()?);
                }
                run_tests(self.slow_ones(&mut command), tally)
            });
        }
    }

    /// Has a test runner run what it would leave out for its time, if asked to.
    fn slow_ones<'c>(&self, command: &'c mut Command) -> &'c mut Command {
        if self.all {
            command.args(["--", "--include-ignored"]);
        }
        command
    }
}

impl Programs {
    fn build(toolchain: &Toolchain) -> Result<Programs> {
        let bugs = workspace::work_folder("bugs")?;
        for feature in artifacts::SEEDED_BUGS {
            let elf = artifacts::firmware_for(toolchain, Board::default(), feature)?;
            artifacts::copy(&elf, &bugs.join(format!("{feature}.elf")))?;
        }
        let elf = artifacts::firmware_for_yuv422(toolchain)?;
        artifacts::copy(&elf, &bugs.join("yuv422.elf"))?;
        let second = Board::OpenmvH7;
        for (feature, name) in [
            ("", "openmv-h7"),
            ("bug-polarity", "openmv-h7-bug-polarity"),
            ("bug-camera-register", "openmv-h7-bug-camera-register"),
        ] {
            let elf = artifacts::firmware_for(toolchain, second, feature)?;
            artifacts::copy(&elf, &bugs.join(format!("{name}.elf")))?;
        }
        // Last, so that what cargo leaves behind is the firmware without a bug.
        Ok(Programs {
            firmware: artifacts::firmware(toolchain)?,
            bugs,
        })
    }

    /// Tells a test runner where they lie.
    fn name_to(&self, command: &mut Command) {
        command
            .env("HIVTAC_ELF", &self.firmware)
            .env("HIVTAC_BUG_ELFS", &self.bugs);
    }
}

fn check_format() -> Result<()> {
    for (folder, many) in WORKSPACES {
        let mut command = cargo("fmt", &workspace::folder(folder));
        command.args(if many {
            &["--all", "--check"][..]
        } else {
            &["--check"]
        });
        process::run(&mut command)?;
    }
    Ok(())
}

/// Of what [`artifacts::lint_as_built`] had linted, and of what is only checked.
fn host_lints() -> Result<()> {
    for command in [
        artifacts::everything(),
        artifacts::tests_by_name(),
        artifacts::serving_command(),
    ] {
        artifacts::without_warnings(command)?;
    }
    let mut counter = cargo("clippy", &workspace::folder("xtask/instruction-counter"));
    process::run(counter.args(["--release", "--", "-D", "warnings"]))
}

/// Both boards' firmware and the image for QEMU are built for this alone, with what they depend on
/// as it is built for those that run: what is flashed does not depend on a linter.
fn target_lints(toolchain: &Toolchain) -> Result<()> {
    for board in [Board::Weact, Board::OpenmvH7] {
        let mut command = artifacts::firmware_command(toolchain, board, "");
        toolchain.lint(&mut command)?;
        artifacts::without_warnings(command)?;
    }
    let mut image = artifacts::qemu_image_command(toolchain);
    toolchain.lint(&mut image)?;
    artifacts::without_warnings(image)
}

fn cross_room_tests(toolchain: &Toolchain, programs: &Programs) -> Result<Command> {
    packages::ensure_qemu()?;
    let mut command = artifacts::test();
    programs.name_to(command.args(artifacts::ROOMS_TESTS));
    command
        .env("HIVTAC_TOOL", artifacts::host_tool()?)
        .env("HIVTAC_QEMU_IMAGE", artifacts::qemu_image(toolchain)?);
    Ok(command)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn test(steps: &[&str]) -> Test {
        Test {
            steps: steps.iter().map(|&step| step.to_owned()).collect(),
            all: false,
        }
    }

    #[test]
    fn without_words_every_step_is_wanted() {
        assert!(test(&[]).wants("format"));
    }

    #[test]
    fn words_choose_steps() {
        let test = test(&["rig", "format"]);
        assert!(test.wants("tests: rig") && test.wants("format"));
        assert!(!test.wants("benchmark"));
        assert!(test.wants_one_of(&["tests: rig", "tests: across rooms"]));
    }
}
