//! Runs scripts in the Cortex-M7 image under QEMU, and on this computer.

use std::path::Path;
use std::process::Command;
use std::string::String;
use std::{fs, vec::Vec};

use anyhow::{Context, Result, ensure};

use crate::artifact;
use crate::golden::{Buffers, MAX_ROW_PIXELS, NO_USUAL_MODEL, Runner, TWO_BANDS_PIXELS};
use crate::script::Script;

/// Runs a script on the emulated Cortex-M7 (`HIVTAC_QEMU_IMAGE`) and returns the printed text.
///
/// # Errors
/// If QEMU cannot be started, or the image fails.
pub fn run(script: &Script) -> Result<String> {
    let folder = tempfile::tempdir().context("creating a temporary folder")?;
    let (input, output) = (folder.path().join("script"), folder.path().join("results"));
    fs::write(&input, script.bytes()).context("writing the script")?;
    let run = command(&artifact::named_by("HIVTAC_QEMU_IMAGE"), &input, &output)
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
fn command(image: &Path, input: &Path, output: &Path) -> Command {
    let (input, output) = (input.display(), output.display());
    let semihosting =
        std::format!("enable=on,target=native,arg=hivtac-qemu-image,arg={input},arg={output}");
    let mut command = Command::new("timeout");
    command
        .args([
            "300",
            "qemu-system-arm",
            "-M",
            "mps2-an500",
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
        .arg(image);
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
