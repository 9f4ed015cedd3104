//! What the demo and the tests run: each is built by cargo, which also says where it lies.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, ensure};

use crate::toolchain::{self, Toolchain, cargo};
use crate::{process, workspace};

/// Features of the firmware that each seed one bug which the rig must notice.
pub const SEEDED_BUGS: [&str; 5] = [
    "bug-dmamux-request",
    "bug-polarity",
    "bug-camera-register",
    "bug-half-buffer",
    "bug-usb-clock",
];

/// The profile of programs that run here, which is quick to build.
pub const TOOLS: &str = "tools";

/// The boards that there is firmware for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Board {
    /// WeAct MiniSTM32H743VIT6 with an OV7725.
    #[default]
    Weact,
    /// OpenMV Cam H7 with an MT9V034.
    OpenmvH7,
}

impl Board {
    /// Its name on command lines.
    pub fn name(self) -> &'static str {
        match self {
            Board::Weact => "weact",
            Board::OpenmvH7 => "openmv-h7",
        }
    }
}

/// The firmware, as it is flashed.
pub fn firmware(toolchain: &Toolchain) -> Result<PathBuf> {
    firmware_for(toolchain, Board::default(), "")
}

/// The firmware for a board, with one feature more, such as a seeded bug, or none.
pub fn firmware_for(toolchain: &Toolchain, board: Board, feature: &str) -> Result<PathBuf> {
    let mut command = firmware_command(toolchain, board, feature);
    build(&mut command, "hivtac-firmware")
}

/// The firmware with the model for YUV422.
pub fn firmware_for_yuv422(toolchain: &Toolchain) -> Result<PathBuf> {
    let mut command = firmware_command(toolchain, Board::default(), "");
    command.env("HIVTAC_MODEL", "calibration/models/yuv422/default.hvtm");
    build(&mut command, "hivtac-firmware")
}

/// What builds the firmware for a board, with one feature more or none.
pub fn firmware_command(toolchain: &Toolchain, board: Board, feature: &str) -> Command {
    let mut command = toolchain.build(workspace::root());
    command.args(["--package", "hivtac-firmware", "--release"]);
    match board {
        Board::Weact => command.args(["--features", feature]),
        Board::OpenmvH7 => {
            let features = format!("board-openmv-h7 {feature}");
            command.args(["--no-default-features", "--features", &features])
        }
    };
    command
}

/// The rig and the host tool, built in one go.
pub fn rig_and_host_tool() -> Result<[PathBuf; 2]> {
    let programs = ["hivtac-rig", "hivtac"];
    build_all(
        host_command(programs[0]).args(["--bin", programs[1]]),
        programs,
    )
}

/// The host tool, as it is installed.
pub fn host_tool() -> Result<PathBuf> {
    kept(&mut host_command("hivtac"), "tool")
}

/// The same with all that `hivtac serve` can, which the tool of users has only when they ask for
/// it.
pub fn serving_tool() -> Result<PathBuf> {
    kept(&mut serving_command(), "serving-tool")
}

/// What builds it.
pub fn serving_command() -> Command {
    let mut command = host_command("hivtac");
    command.args(["--features", "hivtac/ros2,hivtac/foxglove"]);
    command
}

/// The host tool in a folder of its own: cargo puts that with other features in its place, which
/// another step may be running.
fn kept(command: &mut Command, folder: &str) -> Result<PathBuf> {
    static BUILDING: Mutex<()> = Mutex::new(());
    let one_at_a_time = BUILDING.lock();
    let kept = workspace::work_folder(folder)?.join("hivtac");
    // By another name first: a program that runs cannot be written over.
    let fresh = kept.with_extension("new");
    copy(&build(command, "hivtac")?, &fresh)?;
    std::fs::rename(&fresh, &kept).with_context(|| format!("renaming {}", fresh.display()))?;
    drop(one_at_a_time);
    Ok(kept)
}

/// The calibration.
pub fn calibrate() -> Result<PathBuf> {
    build(&mut host_command("hivtac-calibrate"), "hivtac-calibrate")
}

/// What writes the scripts of the benchmarks.
pub fn benchmark_cases() -> Result<PathBuf> {
    build(&mut host_command("benchmark-cases"), "benchmark-cases")
}

fn host_command(program: &str) -> Command {
    let mut command = host_cargo("build");
    command.args(["--bin", program]);
    command
}

/// The rig.
pub fn rig() -> Result<PathBuf> {
    build(&mut host_command("hivtac-rig"), "hivtac-rig")
}

/// Runs tests of the workspace past those that fail: in the profile of the programs that they run,
/// so that dependencies are built once.
pub fn test() -> Command {
    let mut command = host_cargo("test");
    command.arg("--no-fail-fast");
    command
}

/// Whether packages of this project are linted as they are built for this computer.
static LINTING: AtomicBool = AtomicBool::new(false);

/// From here on, what is built for this computer is linted as it is built: it is checked once, and
/// what its packages depend on not for itself. A lint does not keep anything from being built;
/// [`without_warnings`] finds it.
pub fn lint_as_built() {
    LINTING.store(true, Ordering::Relaxed);
}

/// The packages that run on this computer, as cargo is told them: all of them even where one
/// program is wanted, so that what it depends on has the features with which tests build it, and is
/// built once.
const HOST: [&str; 5] = [
    "--workspace",
    "--exclude",
    "hivtac-firmware",
    "--exclude",
    "hivtac-board",
];

/// A cargo command for those packages in the profile of [`TOOLS`]. The rig's emulator declares a
/// newer compiler than it needs.
fn host_cargo(verb: &str) -> Command {
    let mut command = cargo(verb, workspace::root());
    if LINTING.load(Ordering::Relaxed) {
        toolchain::lint(&mut command);
    }
    command.args(["--profile", TOOLS, "--ignore-rust-version"]);
    command.args(HOST);
    command
}

