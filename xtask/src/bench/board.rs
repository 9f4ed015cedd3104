//! `cargo xtask bench --board`: measures the same items with the cycle counter of a real STM32H743.

use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::{CLOCK_MHZ, cases};
use crate::artifacts::{self, Board};
use crate::size::grouped;
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
    let (mut rows, mut done) = (String::new(), false);
    process::for_each_line(command.arg(&image), |line| {
        rows.extend(row(line));
        done |= line.contains("done");
    })?;
    ensure!(done, "the board stopped before it had measured everything");
    println!("| item | frame | format | cycles, measured | µs at 480 MHz |");
    println!("|---|---|---|---:|---:|\n{rows}");
    Ok(())
}

/// Builds the image and lints it, without a board.
pub fn lint() -> Result<()> {
    let mut command = command()?;
    toolchain::lint_for_target(&mut command)?;
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

/// Finds a row such as `frame full|320x240|rgb565|200000` in a line.
fn row(line: &str) -> Option<String> {
    let words: Vec<&str> = line.trim().split('|').collect();
    let [item, frame, format, cycles] = words[..] else {
        return None;
    };
    let cycles: u64 = cycles.split_whitespace().next()?.parse().ok()?;
    let (cycles, time) = (grouped(cycles), cycles as f64 / CLOCK_MHZ);
    Some(format!(
        "| {item} | {frame} | {format} | {cycles} | {time:.1} |\n"
    ))
}

#[cfg(test)]
mod tests {
    use super::row;

    #[test]
    fn what_the_board_says_becomes_a_row() {
        let line = "frame full, 5 % salt|320x240|rgb565|96000\n";
        let expected = "| frame full, 5 % salt | 320x240 | rgb565 | 96,000 | 200.0 |\n";
        assert_eq!(row(line).as_deref(), Some(expected));
        assert_eq!(row("Finished in 1.2s"), None);
    }
}
