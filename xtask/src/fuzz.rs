//! The attacks of `tests/fuzz/`, some seconds each.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

use crate::toolchain::{self, cargo};
use crate::{artifacts, process};

/// Limits of each attack: seconds in all, and seconds and MiB of memory of one input. A recording
/// and its gauge may differ by half a day, all of which is searched: that takes seconds, and more
/// beside other tests.
const LIMITS: [&str; 3] = ["-max_total_time=10", "-timeout=100", "-rss_limit_mb=2048"];
/// What has the compiler tell libFuzzer which parts of a program an input reaches, and what it
/// compares: as cargo-fuzz does it without a sanitizer, which only a nightly compiler has; no
/// attacked code is `unsafe`.
const COVERAGE: &str = "--cfg=fuzzing -Cpasses=sancov-module \
    -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
    -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares";
/// What libFuzzer writes before the number of inputs that it tried.
const TRIED: &str = "stat::number_of_executed_units:";

/// Why there can be no attacks here; nothing when there can.
pub fn obstacle() -> Option<&'static str> {
    let has_compiler = process::find_program("c++").is_some();
    (!has_compiler).then_some("there is no C++ compiler, which libFuzzer needs")
}

/// Builds and runs every attack, as many at a time as there are cores. When one finds something,
/// its input is saved, and what it met is shown.
pub fn run() -> Result<()> {
    let programs = build()?;
    let attacks = targets()?.into_par_iter();
    let ended: Vec<_> = attacks.map(|target| attack(&programs, &target)).collect();
    let mut failed = 0;
    for end in ended {
        process::say(&end.unwrap_or_else(|error| {
            failed += 1;
            format!("{error:#}")
        }));
    }
    ensure!(failed == 0, "{failed} attacks found something: see above");
    Ok(())
}

/// Gives the folder of the programs. They are for a named target, so that what is built to run
/// while building is not attacked, and is that of the other tests.
fn build() -> Result<PathBuf> {
    let mut command = cargo("build --package hivtac-fuzz --bins --profile", "");
    command.args([
        artifacts::TOOLS,
        "--target",
        &toolchain::rustc("--print host-tuple")?,
    ]);
    let program = artifacts::build(command.env("RUSTFLAGS", COVERAGE), "model")?;
    Ok(program.with_file_name(""))
}

/// Names of the targets.
fn targets() -> Result<Vec<String>> {
    let folder = toolchain::at("tests/fuzz/targets").read_dir();
    let paths = folder.context("reading tests/fuzz/targets")?.flatten();
    let name = |path: PathBuf| Some(path.file_stem()?.display().to_string());
    let mut names: Vec<_> = paths.filter_map(|entry| name(entry.path())).collect();
    names.sort();
    Ok(names)
}

/// Runs one; gives how many inputs the target withstood. New inputs that reach further go to
/// `found`, not into the corpus, and so does what fails.
fn attack(programs: &Path, target: &str) -> Result<String> {
    let found = toolchain::work_folder(&format!("fuzz/found/{target}"))?;
    let mut command = Command::new(programs.join(target));
    command
        .arg(&found)
        .arg(toolchain::at("tests/fuzz/corpus").join(target));
    command.arg("-print_final_stats=1").args(LIMITS);
    command.arg(format!("-artifact_prefix={}/", found.display()));
    let output = command
        .output()
        .with_context(|| format!("attacking {target}"))?;
    let (said, found) = (String::from_utf8_lossy(&output.stderr), found.display());
    let is_well = output.status.success();
    ensure!(
        is_well,
        "{said}\n{target} found something: see above, and {found}"
    );
    let tried = said.lines().find_map(|line| line.strip_prefix(TRIED));
    Ok(format!(
        "{target}: {} inputs withstood",
        tried.unwrap_or("?").trim()
    ))
}
