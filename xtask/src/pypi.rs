//! Environments of Python with packages of PyPI, for tests that are written in it.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

use crate::report::Tally;
use crate::{process, workspace};

/// An environment with these packages.
pub struct Environment {
    /// Its folder below `target/`.
    pub folder: &'static str,
    /// What is imported of it.
    pub modules: &'static str,
    /// The packages as pip knows them.
    pub packages: &'static [&'static str],
    /// The oldest Python that they are for.
    pub oldest: (u8, u8),
    /// What keeps them from being installed.
    pub missing: &'static str,
    /// What keeps it from being made.
    pub too_old: &'static str,
}

impl Environment {
    /// Makes it when it is not there; says what keeps it from that.
    pub fn obstacle(&self) -> Option<&'static str> {
        let (major, minor) = self.oldest;
        let is_new = format!("import sys; assert sys.version_info >= ({major}, {minor})");
        let succeeds = |code: &str| process::succeeds(Command::new("python3").args(["-c", code]));
        if !succeeds(&is_new) {
            return Some(self.too_old);
        }
        if !succeeds("import venv, ensurepip") {
            return Some("python3 has no venv: install the package python3-venv");
        }
        self.python().err().map(|error| {
            eprintln!("{error:#}");
            self.missing
        })
    }

    /// Where it lies.
    pub fn folder(&self) -> PathBuf {
        workspace::folder("target").join(self.folder)
    }

    /// Its Python, with the packages.
    ///
    /// # Errors
    /// When they cannot be installed.
    pub fn python(&self) -> Result<PathBuf> {
        let python = self.folder().join("bin/python");
        let import = format!("import {}", self.modules);
        if !process::succeeds(Command::new(&python).args(["-c", &import])) {
            let mut venv = Command::new("python3");
            process::run(venv.args(["-m", "venv", "--clear"]).arg(self.folder()))?;
            process::run(pip(&python).args(self.packages))?;
        }
        Ok(python)
    }
}

/// `pip install`, without a word.
pub fn pip(python: &Path) -> Command {
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

/// Runs tests, shows all they print, and counts them.
///
/// # Errors
/// When one fails, or none was run.
pub fn run_tests(command: &mut Command, tally: &mut Tally) -> Result<()> {
    process::for_each_line(command, |line| {
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
