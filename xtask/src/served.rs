//! `hivtac serve`, received by programs of others, in Python.

use std::path::Path;
use std::process::Command;

use anyhow::Result;

use crate::pypi::{self, Environment};
use crate::report::Tally;
use crate::{artifacts, workspace};

/// Who receives: Cyclone DDS, which ROS 2 itself uses, a WebSocket client, and a reader of ROS 2's
/// messages.
const ENVIRONMENT: Environment = Environment {
    folder: "python-serve",
    modules: "cyclonedds, mcap_ros2, websockets",
    packages: &["cyclonedds", "mcap-ros2-support", "websockets"],
    oldest: (3, 10),
    missing: "pip cannot install cyclonedds, mcap-ros2-support and websockets: is PyPI within \
              reach, and does it have cyclonedds for this Python and computer?",
    too_old: "there is no python3 of version 3.10 or newer",
};

/// Why it cannot be tested here; nothing when it can.
pub fn obstacle() -> Option<&'static str> {
    ENVIRONMENT.obstacle()
}

/// Serves the firmware in the rig, and looks at what arrives.
///
/// # Errors
/// When something cannot be built, or a test fails.
pub fn test(firmware: &Path, tally: &mut Tally) -> Result<()> {
    let mut command = Command::new(ENVIRONMENT.python()?);
    command
        .args(["-W", "error", "tests/python/test_serve.py"])
        .current_dir(workspace::root())
        .env("HIVTAC_ELF", firmware)
        .env("HIVTAC_TOOL", artifacts::serving_tool()?)
        .env("HIVTAC_RIG", artifacts::rig()?);
    pypi::run_tests(&mut command, tally)
}
