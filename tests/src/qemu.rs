//! Runs scripts in the images for Cortex-M cores under QEMU, and on this computer.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::string::String;
use std::{env, fs, vec::Vec};

use anyhow::{Context, Result, ensure};

use crate::artifact;
use crate::golden::{Buffers, MAX_ROW_PIXELS, NO_USUAL_MODEL, Runner, TWO_BANDS_PIXELS};
use crate::script::Script;

/// A core that QEMU emulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Core {
    /// Cortex-M7, the sensor's own. `HIVTAC_QEMU_IMAGE` names its image.
    M7,
    /// Cortex-M55. `HIVTAC_M55_IMAGE` names its image.
    M55,
}

/// The variable that names the Cortex-M55's image.
const M55_IMAGE: &str = "HIVTAC_M55_IMAGE";

impl Core {
    /// Returns the Cortex-M7, and the Cortex-M55 if its image is named.
    pub fn wanted() -> Vec<Core> {
        match env::var_os(M55_IMAGE) {
            Some(_) => Vec::from([Core::M7, Core::M55]),
            None => Vec::from([Core::M7]),
        }
    }

    fn image(self) -> PathBuf {
        artifact::named_by(match self {
            Core::M7 => "HIVTAC_QEMU_IMAGE",
            Core::M55 => M55_IMAGE,
        })
    }

    /// Returns QEMU's name of a machine with this core.
    fn machine(self) -> &'static str {
        match self {
            Core::M7 => "mps2-an500",
            Core::M55 => "mps3-an547",
        }
    }
}

/// Runs a script on an emulated core and returns the printed text.
///
/// # Errors
/// If QEMU cannot be started, or the image fails.
pub fn run(core: Core, script: &Script) -> Result<String> {
    let folder = tempfile::tempdir().context("creating a temporary folder")?;
    let (input, output) = (folder.path().join("script"), folder.path().join("results"));
    fs::write(&input, script.bytes()).context("writing the script")?;
    let run = command(core, &input, &output)
        .output()
        .context("starting qemu-system-arm (Debian package qemu-system-arm)")?;
    let said = String::from_utf8_lossy(&run.stderr);
    ensure!(
        run.status.success(),
        "the image under QEMU failed ({}): {said}",
        run.status
    );
    fs::read_to_string(&output).context("reading the results")
}

/// Runs a script on this computer and returns the printed text.
///
/// # Errors
/// If the script is invalid.
pub fn run_on_host(script: &Script) -> Result<String> {
    let mut bands = std::vec![0; TWO_BANDS_PIXELS];
    let buffers = Buffers {
        model: &mut *std::boxed::Box::new(NO_USUAL_MODEL),
        row: &mut [0; MAX_ROW_PIXELS],
        bands: bands
            .as_mut_slice()
            .try_into()
            .context("room for a frame")?,
    };
    let mut runner = std::boxed::Box::new(Runner::new(buffers));
    let mut results = String::new();
    runner
        .run(&mut script.bytes(), &mut results)
        .map_err(|error| anyhow::anyhow!("the script cannot be run: {error:?}"))?;
    Ok(results)
}

/// Returns the command for QEMU with the image; `timeout` ends it if it hangs.
fn command(core: Core, input: &Path, output: &Path) -> Command {
    let (input, output) = (input.display(), output.display());
    let semihosting =
        std::format!("enable=on,target=native,arg=hivtac-qemu-image,arg={input},arg={output}");
    let mut command = Command::new("timeout");
    command
        .args([
            "300",
            "qemu-system-arm",
            "-M",
            core.machine(),
            "-display",
            "none",
        ])
        .args([
            "-monitor",
            "none",
            "-serial",
            "none",
            "-semihosting-config",
            &semihosting,
        ])
        .arg("-kernel")
        .arg(core.image());
    command
}

/// Returns the first line in which two results differ, for a readable message; `None` if they are
/// equal.
pub fn first_difference(left: &str, right: &str) -> Option<String> {
    let (left, right): (Vec<&str>, Vec<&str>) = (left.lines().collect(), right.lines().collect());
    let line = (0..left.len().max(right.len())).find(|&i| left.get(i) != right.get(i))?;
    let (left, right) = (left.get(line), right.get(line));
    Some(std::format!(
        "line {}:\n left: {left:?}\nright: {right:?}",
        line + 1
    ))
}
