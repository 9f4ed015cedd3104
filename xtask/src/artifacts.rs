//! Builds the programs that demo and tests run; cargo reports the paths of the files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, ensure};
use hivtac_wire::image::Image;
use serde_json::Value;

use crate::process;
use crate::toolchain::{self, M55_TARGET, TARGET, WEB_TARGET, build_for, cargo, work_folder};

/// The cargo profile of programs that run on this computer, which builds quickly.
pub const TOOLS: &str = "tools";
/// Arguments for the rig's tests that run firmware. Cargo builds and runs these and
/// [`ROOMS_TESTS`], which cross folders, only by their names.
pub const RIG_TESTS: [&str; 2] = ["--test", "rig"];
/// See [`RIG_TESTS`].
pub const ROOMS_TESTS: [&str; 2] = ["--test", "rooms"];
/// Arguments for the tests of studies, all slow.
pub const STUDIES_TESTS: [&str; 4] = ["--bin", "hivtac-studies", "--test", "scene"];

/// The boards for which there is firmware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Board {
    /// WeAct MiniSTM32H743VIT6 with an OV7725.
    #[default]
    Weact,
    /// OpenMV Cam H7 with an MT9V034.
    OpenmvH7,
}

/// Builds the firmware for all tests; returns it as it is flashed. The others are in the folder
/// `bugs`: with seeded bugs, one of them chosen and detected by the rig; with the model for YUV422;
/// for the second board.
pub fn test_firmware() -> Result<PathBuf> {
    let [mut yuv422, openmv] = [Board::Weact, Board::OpenmvH7].map(|it| firmware_command(it, ""));
    yuv422.env("HIVTAC_MODEL", "calibration/models/yuv422/default.hvtm");
    let [bugs, openmv_bugs, _] = for_target();
    for (mut command, name) in [
        (bugs, "seeded-bugs.elf"),
        (openmv_bugs, "openmv-h7-seeded-bugs.elf"),
        (yuv422, "yuv422.elf"),
        (openmv, "openmv-h7.elf"),
    ] {
        let elf = build(&mut command, "hivtac-firmware")?;
        copy(&elf, &work_folder("bugs")?.join(name))?;
    }
    // Last, because cargo's own file must be the firmware without bugs.
    firmware(Board::Weact)
}

/// Builds the firmware as it is flashed.
pub fn firmware(board: Board) -> Result<PathBuf> {
    build(&mut firmware_command(board, ""), "hivtac-firmware")
}

/// Builds all boards' firmware, as it is written into flash. The usual board's is last: its ELF
/// stays where [`firmware`] has it.
pub fn images() -> Result<[Image; 2]> {
    let image = |board| -> Result<Image> {
        let elf = firmware(board)?;
        let file = fs::read(&elf).with_context(|| format!("reading {}", elf.display()))?;
        Image::of_elf(&file).with_context(|| elf.display().to_string())
    };
    Ok([image(Board::OpenmvH7)?, image(Board::Weact)?])
}

/// The cargo command that builds the firmware for a board, with `feature` unless it is empty.
pub fn firmware_command(board: Board, feature: &str) -> Command {
    let mut command = build_for(TARGET, "");
    command.args(["--package", "hivtac-firmware", "--features", feature]);
    if board == Board::OpenmvH7 {
        command.args(["--no-default-features", "--features", "board-openmv-h7"]);
    }
    command
}

/// The cargo commands that build the microcontroller's programs for lints: for each board the
/// firmware with all seeded bugs, which is never flashed, and the image for QEMU.
pub fn for_target() -> [Command; 3] {
    let [mut weact, mut openmv] =
        [Board::Weact, Board::OpenmvH7].map(|board| firmware_command(board, "seeded-bugs"));
    lint_if_linting(&mut weact);
    lint_if_linting(&mut openmv);
    [weact, openmv, build_for(TARGET, QEMU_IMAGE)]
}

/// Builds the host tool as it is installed.
pub fn host_tool() -> Result<PathBuf> {
    kept(host_command("hivtac"), "tool")
}

/// Builds the host tool with everything that `hivtac serve` can do, which is optional for users.
pub fn serving_tool() -> Result<PathBuf> {
    kept(serving_command(), "serving-tool")
}

fn serving_command() -> Command {
    let mut command = host_command("hivtac");
    command.args(["--features", "hivtac/zenoh,hivtac/foxglove"]);
    command
}

/// Builds the host tool into its own folder. Otherwise cargo would replace it by a build with other
/// features while another step runs it.
fn kept(mut command: Command, folder: &str) -> Result<PathBuf> {
    static BUILDING: Mutex<()> = Mutex::new(());
    let _one_at_a_time = BUILDING.lock();
    let kept = work_folder(folder)?.join("hivtac");
    // Under another name first: a running program's file cannot be overwritten.
    let fresh = kept.with_extension("new");
    copy(&build(&mut command, "hivtac")?, &fresh)?;
    fs::rename(&fresh, &kept).with_context(|| format!("renaming {}", fresh.display()))?;
    Ok(kept)
}

/// Builds a program that runs on this computer: the rig, the calibration, or that of the
/// benchmarks.
pub fn host_program(name: &str) -> Result<PathBuf> {
    build(&mut host_command(name), name)
}

