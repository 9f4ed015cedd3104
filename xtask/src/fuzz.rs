//! The attacks of `tests/fuzz/`, some seconds each.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::thread;

use anyhow::{Context, Result, anyhow, ensure};

use crate::toolchain::{self, cargo};
use crate::{artifacts, process, workspace};

/// Seconds of each attack.
const SECONDS: u32 = 10;
/// What one input may take: seconds, and MiB of memory. A recording and its gauge may differ by
/// half a day, all of which is searched: that takes seconds, and more beside other tests.
const LIMITS: [&str; 2] = ["-timeout=100", "-rss_limit_mb=2048"];
/// What has the compiler tell libFuzzer which parts of a program an input reaches, and what it
/// compares: as cargo-fuzz does it without a sanitizer, which only a nightly compiler has; no
/// attacked code is `unsafe`.
const COVERAGE: [&str; 6] = [
    "--cfg=fuzzing",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
];
/// What libFuzzer writes before the number of inputs that it tried.
const TRIED: &str = "stat::number_of_executed_units:";

/// Why there can be no attacks here; nothing when there can.
pub fn obstacle() -> Option<&'static str> {
    let has_compiler = process::find_program("c++").is_some();
    (!has_compiler).then_some("there is no C++ compiler, which libFuzzer needs")
}

/// Builds and runs every attack, as many at a time as there are cores.
///
/// # Errors
/// When one finds something: its input was saved, and what it met was shown.
pub fn run() -> Result<()> {
    let programs = build()?;
    let targets = targets()?;
    let waiting = Mutex::new(targets.iter());
    let next = || waiting.lock().ok()?.next();
    let run_all = || -> Vec<Result<String>> {
        std::iter::from_fn(next)
            .map(|target| attack(&programs, target))
            .collect()
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let ended: Vec<Result<String>> = thread::scope(|scope| {
        let runs: Vec<_> = (0..cores).map(|_| scope.spawn(run_all)).collect();
        let panicked = |_| vec![Err(anyhow!("an attack's thread panicked"))];
        runs.into_iter()
            .flat_map(|run| run.join().unwrap_or_else(panicked))
            .collect()
    });
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
    let host = toolchain::host()?;
    let mut command = cargo("build", workspace::root());
    command.args(["--profile", artifacts::TOOLS, "--target", &host]);
    command.args(["--package", "hivtac-fuzz", "--bins"]);
    command.env("RUSTFLAGS", COVERAGE.join(" "));
    let program = artifacts::build(&mut command, "model")?;
    Ok(program.parent().context("it lies in a folder")?.to_owned())
}

/// Names of the targets.
fn targets() -> Result<Vec<String>> {
    let folder = workspace::folder("tests/fuzz/targets");
    let entries = folder.read_dir().context("reading tests/fuzz/targets")?;
    let mut names = Vec::new();
    for entry in entries {
        let path = entry.context("reading tests/fuzz/targets")?.path();
        names.extend(path.file_stem().map(|stem| stem.display().to_string()));
    }
    names.sort();
    Ok(names)
}

/// Runs one; gives how many inputs the target withstood.
fn attack(programs: &Path, target: &str) -> Result<String> {
    let found = workspace::work_folder(&format!("fuzz/found/{target}"))?;
    let output = command(programs, target, &found)
        .output()
        .with_context(|| format!("attacking {target}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "{said}\n{target} found something: see above, and {}",
        found.display()
    );
    let tried = said.split_once(TRIED).map(|(_, rest)| rest);
    let tried = tried.and_then(|rest| rest.lines().next()).unwrap_or("?");
    Ok(format!("{target}: {} inputs withstood", tried.trim()))
}

/// New inputs that reach further go to `found`, not into the corpus, and so does what fails.
fn command(programs: &Path, target: &str, found: &Path) -> Command {
    let mut command = Command::new(programs.join(target));
    command.arg(found);
    command.arg(workspace::folder("tests/fuzz/corpus").join(target));
    command.arg("-print_final_stats=1").args(LIMITS);
    command.arg(format!("-artifact_prefix={}/", found.display()));
    command.arg(format!("-max_total_time={SECONDS}"));
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_is_found() {
        let targets = targets().unwrap();
        assert!(targets.contains(&"model".to_owned()), "{targets:?}");
    }
}
