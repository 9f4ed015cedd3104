//! `cargo xtask bench`: counts the instructions of a frame and of an inference on the
//! microcontroller, in QEMU, exactly and repeatably.

pub mod board;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::{artifacts, packages, process, toolchain};

const BASELINE: &str = "xtask/baseline.json";

/// Options of `cargo xtask bench`.
#[derive(Args, Default)]
pub struct Bench {
    /// Make this measurement the baseline for later counts.
    #[arg(long)]
    write_baseline: bool,
    /// Count on a Cortex-M55 instead, for which there is no baseline.
    #[arg(long, conflicts_with = "write_baseline")]
    m55: bool,
    /// Measure on an STM32H743 that is attached by a debug probe instead.
    #[arg(long, conflicts_with_all = ["write_baseline", "m55"])]
    board: bool,
}

impl Bench {
    /// Counts and prints every case, and compares the counts with the baseline.
    pub fn run(&self) -> Result<()> {
        if self.board {
            return board::run();
        }
        packages::ensure("qemu-system-arm", "qemu-system-arm")?;
        let folder = toolchain::work_folder("bench")?;
        let plugin = artifacts::instruction_counter(plugin_version()?)?;
        // QEMU's name of a machine, the clock of its core on the sensor's board, and the image.
        let (machine, clock_mhz, image) = match self.m55 {
            false => ("mps2-an500", 480, artifacts::qemu_image()?),
            true => ("mps3-an547", 800, artifacts::m55_image()?),
        };
        let mut instructions = BTreeMap::new();
        for case in cases(&folder)? {
            let log = folder.join("counts");
            let mut qemu = qemu(machine, &image, &case.file, &folder.join("results"));
            process::output(qemu.arg("-plugin").arg(&plugin).arg("-D").arg(&log))?;
            // Before the last band of rows is there, and from then on.
            let [before, last_band]: [u64; 2] = serde_json::from_str(&process::read(&log)?)?;
            if let Some(name) = case.name.strip_prefix("frame full") {
                instructions.insert(format!("latency{name}"), last_band);
            }
            instructions.insert(case.name, before + last_band);
        }
        process::print(&table(&instructions, clock_mhz));
        if self.m55 {
            return Ok(());
        }
        let baseline = toolchain::at(BASELINE);
        let now = Baseline {
            compiler: toolchain::target_compiler()?,
            instructions,
        };
        if self.write_baseline {
            let text = serde_json::to_string_pretty(&now)? + "\n";
            return process::write(&baseline, &text);
        }
        let committed: Baseline = serde_json::from_str(&process::read(&baseline)?)?;
        committed.check(&now)
    }
}

/// One script, as described by `benchmark-cases` (in `tests`).
#[derive(Deserialize)]
struct Case {
    /// The item, with its frame's size and format. A whole frame begins with `frame full`.
    name: String,
    file: PathBuf,
}

/// Writes all scripts into a folder; returns their cases.
fn cases(folder: &Path) -> Result<Vec<Case>> {
    let mut command = Command::new(artifacts::host_program("benchmark-cases")?);
    let lines = process::output(command.current_dir(toolchain::at("")).arg(folder))?;
    let cases: Result<_, _> = lines.lines().map(serde_json::from_str).collect();
    cases.context("what benchmark-cases says")
}

/// The emulator's command for a script, whose results go to another file.
fn qemu(machine: &str, image: &Path, script: &Path, results: &Path) -> Command {
    let words = "qemu-system-arm -display none -monitor none -serial none -d plugin -M";
    let mut qemu = process::command(words);
    let (script, results) = (script.display(), results.display());
    let arguments = format!("arg=hivtac-qemu-image,arg={script},arg={results}");
    qemu.args([machine, "-semihosting-config"]);
    qemu.arg(format!("enable=on,target=native,{arguments}"));
    qemu.arg("-kernel").arg(image);
    qemu
}

/// The plugin interface's version that this QEMU accepts: 1 before QEMU 9, 2 from then on.
fn plugin_version() -> Result<u32> {
    let text = process::output(&mut process::command("qemu-system-arm --version"))?;
    // `QEMU emulator version 7.2.22 (Debian …`
    let version = text
        .split_once("version ")
        .and_then(|(_, rest)| rest.split('.').next());
    let major: u32 = version.context("no version of QEMU")?.parse()?;
    Ok(if major < 9 { 1 } else { 2 })
}

/// The table of all counts, with the time of a core that issues one instruction a cycle.
fn table(instructions: &BTreeMap<String, u64>, clock_mhz: u32) -> String {
    let rows = instructions.iter().map(|(name, count)| {
        let time_us = *count as f64 / f64::from(clock_mhz);
        format!("| {name} | {} | {time_us:.1} |\n", grouped(*count))
    });
    let head =
        format!("| item | instructions | µs at {clock_mhz} MHz, one a cycle |\n|---|---:|---:|\n");
    head + &rows.collect::<String>()
}

/// A number with a comma after each three digits.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let parts = digits.as_bytes().rchunks(3).rev();
    let parts: Vec<_> = parts.map(String::from_utf8_lossy).collect();
    parts.join(",")
}

/// Measured counts, with the compiler that built the image.
#[derive(Debug, Serialize, Deserialize)]
struct Baseline {
    /// The output of `rustc -V`.
    compiler: String,
    /// Instructions, by the item's name.
    instructions: BTreeMap<String, u64>,
}

impl Baseline {
    /// Compares new counts with this committed baseline, and prints every difference.
    fn check(&self, now: &Baseline) -> Result<()> {
        let labels = self.instructions.keys().chain(now.instructions.keys());
        let mut changes = 0;
        for label in labels.collect::<BTreeSet<_>>() {
            let [was, is] = [self, now].map(|it| it.instructions.get(label));
            if was != is {
                changes += 1;
                process::say(&format!("{label}: {was:?} → {is:?} instructions"));
            }
        }
        let all = now.instructions.len();
        let what = format!("{changes} of {all} instruction counts differ from the baseline's");
        if self.compiler != now.compiler {
            let (this, that) = (&now.compiler, &self.compiler);
            process::say(&format!("{what}: that is for {that}, this is {this}"));
            return Ok(());
        }
        ensure!(
            changes == 0,
            "{what}; when they are meant to, `cargo xtask bench --write-baseline` and commit it"
        );
        process::say(&what);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_instruction_or_item_more_or_less_is_refused_of_the_same_compiler() {
        let baseline = |compiler: &str, counts: &[(&str, u64)]| Baseline {
            compiler: compiler.to_owned(),
            instructions: counts
                .iter()
                .map(|(label, count)| ((*label).into(), *count))
                .collect(),
        };
        let committed = baseline("rustc 1", &[("blobs", 100)]);
        assert!(committed.check(&committed).is_ok());
        let two = [("blobs", 100), ("mac", 1)];
        for counts in [&[("blobs", 99)][..], &[("blobs", 101)], &two, &[]] {
            assert!(committed.check(&baseline("rustc 1", counts)).is_err());
            assert!(committed.check(&baseline("rustc 2", counts)).is_ok());
        }
    }
}
