//! Debian packages: installed when missing and allowed, named plainly when not.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};

use crate::process::{self, command};

/// Installs Debian packages as root or through sudo. Called only when something is missing, so that
/// a machine that has everything needs no network.
pub fn install(packages: &str, why: &str) -> Result<()> {
    process::say(&format!("{why}: installing the Debian packages {packages}"));
    let sudo = match process::output(&mut command("id -u"))?.trim() {
        "0" => "",
        _ if process::succeeds(&mut command("sudo --non-interactive true")) => {
            "sudo --non-interactive "
        }
        _ => bail!("{why}; as root, install the packages: {packages}"),
    };
    if process::find_program("apt-get").is_none() {
        bail!("{why}; this system has no apt-get: install what your system calls {packages}");
    }
    let apt_get = |words: &str| {
        // Waits while somebody else installs, such as another step or the system itself.
        let apt_get = format!("{sudo}apt-get -o DPkg::Lock::Timeout=300 {words}");
        process::run(command(&apt_get).env("DEBIAN_FRONTEND", "noninteractive"))
    };
    let install = format!("install --yes --no-install-recommends {packages}");
    if apt_get(&install).is_ok() {
        return Ok(());
    }
    // The list of packages may be missing or out of date, as in a fresh container.
    let installed = apt_get("update").and_then(|()| apt_get(&install));
    installed.with_context(|| format!("{why}, and installing {packages} failed"))
}

/// QEMU's Cortex-M7 machine, for the tests and the benchmark.
pub fn ensure_qemu() -> Result<()> {
    if process::find_program("qemu-system-arm").is_none() {
        install("qemu-system-arm", "the Cortex-M7 emulator is missing")?;
    }
    Ok(())
}

/// A browser for the test of the page of `hivtac view`.
pub fn chromium() -> Result<PathBuf> {
    let names = "chromium chromium-browser google-chrome google-chrome-stable";
    let find = || names.split(' ').find_map(process::find_program);
    if find().is_none() {
        install("chromium fonts-dejavu-core", "a browser is missing")?;
    }
    find().context("Chromium was installed and is not found")
}
