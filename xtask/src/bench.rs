//! `cargo xtask bench`: instructions per frame and per inference, counted in QEMU, exactly and repeatably.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::stages::{self, Stages};
use crate::toolchain::{Toolchain, cargo};
use crate::{artifacts, packages, process, workspace};

/// The case that has a limit, and that limit: portable code alone stays below it.
const REFERENCE: (&str, f64) = ("QVGA, reference", 12.0);

/// Options of `cargo xtask bench`.
#[derive(Args, Default)]
pub struct Bench {
    /// Print one JSON array instead of tables.
    #[arg(long)]
    json: bool,
}

/// One script, as `benchmark-cases` names it.
#[derive(Deserialize)]
struct Case {
    name: String,
    file: PathBuf,
    /// Pixels of its frame; 0 when it has none.
    pixels: u64,
}

/// What one script took.
#[derive(Serialize)]
struct Measured {
    name: String,
    pixels: u64,
    instructions: u64,
    stages: Stages,
}

impl Bench {
    /// Measures and prints every case.
    ///
    /// # Errors
    /// When something cannot be built or run, or the reference frame takes more than its limit.
    pub fn run(&self, toolchain: &Toolchain) -> Result<()> {
        packages::ensure_qemu()?;
        let image = artifacts::qemu_image(toolchain)?;
        let plugin = artifacts::instruction_counter(plugin_version()?)?;
        let folder = workspace::work_folder("bench")?;
        let measured = cases(&folder)?
            .iter()
            .map(|case| measure(case, &image, &plugin, &folder))
            .collect::<Result<Vec<_>>>()?;
        if self.json {
            println!("{}", serde_json::to_string_pretty(&measured)?);
        } else {
            measured.iter().for_each(Measured::print);
        }
        check(&measured)
    }
}

impl Measured {
    fn per_pixel(&self) -> f64 {
        self.instructions as f64 / self.pixels as f64
    }

    fn print(&self) {
        println!(
            "\n{}: {} instructions",
            self.name,
            grouped(self.instructions)
        );
        for stage in stages::ORDER {
            if let Some(&count) = self.stages.get(stage) {
                println!("  {stage:<24}{:>12}{}", grouped(count), self.share(count));
            }
        }
        if self.pixels > 0 {
            println!(
                "  {:<24}{:>12}{}",
                "total",
                grouped(self.instructions),
                self.share(self.instructions)
            );
        }
    }

    fn share(&self, count: u64) -> String {
        if self.pixels == 0 {
            return String::new();
        }
        format!("{:>9.3} per pixel", count as f64 / self.pixels as f64)
    }
}

fn check(measured: &[Measured]) -> Result<()> {
    let (name, limit) = REFERENCE;
    let reference = measured.iter().find(|measured| measured.name == name);
    let per_pixel = reference
        .context("the reference frame was not measured")?
        .per_pixel();
    ensure!(
        per_pixel < limit,
        "{name} takes {per_pixel:.2} instructions per pixel: the limit is {limit}"
    );
    eprintln!("\n{name}: {per_pixel:.2} instructions per pixel, below the limit of {limit}");
    Ok(())
}

fn cases(folder: &Path) -> Result<Vec<Case>> {
    let mut command = cargo("run", workspace::root());
    command.args([
        "--quiet",
        "--package",
        "hivtac-tests",
        "--bin",
        "benchmark-cases",
        "--",
    ]);
    process::show(command.arg(folder));
    let lines = process::output(&mut command)?;
    lines
        .lines()
        .map(|line| serde_json::from_str(line).with_context(|| format!("reading the case {line}")))
        .collect()
}

fn measure(case: &Case, image: &Path, plugin: &Path, folder: &Path) -> Result<Measured> {
    let log = folder.join("counts");
    let results = folder.join("results");
    process::run(&mut qemu(image, plugin, &case.file, &results, &log))?;
    let text = fs::read_to_string(&log).with_context(|| format!("reading {}", log.display()))?;
    let stages = stages::sort(image, &counts(&text)?)?;
    let instructions = stages.values().sum();
    ensure!(
        instructions > 0,
        "{}: the plugin counted nothing",
        case.name
    );
    Ok(Measured {
        name: case.name.clone(),
        pixels: case.pixels,
        instructions,
        stages,
    })
}

fn qemu(image: &Path, plugin: &Path, script: &Path, results: &Path, log: &Path) -> Command {
    let (script, results) = (script.display(), results.display());
    let mut command = Command::new("qemu-system-arm");
    command
        .args([
            "-M",
            "mps2-an500",
            "-display",
            "none",
            "-monitor",
            "none",
            "-serial",
            "none",
        ])
        .arg("-semihosting-config")
        .arg(format!(
            "enable=on,target=native,arg=hivtac-qemu-image,arg={script},arg={results}"
        ))
        .arg("-plugin")
        .arg(plugin)
        .args(["-d", "plugin", "-D"])
        .arg(log)
        .arg("-kernel")
        .arg(image);
    command
}

/// Adds up the plugin's lines: an address in hexadecimal and a count.
fn counts(text: &str) -> Result<BTreeMap<u64, u64>> {
    let mut counts = BTreeMap::new();
    for line in text.lines() {
        let parsed = line.split_once(' ').and_then(|(address, count)| {
            Some((
                u64::from_str_radix(address, 16).ok()?,
                count.parse::<u64>().ok()?,
            ))
        });
        let (address, count) =
            parsed.with_context(|| format!("the plugin printed the line `{line}`"))?;
        *counts.entry(address).or_default() += count;
    }
    Ok(counts)
}

/// The version of the plugin interface that this QEMU accepts: 1 before QEMU 9, 2 from then on.
fn plugin_version() -> Result<u32> {
    let text = process::output(Command::new("qemu-system-arm").arg("--version"))?;
    let major = major_version(&text).with_context(|| format!("no version in `{text}`"))?;
    Ok(if major < 9 { 1 } else { 2 })
}

fn major_version(text: &str) -> Option<u32> {
    let (_, version) = text.split_once("version ")?;
    version.split('.').next()?.parse().ok()
}

/// With a comma after each three digits.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_an_address_add_up() {
        let counts = counts("1a0 3\n1a2 3\n1a0 4\n").unwrap();
        assert_eq!(counts, BTreeMap::from([(0x1a0, 7), (0x1a2, 3)]));
        assert!(super::counts("no count").is_err());
    }

    #[test]
    fn the_version_of_qemu_is_found() {
        let debian = "QEMU emulator version 7.2.22 (Debian 1:7.2+dfsg-7+deb12u18+b3)\nCopyright";
        assert_eq!(major_version(debian), Some(7));
        assert_eq!(major_version("QEMU emulator version 10.0.2"), Some(10));
        assert_eq!(major_version("something else"), None);
    }

    #[test]
    fn numbers_are_grouped() {
        for (number, text) in [
            (0, "0"),
            (999, "999"),
            (1_000, "1,000"),
            (12_345_678, "12,345,678"),
        ] {
            assert_eq!(grouped(number), text);
        }
    }
}