/// What builds all programs and tests of the workspace that run on this computer, but for those of
/// [`tests_by_name`].
pub fn everything() -> Command {
    let mut command = host_cargo("build");
    command.arg("--all-targets");
    command
}

/// What builds the tests that need firmware or programs: cargo builds and runs them only by their
/// names.
pub fn tests_by_name() -> Command {
    let mut command = host_cargo("build");
    command.args(RIG_TESTS).args(ROOMS_TESTS);
    command
}

/// The rig's tests that run firmware.
pub const RIG_TESTS: [&str; 2] = ["--test", "rig"];
/// Tests that cross rooms.
pub const ROOMS_TESTS: [&str; 2] = ["--test", "rooms"];

/// Runs `cargo build`.
///
/// # Errors
/// When it fails, or warns of something, which it also does of what it built before.
pub fn without_warnings(mut command: Command) -> Result<()> {
    command.arg("--message-format=json");
    let mut warnings = 0;
    process::for_each_line(&mut command, |line| {
        if let Some((text, warns)) = said(line) {
            process::say(&text);
            warnings += usize::from(warns);
        }
    })?;
    ensure!(warnings == 0, "{warnings} warnings: see above");
    Ok(())
}

/// What the compiler says in one of cargo's messages, and whether it is a warning.
fn said(line: &str) -> Option<(String, bool)> {
    let message: serde_json::Value = serde_json::from_str(line).ok()?;
    let message = (message["reason"] == "compiler-message").then(|| &message["message"])?;
    let text = message["rendered"].as_str()?;
    Some((text.to_owned(), message["level"] == "warning"))
}

/// The sensing as a Cortex-M7 program for QEMU.
pub fn qemu_image(toolchain: &Toolchain) -> Result<PathBuf> {
    build(&mut qemu_image_command(toolchain), "hivtac-qemu-image")
}

/// What builds it.
pub fn qemu_image_command(toolchain: &Toolchain) -> Command {
    let mut command = toolchain.build(&workspace::folder("tests/qemu"));
    command.arg("--release");
    command
}

/// The plugin for QEMU that counts instructions, for a version of QEMU's plugin interface.
pub fn instruction_counter(version: u32) -> Result<PathBuf> {
    let mut command = cargo("build", &workspace::folder("xtask/instruction-counter"));
    command.arg("--release");
    if version >= 2 {
        command.args(["--features", "plugin-api-2"]);
    }
    build(&mut command, "instruction_counter")
}

/// Runs `cargo build` and gives the file it made for the target of this name.
///
/// # Errors
/// When it fails, or makes no such file.
pub fn build(command: &mut Command, target: &str) -> Result<PathBuf> {
    let [file] = build_all(command, [target])?;
    Ok(file)
}

fn build_all<const N: usize>(command: &mut Command, targets: [&str; N]) -> Result<[PathBuf; N]> {
    command.arg("--message-format=json-render-diagnostics");
    let mut files = targets.map(|_| PathBuf::new());
    process::for_each_line(command, |line| {
        for (file, target) in files.iter_mut().zip(targets) {
            if let Some(found) = artifact(line, target) {
                *file = found;
            }
        }
    })?;
    for (file, target) in files.iter().zip(targets) {
        let made = !file.as_os_str().is_empty();
        ensure!(made, "`{}` made no {target}", process::display(command));
    }
    Ok(files)
}

/// The file in one of cargo's messages, when it is the artifact of `target`.
fn artifact(line: &str, target: &str) -> Option<PathBuf> {
    let message: serde_json::Value = serde_json::from_str(line).ok()?;
    let is_artifact = message["reason"] == "compiler-artifact";
    if !is_artifact || message["target"]["name"] != target {
        return None;
    }
    let file = message["executable"]
        .as_str()
        .or_else(|| message["filenames"].get(0)?.as_str())?;
    Some(PathBuf::from(file))
}

/// Copies a file, and says which one when that fails.
pub fn copy(from: &Path, to: &Path) -> Result<()> {
    std::fs::copy(from, to)
        .with_context(|| format!("copying {} to {}", from.display(), to.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_executable_is_found_in_the_messages_of_cargo() {
        let line = concat!(
            r#"{"reason":"compiler-artifact","target":{"name":"hivtac"},"#,
            r#""filenames":["/t/hivtac"],"executable":"/t/hivtac"}"#
        );
        assert_eq!(artifact(line, "hivtac"), Some(PathBuf::from("/t/hivtac")));
        assert_eq!(artifact(line, "another"), None);
    }

    #[test]
    fn what_the_compiler_says_is_found_in_the_messages_of_cargo() {
        let line = |level: &str| {
            let message = format!(r#""message":{{"level":"{level}","rendered":"text"}}"#);
            format!(r#"{{"reason":"compiler-message",{message}}}"#)
        };
        assert_eq!(said(&line("warning")), Some(("text".to_owned(), true)));
        assert_eq!(said(&line("error")), Some(("text".to_owned(), false)));
        assert_eq!(said(r#"{"reason":"build-finished"}"#), None);
    }

    #[test]
    fn a_library_is_found_by_its_file() {
        let line = concat!(
            r#"{"reason":"compiler-artifact","target":{"name":"lib"},"#,
            r#""filenames":["/t/lib.so"],"executable":null}"#
        );
        assert_eq!(artifact(line, "lib"), Some(PathBuf::from("/t/lib.so")));
    }

    #[test]
    fn other_lines_are_passed_over() {
        for line in ["", "not json", r#"{"reason":"build-finished"}"#] {
            assert_eq!(artifact(line, "hivtac"), None);
        }
    }
}
