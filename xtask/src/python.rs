//! Runs the tests in Python, each file in its own environment with packages of PyPI.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use clap::Args;

use crate::artifacts::{self, Board};
use crate::report::{Tally, run_tests};
use crate::{process, toolchain};

/// A file of tests, whose environment has the packages that its head names.
pub struct Tests {
    file: &'static str,
    /// The project's own packages that are installed, too.
    installed: &'static [&'static str],
    /// Python's action on warnings.
    warnings: &'static str,
    run_on: RunOn,
}

/// Programs that the tests need in addition to the host tool.
enum RunOn {
    /// The simulated sensor of the tool.
    Tool,
    /// That, by a tool with everything that `hivtac serve` can do.
    Server,
    /// The firmware in the rig.
    Rig,
    /// The firmware in the rig, by that tool.
    RigByServer,
}

/// The folder of Python's `hivtac`.
const HIVTAC: &str = "./host-tool/python";

pub const PACKAGE: Tests = Tests {
    file: "host-tool/python/tests/test_hivtac.py",
    installed: &[HIVTAC],
    warnings: "error",
    run_on: RunOn::Rig,
};
pub const SERVE: Tests = Tests {
    file: "tests/python/test_serve.py",
    installed: &[],
    warnings: "error",
    run_on: RunOn::RigByServer,
};
pub const ZENOH: Tests = Tests {
    file: "tests/python/test_zenoh.py",
    installed: &[],
    warnings: "default",
    run_on: RunOn::Server,
};
pub const LEROBOT: Tests = Tests {
    file: "tests/python/test_lerobot.py",
    installed: &[HIVTAC, "./host-tool/lerobot"],
    warnings: "default",
    run_on: RunOn::Tool,
};
pub const RERUN: Tests = Tests {
    file: "tests/python/test_rerun.py",
    installed: &[HIVTAC],
    warnings: "default",
    run_on: RunOn::Tool,
};
pub const MUJOCO: Tests = Tests {
    file: "tests/python/test_twin.py",
    installed: &[HIVTAC],
    warnings: "error",
    run_on: RunOn::Tool,
};
pub const KIT: Tests = Tests {
    file: "tests/python/test_kit.py",
    installed: &[],
    warnings: "error::UserWarning",
    run_on: RunOn::Tool,
};

impl Tests {
    /// Makes the environment if missing; returns the obstacle, if there is one.
    pub fn obstacle(&self) -> Option<String> {
        let error = self.environment().err()?;
        process::say(&format!("{error:#}"));
        Some(format!(
            "pip cannot install the packages: is there python3 with venv (package python3-venv), \
             and PyPI within reach? What they need is in the head of {}",
            self.file
        ))
    }

    fn environment(&self) -> Result<PathBuf> {
        let file = toolchain::at(self.file);
        let text = process::read(&file)?;
        let packages = text
            .split_once("# dependencies = ")
            .and_then(|(_, rest)| rest.split_once("# ///"));
        let (packages, _) = packages.with_context(|| format!("{} names none", self.file))?;
        let packages: Vec<&str> = packages.split('"').skip(1).step_by(2).collect();
        let name = file.file_stem().unwrap_or_default();
        environment(&name.to_string_lossy(), &packages)
    }

    /// Installs their needs, and runs them.
    pub fn run(&self, tally: &mut Tally) -> Result<()> {
        let python = self.environment()?;
        if !self.installed.is_empty() {
            install(&python, self.installed)?;
        }
        let mut tests = Command::new(python);
        let tool = match self.run_on {
            RunOn::Server | RunOn::RigByServer => artifacts::serving_tool()?,
            RunOn::Tool | RunOn::Rig => artifacts::host_tool()?,
        };
        tests.args(["-W", self.warnings, self.file]);
        tests.env("HIVTAC_TOOL", tool);
        if matches!(self.run_on, RunOn::Rig | RunOn::RigByServer) {
            tests.env("HIVTAC_ELF", artifacts::firmware(Board::Weact)?);
            tests.env("HIVTAC_RIG", artifacts::host_program("hivtac-rig")?);
        }
        run_tests(tests.current_dir(toolchain::at("")), tally)
    }
}

/// Returns the Python of an environment with packages of PyPI, which is made if missing.
pub fn environment(name: &str, packages: &[&str]) -> Result<PathBuf> {
    let folder = toolchain::work_folder("python")?.join(name);
    let (python, complete) = (folder.join("bin/python"), folder.join("packages.txt"));
    let list = packages.join("\n");
    let is_complete = std::fs::read_to_string(&complete).is_ok_and(|text| text == list);
    if !is_complete || !process::succeeds(Command::new(&python).arg("--version")) {
        process::run(process::command("python3 -m venv --clear").arg(&folder))?;
        process::run(pip(&python).args(packages))?;
        process::write(&complete, &list)?;
    }
    Ok(python)
}

/// Installs packages of this project as a user does, but Rust in the profile of the tests' other
/// programs.
fn install(python: &Path, folders: &[&str]) -> Result<()> {
    let mut install = pip(python);
    install.args("--no-build-isolation --force-reinstall --no-deps".split(' '));
    install.args(folders).current_dir(toolchain::at(""));
    // The build backend finds maturin in this folder.
    process::before_path(&mut install, &python.with_file_name(""))?;
    process::run(install.env("MATURIN_PEP517_ARGS", "--profile tools"))
}

/// The quiet command `pip install`.
fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args("-m pip install --quiet --disable-pip-version-check".split(' '));
    command
}

/// Checks the annotations of Python's `hivtac`.
pub fn check_types() -> Result<()> {
    let mut types = Command::new(PACKAGE.environment()?);
    types.args("-m mypy --strict --cache-dir target/mypy host-tool/python/hivtac".split(' '));
    process::run(types.current_dir(toolchain::at("")))
}

/// Options of `cargo xtask kit`.
#[derive(Args)]
pub struct Kit {
    /// Folder to write to.
    #[arg(default_value = "target/kit")]
    out: PathBuf,
    /// Measures of bought parts: `--pupil-mm 1.6 --lens-front-mm 21`; `--help` after `--` lists
    /// all.
    #[arg(last = true)]
    bought: Vec<String>,
}

impl Kit {
    /// Writes the kit's solids, drawings and pictures.
    pub fn run(&self) -> Result<()> {
        let out = std::path::absolute(&self.out)?;
        let python = KIT.environment();
        let python = python.context("with build123d, `python -m kit OUT` writes the kit")?;
        let mut command = Command::new(python);
        command.args(["-m", "kit"]).arg(out).args(&self.bought);
        process::run(command.current_dir(toolchain::at("hardware")))
    }
}
