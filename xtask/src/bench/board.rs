//! `cargo xtask bench --board`: measures the same items with the cycle counter of a real STM32H743.

use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::cases;
use crate::artifacts::{self, Board};
use crate::{process, toolchain};

/// The image, an example of the firmware.
const EXAMPLE: &str = "benchmark";

/// Builds the image, flashes it, and prints the board's output.
pub fn run() -> Result<()> {
    let image = artifacts::build(&mut command()?, EXAMPLE)?;
    let list = process::output(&mut process::command("probe-rs list"));
    let list = list.context("the image is built; to run it: `cargo install probe-rs-tools`")?;
    let is_there = !list.contains("No debug probes");
    ensure!(
        is_there,
        "the image is built; to run it, connect an STM32H743 by a debug probe"
    );
    let mut command = process::command("probe-rs run --chip STM32H743VITx");
    let mut done = false;
    println!("item|frame|format|cycles, measured");
    process::for_each_line(command.arg(&image), |line| {
        println!("{line}");
        done |= line.contains("done");
    })?;
    ensure!(done, "the board stopped before it had measured everything");
    Ok(())
}

/// Builds the image and lints it, without a board.
pub fn lint() -> Result<()> {
    let mut command = command()?;
    toolchain::lint(&mut command);
    artifacts::without_warnings(command)
}

fn command() -> Result<Command> {
    let data = toolchain::work_folder("bench")?;
    cases(&data)?;
    let mut command = artifacts::firmware_command(Board::Weact, "");
    command.env("HIVTAC_BOARD_DATA", data);
    command.args(["--example", EXAMPLE]);
    Ok(command)
}