fn host_command(program: &str) -> Command {
    let mut command = host_cargo("build");
    command.args(["--bin", program]);
    command
}

/// The cargo command that runs tests of the workspace, including those after a failure. It uses the
/// profile of the programs that tests run, and dependencies are built once. `which` are cargo's
/// arguments that choose tests.
pub fn test(which: &[&str]) -> Command {
    let mut command = host_cargo("test");
    command.args(which).arg("--no-fail-fast");
    command
}

/// The cargo commands that build programs and tests for this computer: those that are not slow, or
/// all. Those of `hivtac serve` need many more packages, and are slow.
pub fn everything(all: bool) -> Vec<Command> {
    let [mut usual, mut by_name] = [(); 2].map(|()| host_cargo("build"));
    match all {
        true => usual.arg("--all-targets"),
        // The first page of code that a newcomer reads, of all examples.
        false => usual.args(["--lib", "--bins", "--tests", "--example", "force"]),
    };
    by_name.args(RIG_TESTS).args(ROOMS_TESTS);
    let mut commands = vec![usual, by_name];
    if all {
        commands[1].args(STUDIES_TESTS);
        commands.push(serving_command());
    }
    commands
}

/// Whether builds for this computer also lint this project's packages, and those with seeded bugs.
static LINTING: AtomicBool = AtomicBool::new(false);

/// From now on, builds for this computer also lint. Each package is checked once, and no separate
/// check of its dependencies is necessary. A lint does not stop a build; [`without_warnings`] finds
/// it.
pub fn lint_as_built() {
    LINTING.store(true, Ordering::Relaxed);
}

/// A cargo command for the packages that run on this computer, in the profile of [`TOOLS`]. It
/// covers all of them even for one program: dependencies then have the features that tests need,
/// and are built once. The rig's emulator declares a newer compiler than it needs.
fn host_cargo(verb: &str) -> Command {
    let mut command = cargo(verb, "");
    command.args(["--profile", TOOLS, "--ignore-rust-version", "--workspace"]);
    command.args(["--exclude", "hivtac-firmware"]);
    lint_if_linting(&mut command);
    command
}

fn lint_if_linting(command: &mut Command) {
    if LINTING.load(Ordering::Relaxed) {
        toolchain::lint(command);
    }
}

/// Runs `cargo build`; an error if it gives warnings.
pub fn without_warnings(mut command: Command) -> Result<()> {
    let mut warnings = 0;
    for_each_message(command.arg("--message-format=json"), |message| {
        let said = &message["message"];
        if let Some(text) = said["rendered"].as_str() {
            process::say(text);
            warnings += usize::from(said["level"] == "warning");
        }
    })?;
    ensure!(warnings == 0, "{warnings} warnings: see above");
    Ok(())
}

/// The folder of the program for QEMU.
const QEMU_IMAGE: &str = "tests/qemu";

/// Builds the sensing as a Cortex-M7 program for QEMU.
pub fn qemu_image() -> Result<PathBuf> {
    build(&mut build_for(TARGET, QEMU_IMAGE), "hivtac-qemu-image")
}

/// Builds the same as a Cortex-M55 program, whose target is added if it is missing.
pub fn m55_image() -> Result<PathBuf> {
    toolchain::ensure_target(M55_TARGET)?;
    build(&mut build_for(M55_TARGET, QEMU_IMAGE), "hivtac-qemu-image")
}

/// Builds the WebAssembly module of the page that needs no server.
pub fn web_module() -> Result<PathBuf> {
    toolchain::ensure_target(WEB_TARGET)?;
    let words = "rustc --profile web --package hivtac-web --lib --crate-type cdylib --target";
    build(cargo(words, "").arg(WEB_TARGET), "hivtac_web")
}

/// Builds the plugin that counts instructions, for a version of QEMU's plugin interface.
pub fn instruction_counter(version: u32) -> Result<PathBuf> {
    let words = "build --package xtask --example instruction-counter --profile";
    let mut command = cargo(words, "");
    command.arg(TOOLS);
    if version >= 2 {
        command.args(["--features", "plugin-api-2"]);
    }
    build(&mut command, "instruction-counter")
}

/// Runs `cargo build`; returns the file that it made for the target of this name.
pub fn build(command: &mut Command, target: &str) -> Result<PathBuf> {
    let mut found = None;
    command.arg("--message-format=json-render-diagnostics");
    for_each_message(command, |message| {
        if message["reason"] == "compiler-artifact" && message["target"]["name"] == target {
            let file = message["executable"].as_str();
            found = file.or(message["filenames"][0].as_str()).map(PathBuf::from);
        }
    })?;
    found.with_context(|| format!("`{command:?}` made no {target}"))
}

/// Runs a cargo command that sends messages in JSON; passes each of them to `each`.
fn for_each_message(command: &mut Command, mut each: impl FnMut(&Value)) -> Result<()> {
    process::for_each_line(command, |line| {
        if let Ok(message) = serde_json::from_str(line) {
            each(&message);
        }
    })
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let copied = fs::copy(from, to);
    copied.with_context(|| format!("copying {} to {}", from.display(), to.display()))?;
    Ok(())
}
