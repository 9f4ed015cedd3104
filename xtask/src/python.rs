//! Python's `hivtac`: built by pip into an environment of its own, and tested on the rig.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::pypi::{self, Environment, pip};
use crate::report::Tally;
use crate::{artifacts, process, workspace};

/// What building and testing need.
const ENVIRONMENT: Environment = Environment {
    folder: "host-tool/python",
    modules: "maturin, mypy, numpy",
    packages: &["maturin>=1.9,<2", "mypy", "numpy"],
    oldest: (3, 9),
    missing: "pip cannot install maturin, mypy and numpy: is PyPI within reach?",
    too_old: "there is no python3 of version 3.9 or newer",
};

/// Why it cannot be tested here; nothing when it can.
pub fn obstacle() -> Option<&'static str> {
    ENVIRONMENT.obstacle()
}

/// Installs the package as a user does, but in the profile of the other tests' programs, and runs
/// its tests on the firmware in the rig; its annotations are checked, too.
///
/// # Errors
/// When it cannot be built, an annotation is wrong, or a test fails.
pub fn test(firmware: &Path, tally: &mut Tally) -> Result<()> {
    let python = ENVIRONMENT.python()?;
    let mut install = pip(&python);
    // Where maturin is found by its build backend.
    let path = std::env::var("PATH").unwrap_or_default();
    install.env(
        "PATH",
        format!("{}:{path}", ENVIRONMENT.folder().join("bin").display()),
    );
    install.args([
        "--no-build-isolation",
        "--force-reinstall",
        "--no-deps",
        "./host-tool/python",
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
        "host-tool/python/hivtac",
    ]);
    process::run(types.current_dir(workspace::root()))?;
    let mut command = Command::new(&python);
    command
        .args(["-W", "error", "host-tool/python/tests/test_hivtac.py"])
        .current_dir(workspace::root())
        .env("HIVTAC_ELF", firmware)
        .env("HIVTAC_TOOL", artifacts::host_tool()?)
        .env("HIVTAC_RIG", artifacts::rig()?);
    pypi::run_tests(&mut command, tally)
}
