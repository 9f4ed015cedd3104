//! The attacks of `fuzz/`, some seconds each, where cargo-fuzz is installed.

use std::path::Path;
use std::process::Command;
use std::sync::Mutex;
use std::thread;

use anyhow::{Context, Result, bail};

use crate::toolchain::cargo;
use crate::{process, workspace};

/// Seconds of each attack.
const SECONDS: u32 = 10;
/// What one input may take: seconds, and MiB of memory.
const LIMITS: [&str; 2] = ["-timeout=10", "-rss_limit_mb=2048"];
/// What libFuzzer writes before the number of inputs that it tried.
const TRIED: &str = "stat::number_of_executed_units:";

/// Why there can be no attacks here; nothing when there can.
pub fn obstacle() -> Option<&'static str> {
    let has_cargo_fuzz = || process::succeeds(cargo("fuzz", workspace::root()).arg("--version"));
    if process::find_program("c++").is_none() {
        Some("there is no C++ compiler, which libFuzzer needs")
    } else if !has_cargo_fuzz() {
        Some("cargo-fuzz is not installed: `cargo install cargo-fuzz`")
    } else {
        None
    }
}

/// Builds and runs every attack, as many at a time as there are cores.
///
/// # Errors
/// When one finds something: its input was saved, and what it met was shown.
pub fn run() -> Result<()> {
    process::run(&mut cargo_fuzz("build"))?;
    let targets = targets()?;
    let waiting = Mutex::new(targets.iter());
    let next = || waiting.lock().ok()?.next();
    let run_all = || -> Result<()> {
        while let Some(target) = next() {
            attack(target)?;
        }
        Ok(())
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        let runs: Vec<_> = (0..cores).map(|_| scope.spawn(run_all)).collect();
        let ended = runs.into_iter().map(thread::ScopedJoinHandle::join);
        let ended = ended.map(|end| end.unwrap_or_else(|_| bail!("an attack's thread panicked")));
        // All of them, whatever becomes of one.
        ended.collect::<Vec<_>>().into_iter().collect()
    })
}

/// Without a sanitizer, which only a nightly compiler has: no attacked code is `unsafe`.
fn cargo_fuzz(verb: &str) -> Command {
    let mut command = cargo("fuzz", workspace::root());
    command.args([verb, "--sanitizer", "none"]);
    command
}

/// Names of the targets.
fn targets() -> Result<Vec<String>> {
    let folder = workspace::folder("fuzz/targets");
    let entries = folder.read_dir().context("reading fuzz/targets")?;
    let mut names = Vec::new();
    for entry in entries {
        let path = entry.context("reading fuzz/targets")?.path();
        names.extend(path.file_stem().map(|stem| stem.display().to_string()));
    }
    names.sort();
    Ok(names)
}

fn attack(target: &str) -> Result<()> {
    let found = workspace::work_folder(&format!("fuzz/{target}"))?;
    let output = command(target, &found)
        .output()
        .with_context(|| format!("attacking {target}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        eprintln!("{said}");
        bail!("{target} found something: see above, and fuzz/artifacts/{target}");
    }
    let tried = said.split_once(TRIED).map(|(_, rest)| rest);
    let tried = tried.and_then(|rest| rest.lines().next()).unwrap_or("?");
    eprintln!("{target}: {} inputs withstood", tried.trim());
    Ok(())
}

/// New inputs that reach further go to `found`, not into the corpus.
fn command(target: &str, found: &Path) -> Command {
    let mut command = cargo_fuzz("run");
    command.arg(target).arg(found);
    command.arg(workspace::folder("fuzz/corpus").join(target));
    command.args(["--", "-print_final_stats=1"]).args(LIMITS);
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
