//! Runs the tests in Python, each in its own environment with packages of PyPI.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::artifacts::{self, Board};
use crate::report::{Tally, run_tests};
use crate::test::Shared;
use crate::{process, toolchain};

/// An environment of Python, with packages of PyPI.
pub struct Environment {
    /// Its folder below `target/`.
    pub folder: &'static str,
    /// The modules by whose import it is known to be complete.
    pub modules: &'static str,
    /// The packages by their names for pip.
    pub packages: &'static str,
    /// What it needs, for people: the oldest Python, and what else.
    pub needs: &'static str,
}

/// For Python's `hivtac`.
pub const PACKAGE: Environment = Environment {
    folder: "python",
    modules: "maturin, mypy, numpy",
    packages: "maturin>=1.9,<2 mypy numpy",
    needs: "Python 3.9",
};

/// For a receiver of `hivtac serve`: Cyclone DDS, which ROS 2 itself uses, a WebSocket client, and
/// a reader of ROS 2's messages.
pub const SERVE: Environment = Environment {
    folder: "python-serve",
    modules: "cyclonedds, mcap_ros2, websockets",
    packages: "cyclonedds mcap-ros2-support websockets",
    needs: "Python 3.10, and cyclonedds for this Python and computer",
};

/// For a receiver of `hivtac serve` on Zenoh that is not of ROS 2.
pub const ZENOH: Environment = Environment {
    folder: "python-zenoh",
    modules: "rosbags, zenoh_ros2_sdk",
    packages: "zenoh-ros2-sdk>=0.1.8",
    needs: "Python 3.10",
};

/// For LeRobot with the sensors' package; maturin and hatchling build that here. It brings PyTorch.
/// Python 3.12 and newer have the present LeRobot, 3.10 and 3.11 the last one for them.
pub const LEROBOT: Environment = Environment {
    folder: "python-lerobot",
    modules: "maturin, hatchling, lerobot.datasets.lerobot_dataset, \
              lerobot.scripts.lerobot_record",
    packages: "maturin>=1.9,<2 hatchling>=1.26 lerobot[core_scripts]>=0.4.4",
    needs: "Python 3.10 and 8 GB with PyTorch; on Linux with Python 3.12, where one of its \
            packages is built, gcc, python3-dev and linux-libc-dev",
};

/// For Rerun, which reads its own files from Python 3.11 on.
pub const RERUN: Environment = Environment {
    folder: "python-rerun",
    modules: "maturin, rerun.chunk",
    packages: "maturin>=1.9,<2 rerun-sdk>=0.41",
    needs: "Python 3.11 and 0.9 GB",
};

/// For the simulated sensor inside MuJoCo.
pub const MUJOCO: Environment = Environment {
    folder: "python-mujoco",
    modules: "maturin, mujoco",
    packages: "maturin>=1.9,<2 mujoco>=3.3",
    needs: "Python 3.10",
};

/// For the kit's mechanics, `hardware/`.
pub const KIT: Environment = Environment {
    folder: "python-kit",
    modules: "build123d",
    packages: "build123d>=0.13,<0.14",
    needs: "Python 3.10, 1 GB, and build123d's solid modeller for this computer",
};

/// The Python of an environment that is complete.
pub struct Python(pub PathBuf);

impl Environment {
    /// Makes the environment if missing; returns the obstacle, if there is one.
    pub fn obstacle(&self) -> Option<String> {
        let error = self.ready().err()?;
        process::say(&format!("{error:#}"));
        Some(format!(
            "pip cannot install {}: is there python3 with venv (package python3-venv), and PyPI \
             within reach? It takes at least {}",
            self.packages, self.needs
        ))
    }

    /// Its Python, with the packages installed.
    pub fn ready(&self) -> Result<Python> {
        let folder = toolchain::at("target").join(self.folder);
        let python = folder.join("bin/python");
        let import = format!("import {}", self.modules);
        if !process::succeeds(Command::new(&python).args(["-c", &import])) {
            process::run(process::command("python3 -m venv --clear").arg(&folder))?;
            process::run(pip(&python).args(self.packages.split(' ')))?;
        }
        Ok(Python(python))
    }
}

impl Python {
    /// Installs packages of this project as a user does, but Rust in the profile of the tests'
    /// other programs.
    fn install(&self, folders: &[&str]) -> Result<()> {
        let mut install = pip(&self.0);
        install.args("--no-build-isolation --force-reinstall --no-deps".split(' '));
        install.args(folders);
        // The build backend finds maturin in this folder.
        let path = std::env::var("PATH").unwrap_or_default();
        let programs = self.0.with_file_name("");
        install.env("PATH", format!("{}:{path}", programs.display()));
        install.env("MATURIN_PEP517_ARGS", "--profile tools");
        process::run(install.current_dir(toolchain::at("")))
    }

