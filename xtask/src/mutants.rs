//! `cargo xtask mutants`: puts small mistakes into the firmware, one at a time, and lists those
//! that no test notices.
//!
//! cargo-mutants makes mistakes in the package that runs on a computer, and runs its tests.
//! `tests/mutants/firmware.json` lists mistakes in code for the microcontroller, each with rig
//! tests that must notice it. Both are made in a copy of the project.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::Deserialize;

use crate::artifacts::{self, Board, RIG_TESTS};
use crate::process;
use crate::toolchain::{self, cargo, work_folder};

/// The mistakes in code for the microcontroller.
const LIST: &str = "tests/mutants/firmware.json";
/// The settings of cargo-mutants, with the mistakes that change nothing.
const PORTABLE: &str = "tests/mutants/portable.toml";
/// Copies the files that git knows as they are now, also changes that are not committed.
const COPY: &str = r#"now=$(git stash create) && git archive "${now:-HEAD}" | tar x -C "$0""#;

/// Options of `cargo xtask mutants`.
#[derive(Args)]
pub struct Mutants {
    /// Only those of the list, in files whose paths contain this.
    files: Option<String>,
}

/// A mistake in a file.
#[derive(Deserialize)]
struct Mutant {
    file: String,
    /// Text that the file has once.
    from: String,
    to: String,
    /// Names of rig tests; at least one must fail.
    tests: Vec<String>,
    /// Why none of them fails; empty if one must.
    #[serde(default)]
    survives: String,
}

impl Mutants {
    /// Makes the mistakes; an error if one is not noticed for which no reason is known.
    pub fn run(&self) -> Result<()> {
        let portable = self.files.is_none().then(portable);
        self.firmware().and(portable.unwrap_or(Ok(())))
    }

    fn firmware(&self) -> Result<()> {
        let files = self.files.as_deref().unwrap_or("");
        let mut mutants = list()?;
        mutants.retain(|mutant| mutant.file.contains(files));
        ensure!(
            !mutants.is_empty(),
            "no mistake in {LIST} is in a file whose path contains {files:?}"
        );
        let bench = Bench::new()?;
        let passes = bench.passes(mutants.iter().flat_map(|mutant| &mutant.tests))?;
        ensure!(passes, "a test fails without a mistake: see above");
        let (mut noticed, mut unexplained) = (0, 0);
        for mutant in &mutants {
            let (result, count) = match bench.survives(mutant) {
                Ok(false) => ("noticed", Some(&mut noticed)),
                Ok(true) if !mutant.survives.is_empty() => (mutant.survives.as_str(), None),
                Ok(true) => ("NOT NOTICED", Some(&mut unexplained)),
                Err(_) => ("DOES NOT COMPILE", Some(&mut unexplained)),
            };
            println!("{}: {:?}: {result}", mutant.file, mutant.to);
            count.into_iter().for_each(|count| *count += 1);
        }
        println!("{noticed} of {} mistakes noticed", mutants.len());
        ensure!(unexplained == 0, "{unexplained} are not noticed: see above");
        Ok(())
    }
}

fn portable() -> Result<()> {
    ensure!(
        toolchain::has("mutants"),
        "cargo-mutants is not installed: `cargo install cargo-mutants --locked`"
    );
    let words = "mutants --package hivtac-portable --colors never --config";
    let mut command = cargo(words, "");
    command.args([PORTABLE, "--output"]);
    process::run(command.arg(work_folder("mutants")?))
}

fn list() -> Result<Vec<Mutant>> {
    let text = process::read(&toolchain::at(LIST))?;
    serde_json::from_str(&text).with_context(|| LIST.to_owned())
}

/// A copy of the project in which mistakes are made, and the rig's tests.
struct Bench {
    copy: tempfile::TempDir,
    tests: PathBuf,
}

impl Bench {
    fn new() -> Result<Bench> {
        // As `cargo xtask test` builds the tests, so that they are not built anew.
        if toolchain::has("clippy") {
            artifacts::lint_as_built();
        }
        let copy = tempfile::tempdir()?;
        let mut shell = Command::new("sh");
        shell.current_dir(toolchain::at("")).args(["-c", COPY]);
        process::run(shell.arg(copy.path()))?;
        let tests = artifacts::build(artifacts::test(&RIG_TESTS).arg("--no-run"), "rig")?;
        Ok(Bench { copy, tests })
    }

    /// Builds the copy's firmware; returns whether it passes these rig tests.
    fn passes<'t>(&self, tests: impl Iterator<Item = &'t String>) -> Result<bool> {
        let mut build = artifacts::firmware_command(Board::Weact, "");
        build.current_dir(self.copy.path()).arg("--target-dir");
        build.arg(work_folder("mutants/target")?);
        let elf = artifacts::build(&mut build, "hivtac-firmware")?;
        let mut command = Command::new(&self.tests);
        command.args(["--include-ignored", "--exact"]);
        command.args(tests.collect::<BTreeSet<_>>());
        command.env("HIVTAC_ELF", elf);
        command.env("HIVTAC_BUG_ELFS", work_folder("bugs")?);
        command.current_dir(toolchain::at("twin/rig"));
        Ok(process::run(&mut command).is_ok())
    }

    /// Makes a mistake, and takes it back.
    fn survives(&self, mutant: &Mutant) -> Result<bool> {
        let file = self.copy.path().join(&mutant.file);
        let right = process::read(&file)?;
        process::write(&file, &right.replacen(&mutant.from, &mutant.to, 1))?;
        let passes = self.passes(mutant.tests.iter());
        process::write(&file, &right)?;
        passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_mistake_can_be_made_and_has_tests() {
        for mutant in list().unwrap() {
            let text = process::read(&toolchain::at(&mutant.file)).unwrap();
            assert_eq!(text.matches(&mutant.from).count(), 1, "{}", mutant.from);
            assert!(mutant.from != mutant.to && !mutant.tests.is_empty());
            for test in mutant.tests {
                let (file, name) = test.split_once("::").unwrap();
                let file = toolchain::at(&format!("twin/rig/tests/{file}.rs"));
                let text = process::read(&file).unwrap();
                assert!(text.contains(&format!("fn {name}()")), "{test}");
            }
        }
    }
}
