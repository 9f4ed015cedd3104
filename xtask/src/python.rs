//! Runs the tests in Python, each in its own environment with packages of PyPI.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::artifacts::{self, Board};
use crate::report::{Tally, run_tests};
use crate::{process, toolchain};

/// For Python's `hivtac`: the environment's folder below `target/`, the imported modules, and the
/// packages by their names for pip.
const PACKAGE: [&str; 3] = [
    "python",
    "maturin, mypy, numpy",
    "maturin>=1.9,<2 mypy numpy",
];

/// The same for a receiver of `hivtac serve`: Cyclone DDS, which ROS 2 itself uses, a WebSocket
/// client, and a reader of ROS 2's messages.
const SERVE: [&str; 3] = [
    "python-serve",
    "cyclonedds, mcap_ros2, websockets",
    "cyclonedds mcap-ros2-support websockets",
];

/// The same for LeRobot with the sensors' package; maturin and hatchling build that here. It brings
/// PyTorch. Python 3.12 and newer have the present LeRobot, 3.10 and 3.11 the last one for them.
const LEROBOT: [&str; 3] = [
    "python-lerobot",
    "maturin, hatchling, lerobot.datasets.lerobot_dataset, lerobot.scripts.lerobot_record",
    "maturin>=1.9,<2 hatchling>=1.26 lerobot[core_scripts]>=0.4.4",
];

/// The same for Rerun, which reads its own files from Python 3.11 on.
const RERUN: [&str; 3] = [
    "python-rerun",
    "maturin, rerun.chunk",
    "maturin>=1.9,<2 rerun-sdk>=0.41",
];

/// The same for the simulated sensor inside MuJoCo.
const MUJOCO: [&str; 3] = [
    "python-mujoco",
    "maturin, mujoco",
    "maturin>=1.9,<2 mujoco>=3.3",
];

/// The same for the kit's mechanics, `hardware/`.
const KIT: [&str; 3] = ["python-kit", "build123d", "build123d>=0.13,<0.14"];

/// Makes the package's environment if missing; returns the obstacle, if there is one.
pub fn no_package() -> Option<&'static str> {
    obstacle(
        PACKAGE,
        "pip cannot install maturin, mypy and numpy for Python 3.9 or newer: is there python3 \
         with venv (package python3-venv), and PyPI within reach?",
    )
}

/// Makes the environment for `hivtac serve` if missing; returns the obstacle, if there is one.
pub fn no_serve() -> Option<&'static str> {
    obstacle(
        SERVE,
        "pip cannot install cyclonedds, mcap-ros2-support and websockets for Python 3.10 or \
         newer: is there python3 with venv (package python3-venv), and PyPI within reach, and \
         does it have cyclonedds for this Python and computer?",
    )
}

/// Makes LeRobot's environment if missing; returns the obstacle, if there is one.
pub fn no_lerobot() -> Option<&'static str> {
    obstacle(
        LEROBOT,
        "pip cannot install lerobot (8 GB with PyTorch) for Python 3.10 or newer: is there \
         python3 with venv (package python3-venv), and PyPI within reach? On Linux with Python \
         3.12 or newer one of its packages is built: gcc, python3-dev and linux-libc-dev",
    )
}

/// Makes Rerun's environment if missing; returns the obstacle, if there is one.
pub fn no_rerun() -> Option<&'static str> {
    obstacle(
        RERUN,
        "pip cannot install rerun-sdk (0.9 GB) for Python 3.11 or newer: is there python3 with \
         venv (package python3-venv), and PyPI within reach?",
    )
}

/// Makes MuJoCo's environment if missing; returns the obstacle, if there is one.
pub fn no_mujoco() -> Option<&'static str> {
    obstacle(
        MUJOCO,
        "pip cannot install mujoco for Python 3.10 or newer: is there python3 with venv (package \
         python3-venv), and PyPI within reach?",
    )
}

/// Makes the kit's environment if missing; returns the obstacle, if there is one.
pub fn no_kit() -> Option<&'static str> {
    obstacle(
        KIT,
        "pip cannot install build123d (1 GB) for Python 3.10 or newer: is there python3 with venv \
         (package python3-venv), and PyPI within reach, and does it have build123d's solid \
         modeller for this computer?",
    )
}

