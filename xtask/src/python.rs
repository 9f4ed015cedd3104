//! Python's `hivtac`: built by pip into an environment of its own, and tested on the rig.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

use crate::report::Tally;
use crate::{artifacts, process, workspace};

/// Why it cannot be tested here; nothing when it can.
pub fn obstacle() -> Option<&'static str> {
    let mut python = Command::new("python3");
    if !process::succeeds(python.args(["-c", "import sys; assert sys.version_info >= (3, 9)"])) {
        return Some("there is no python3 of version 3.9 or newer");
    }
    let mut venv = Command::new("python3");
    if !process::succeeds(venv.args(["-c", "import venv, ensurepip"])) {
        return Some("python3 has no venv: install the package python3-venv");
    }
    environment().err().map(|error| {
        eprintln!("{error:#}");
        "pip cannot install maturin, mypy and numpy: is PyPI within reach?"
    })
}

fn folder() -> PathBuf {
    workspace::folder("target/python")
}

/// The Python of an environment that has what building and testing need.
fn environment() -> Result<PathBuf> {
    let python = folder().join("bin/python");
    if !process::succeeds(Command::new(&python).args(["-c", "import maturin, mypy, numpy"])) {
        let mut venv = Command::new("python3");
        process::run(venv.args(["-m", "venv", "--clear"]).arg(folder()))?;
        process::run(pip(&python).args(["maturin>=1.9,<2", "mypy", "numpy"]))?;
    }
    Ok(python)
}

fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args([
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ]);
    command
}

/// Installs the package as a user does, but in the profile of the other tests' programs, and runs
/// its tests on the firmware in the rig; its annotations are checked, too.
///
/// # Errors
/// When it cannot be built, an annotation is wrong, or a test fails.
pub fn test(firmware: &Path, tally: &mut Tally) -> Result<()> {
    let python = environment()?;
    let mut install = pip(&python);
    // Where maturin is found by its build backend.
    let path = std::env::var("PATH").unwrap_or_default();
    install.env("PATH", format!("{}:{path}", folder().join("bin").display()));
    install.args([
        "--no-build-isolation",
        "--force-reinstall",
        "--no-deps",
        "./python",
    ]);
    install.env("MATURIN_PEP517_ARGS", "--profile tools");
    process::run(install.current_dir(workspace::root()))?;
    let mut types = Command::new(&python);
    types.args([
        "-m",
        "mypy",
        "--strict",
        "--cache-dir",
        "target/mypy",
        "python/hivtac",
    ]);
    process::run(types.current_dir(workspace::root()))?;
    let mut command = Command::new(&python);
    command
        .args(["-W", "error", "python/tests/test_hivtac.py"])
        .current_dir(workspace::root())
        .env("HIVTAC_ELF", firmware)
        .env("HIVTAC_TOOL", artifacts::host_tool()?)
        .env("HIVTAC_RIG", artifacts::rig()?);
    process::for_each_line(&mut command, |line| {
        process::print_through(line);
        count(line, tally);
    })?;
    ensure!(tally.passed > 0, "no test was run");
    Ok(())
}

/// Adds what a line of a verbose unittest says, if it says how a test ended.
fn count(line: &str, tally: &mut Tally) {
    match line.trim_end().rsplit_once(" ... ") {
        Some((_, "ok")) => tally.passed += 1,
        Some((_, "FAIL" | "ERROR")) => tally.failed += 1,
        _ => (),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_are_counted_by_how_they_ended() {
        let mut tally = Tally::default();
        let said = "test_a (t.T.test_a) ... ok\ntest_b (t.T.test_b) ... ERROR\n\
                    test_c (t.T.test_c) ... FAIL\ntest_d (t.T.test_d) ... ok\n\nRan 4 tests\n";
        said.lines().for_each(|line| count(line, &mut tally));
        assert_eq!((tally.passed, tally.failed), (2, 2));
    }
}
