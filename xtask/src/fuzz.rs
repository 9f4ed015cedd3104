//! Runs the attacks of `tests/fuzz/`, some seconds each.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;

use crate::toolchain::{self, cargo};
use crate::{artifacts, process};

/// Limits of each attack: seconds in total; then seconds and MiB of memory for one input. A
/// recording and its gauge may differ by half a day, and the search of that whole range takes
/// seconds, or more while other tests run.
const LIMITS: [&str; 3] = ["-max_total_time=4", "-timeout=100", "-rss_limit_mb=2048"];
/// Compiler flags that report to libFuzzer the reached code and its comparisons. They are
/// cargo-fuzz's without a sanitizer, which needs a nightly compiler; no attacked code is `unsafe`.
const COVERAGE: &str = "--cfg=fuzzing -Cpasses=sancov-module \
    -Cllvm-args=-sanitizer-coverage-level=4 \
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters \
    -Cllvm-args=-sanitizer-coverage-pc-table \
    -Cllvm-args=-sanitizer-coverage-trace-compares";
/// Settings for packages that attacks only link: they are built quickly.
const LINKED: [&str; 2] = ["--config", "profile.tools.package.hivtac-shell.opt-level=0"];
/// The text before libFuzzer's number of tried inputs.
const TRIED: &str = "stat::number_of_executed_units:";

/// Why attacks cannot run here; `None` if they can.
pub fn obstacle() -> Option<String> {
    let has_compiler = process::find_program("c++").is_some();
    (!has_compiler).then(|| "there is no C++ compiler, which libFuzzer needs".to_owned())
}

/// Builds and runs every attack, as many at a time as there are cores. If one finds a fault, its
/// input is saved and the fault is shown.
pub fn run() -> Result<()> {
    let program = build()?;
    let corpora = toolchain::at("tests/fuzz/corpus").read_dir()?;
    let corpora: Vec<PathBuf> = corpora.flatten().map(|entry| entry.path()).collect();
    let attacks = corpora.par_iter().map(|corpus| attack(&program, corpus));
    let ended: Vec<Result<String>> = attacks.collect();
    let failed = ended.iter().filter(|end| end.is_err()).count();
    for end in ended {
        process::say(&end.unwrap_or_else(|error| format!("{error:#}")));
    }
    ensure!(failed == 0, "{failed} attacks found something: see above");
    Ok(())
}

/// Builds the program of all attacks. With a named target, build scripts are not instrumented, and
/// are shared with other tests.
fn build() -> Result<PathBuf> {
    let mut command = cargo("build --package hivtac-fuzz --profile", "");
    command.args([artifacts::TOOLS, "--target"]);
    command.arg(toolchain::rustc("--print host-tuple")?);
    command.args(LINKED).env("RUSTFLAGS", COVERAGE);
    artifacts::build(&mut command, "hivtac-fuzz")
}

/// Runs the attack of a corpus; returns the number of inputs that the attack withstood. New inputs
/// that reach further, and inputs that fail, go to `found`, not into the corpus.
fn attack(program: &Path, corpus: &Path) -> Result<String> {
    let name = corpus.file_name().unwrap_or_default().display().to_string();
    let found = toolchain::work_folder(&format!("fuzz/found/{name}"))?;
    let mut command = Command::new(program);
    command.env("HIVTAC_ATTACK", &name).arg(&found).arg(corpus);
    command.arg("-print_final_stats=1").args(LIMITS);
    let found = found.display();
    command.arg(format!("-artifact_prefix={found}/"));
    let output = command
        .output()
        .with_context(|| format!("attacking {name}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "{said}\n{name} found something: see above, and {found}"
    );
    let tried = said.lines().find_map(|line| line.strip_prefix(TRIED));
    let tried = tried.unwrap_or("?").trim();
    Ok(format!("{name}: {tried} inputs withstood"))
}
