//! `cargo xtask bench --board`: the same items from the cycle counter of a real STM32H743.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::cases;
use crate::numbers::{decimal, grouped};
use crate::toolchain::Toolchain;
use crate::{artifacts, process, workspace};

/// The core's clock, in MHz.
const CLOCK_MHZ: f64 = 480.0;
const CHIP: &str = "STM32H743VITx";
const PACKAGE: &str = "hivtac-board";

/// Builds the image, flashes it, and prints what the board says.
///
/// # Errors
/// When there is no probe-rs or no board, or the board does not end.
pub fn run(toolchain: &Toolchain) -> Result<()> {
    let image = build(toolchain)?;
    find_probe()?;
    let mut command = Command::new("probe-rs");
    command.args(["run", "--chip", CHIP]).arg(&image);
    let (mut rows, mut done) = (Vec::new(), false);
    process::for_each_line(&mut command, |line| {
        rows.extend(row(line));
        done |= line.contains("done");
    })?;
    ensure!(done, "the board stopped before it had measured everything");
    println!(
        "| item | frame | format | cycles, measured | µs at 480 MHz |\n|---|---|---|---:|---:|\n{}",
        rows.concat()
    );
    Ok(())
}

/// The image for the board; nothing has to be attached.
///
/// # Errors
/// When it cannot be built.
pub fn build(toolchain: &Toolchain) -> Result<PathBuf> {
    artifacts::build(&mut command(toolchain)?, PACKAGE)
}

/// Builds the image and lints it.
///
/// # Errors
/// When it cannot be built, or clippy complains.
pub fn lint(toolchain: &Toolchain) -> Result<()> {
    let mut command = command(toolchain)?;
    toolchain.lint(&mut command)?;
    artifacts::without_warnings(command)
}

fn command(toolchain: &Toolchain) -> Result<Command> {
    let data = workspace::work_folder("bench")?;
    cases::write(&data)?;
    let mut command = toolchain.build(workspace::root());
    command.args(["--package", PACKAGE, "--release"]);
    command.env("HIVTAC_BOARD_DATA", data);
    Ok(command)
}

fn find_probe() -> Result<()> {
    process::find_program("probe-rs").context(
        "the image is built; to run it, probe-rs is missing: `cargo install probe-rs-tools \
         --locked`",
    )?;
    let list = process::output(Command::new("probe-rs").arg("list"))?;
    ensure!(
        !list.contains("No debug probes"),
        "the image is built; to run it, connect an STM32H743 board by a debug probe: `probe-rs \
         list` sees none"
    );
    Ok(())
}

/// `frame full|320x240|rgb565|200000`, whatever stands around it.
fn row(line: &str) -> Option<String> {
    let words: Vec<&str> = line.trim().split('|').collect();
    let [item, frame, format, cycles] = words[..] else {
        return None;
    };
    let cycles: u64 = cycles.split_whitespace().next()?.parse().ok()?;
    let time = decimal((cycles as f64 / CLOCK_MHZ * 10.0).round() / 10.0);
    let cycles = grouped(cycles);
    Some(format!(
        "| {item} | {frame} | {format} | {cycles} | {time} |\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_board_says_becomes_a_row() {
        assert_eq!(
            row("frame full, 5 % salt|320x240|rgb565|96000\n").as_deref(),
            Some("| frame full, 5 % salt | 320x240 | rgb565 | 96,000 | 200 |\n")
        );
        assert_eq!(row("Finished in 1.2s"), None);
    }
}