    /// The command that runs a file's tests, with this host tool named to them.
    fn tests(&self, options: &[&str], file: &str, tool: PathBuf) -> Command {
        let mut command = Command::new(&self.0);
        command.args(options).arg(file).env("HIVTAC_TOOL", tool);
        command.current_dir(toolchain::at(""));
        command
    }
}

/// Any warning of Python is an error.
const STRICT: [&str; 2] = ["-W", "error"];

/// The quiet command `pip install`.
fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args("-m pip install --quiet --disable-pip-version-check".split(' '));
    command
}

/// Installs Python's `hivtac`, runs its tests on the firmware in the rig, and checks its
/// annotations.
pub fn test_package(_: &Shared, tally: &mut Tally) -> Result<()> {
    let python = PACKAGE.ready()?;
    python.install(&["./host-tool/python"])?;
    let mut types = Command::new(&python.0);
    types.args("-m mypy --strict --cache-dir target/mypy host-tool/python/hivtac".split(' '));
    process::run(types.current_dir(toolchain::at("")))?;
    let (file, tool) = (
        "host-tool/python/tests/test_hivtac.py",
        artifacts::host_tool()?,
    );
    run_tests(&mut on_rig(python.tests(&STRICT, file, tool))?, tally)
}

/// Records with LeRobot from the simulated sensor, and loads what was recorded.
pub fn test_lerobot(_: &Shared, tally: &mut Tally) -> Result<()> {
    let python = LEROBOT.ready()?;
    python.install(&["./host-tool/python", "./host-tool/lerobot"])?;
    let tool = artifacts::host_tool()?;
    run_tests(
        &mut python.tests(&[], "tests/python/test_lerobot.py", tool),
        tally,
    )
}

/// Logs the simulated sensor and a recording into files of Rerun, and reads these.
pub fn test_rerun(_: &Shared, tally: &mut Tally) -> Result<()> {
    let python = RERUN.ready()?;
    python.install(&["./host-tool/python"])?;
    let tool = artifacts::host_tool()?;
    run_tests(
        &mut python.tests(&[], "tests/python/test_rerun.py", tool),
        tally,
    )
}

/// Presses the simulated sensor in a program's own time, and in a simulation of MuJoCo.
pub fn test_mujoco(_: &Shared, tally: &mut Tally) -> Result<()> {
    let python = MUJOCO.ready()?;
    python.install(&["./host-tool/python"])?;
    let tool = artifacts::host_tool()?;
    run_tests(
        &mut python.tests(&STRICT, "tests/python/test_twin.py", tool),
        tally,
    )
}

/// Serves the firmware in the rig, and tests what a receiver gets.
pub fn test_serve(_: &Shared, tally: &mut Tally) -> Result<()> {
    let tool = artifacts::serving_tool()?;
    let tests = SERVE
        .ready()?
        .tests(&STRICT, "tests/python/test_serve.py", tool);
    run_tests(&mut on_rig(tests)?, tally)
}

/// Serves the simulated sensor on Zenoh, and tests what a receiver gets.
pub fn test_zenoh(_: &Shared, tally: &mut Tally) -> Result<()> {
    let tool = artifacts::serving_tool()?;
    let mut tests = ZENOH
        .ready()?
        .tests(&[], "tests/python/test_zenoh.py", tool);
    run_tests(&mut tests, tally)
}

/// Checks the kit's solids, alone and assembled.
pub fn test_kit(_: &Shared, tally: &mut Tally) -> Result<()> {
    let options = ["-W", "error::UserWarning"];
    let tool = artifacts::host_tool()?;
    let mut tests = KIT
        .ready()?
        .tests(&options, "tests/python/test_kit.py", tool);
    run_tests(&mut tests, tally)
}

/// Writes the kit's solids, drawings and pictures into a folder.
pub fn write_kit(out: &Path, options: &[String]) -> Result<()> {
    let out = std::path::absolute(out)?;
    let mut command = Command::new(KIT.ready()?.0);
    command.args(["-m", "kit"]).arg(out).args(options);
    process::run(command.current_dir(toolchain::at("hardware")))
}

/// Names the firmware and the rig to tests.
fn on_rig(mut tests: Command) -> Result<Command> {
    tests.env("HIVTAC_ELF", artifacts::firmware(Board::Weact)?);
    tests.env("HIVTAC_RIG", artifacts::host_program("hivtac-rig")?);
    Ok(tests)
}