fn obstacle(environment: [&str; 3], missing: &'static str) -> Option<&'static str> {
    python(environment).err().map(|error| {
        process::say(&format!("{error:#}"));
        missing
    })
}

/// The Python of an environment, with the packages installed.
pub fn python([folder, modules, packages]: [&str; 3]) -> Result<PathBuf> {
    let folder = toolchain::at("target").join(folder);
    let python = folder.join("bin/python");
    let import = format!("import {modules}");
    if !process::succeeds(Command::new(&python).args(["-c", &import])) {
        process::run(process::command("python3 -m venv --clear").arg(&folder))?;
        process::run(pip(&python).args(packages.split(' ')))?;
    }
    Ok(python)
}

/// The quiet command `pip install`.
pub fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args("-m pip install --quiet --disable-pip-version-check".split(' '));
    command
}

/// Installs packages of this project as a user does, but Rust in the profile of the tests' other
/// programs.
fn install(python: &Path, folders: &[&str]) -> Result<()> {
    let mut install = pip(python);
    install.args("--no-build-isolation --force-reinstall --no-deps".split(' '));
    install.args(folders);
    // The build backend finds maturin in this folder.
    let path = std::env::var("PATH").unwrap_or_default();
    let programs = python.with_file_name("");
    install.env("PATH", format!("{}:{path}", programs.display()));
    install.env("MATURIN_PEP517_ARGS", "--profile tools");
    process::run(install.current_dir(toolchain::at("")))
}

/// Installs Python's `hivtac`, runs its tests on the firmware in the rig, and checks its
/// annotations.
pub fn test_package(tally: &mut Tally) -> Result<()> {
    let python = python(PACKAGE)?;
    install(&python, &["./host-tool/python"])?;
    let mut types = Command::new(&python);
    types.args("-m mypy --strict --cache-dir target/mypy host-tool/python/hivtac".split(' '));
    process::run(types.current_dir(toolchain::at("")))?;
    test(
        &python,
        "host-tool/python/tests/test_hivtac.py",
        &artifacts::host_tool()?,
        tally,
    )
}

/// Records with LeRobot from the simulated sensor, and loads what was recorded.
pub fn test_lerobot(tally: &mut Tally) -> Result<()> {
    let python = python(LEROBOT)?;
    install(&python, &["./host-tool/python", "./host-tool/lerobot"])?;
    test_on_twin(&python, "tests/python/test_lerobot.py", tally)
}

/// Logs the simulated sensor and a recording into files of Rerun, and reads these.
pub fn test_rerun(tally: &mut Tally) -> Result<()> {
    let python = python(RERUN)?;
    install(&python, &["./host-tool/python"])?;
    test_on_twin(&python, "tests/python/test_rerun.py", tally)
}

/// Presses the simulated sensor in a program's own time, and in a simulation of MuJoCo.
pub fn test_mujoco(tally: &mut Tally) -> Result<()> {
    let python = python(MUJOCO)?;
    install(&python, &["./host-tool/python"])?;
    let mut command = Command::new(python);
    command.args(["-W", "error", "tests/python/test_twin.py"]);
    run_tests(command.current_dir(toolchain::at("")), tally)
}

/// Runs tests on the simulated sensor.
fn test_on_twin(python: &Path, file: &str, tally: &mut Tally) -> Result<()> {
    let mut command = Command::new(python);
    command
        .arg(file)
        .env("HIVTAC_TOOL", artifacts::host_tool()?);
    run_tests(command.current_dir(toolchain::at("")), tally)
}

/// Serves the firmware in the rig, and tests what a receiver gets.
pub fn test_serve(tally: &mut Tally) -> Result<()> {
    let (python, tool) = (python(SERVE)?, artifacts::serving_tool()?);
    test(&python, "tests/python/test_serve.py", &tool, tally)
}

/// Checks the kit's solids, alone and assembled.
pub fn test_kit(tally: &mut Tally) -> Result<()> {
    let mut command = Command::new(python(KIT)?);
    command.args(["-W", "error::UserWarning", "tests/python/test_kit.py"]);
    command.env("HIVTAC_TOOL", artifacts::host_tool()?);
    run_tests(command.current_dir(toolchain::at("")), tally)
}

/// Writes the kit's solids, drawings and pictures into a folder.
pub fn write_kit(out: &Path, options: &[String]) -> Result<()> {
    let out = std::path::absolute(out)?;
    let mut command = Command::new(python(KIT)?);
    command.args(["-m", "kit"]).arg(out).args(options);
    process::run(command.current_dir(toolchain::at("hardware")))
}

fn test(python: &Path, file: &str, tool: &Path, tally: &mut Tally) -> Result<()> {
    let mut command = Command::new(python);
    command
        .args(["-W", "error", file])
        .current_dir(toolchain::at(""));
    command.env("HIVTAC_ELF", artifacts::firmware(Board::Weact)?);
    command
        .env("HIVTAC_TOOL", tool)
        .env("HIVTAC_RIG", artifacts::host_program("hivtac-rig")?);
    run_tests(&mut command, tally)
}
