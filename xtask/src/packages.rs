//! Installs missing Debian packages if allowed, or else names them.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};

use crate::process::{self, command};

/// Installs Debian packages as root or through sudo. Called only if something is missing: a
/// complete machine needs no network.
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
        // Waits during another installation, such as by another step or by the system.
        let apt_get = format!("{sudo}apt-get -o DPkg::Lock::Timeout=300 {words}");
        process::run(command(&apt_get).env("DEBIAN_FRONTEND", "noninteractive"))
    };
    let install = format!("install --yes --no-install-recommends {packages}");
    if apt_get(&install).is_ok() {
        return Ok(());
    }
    // The list of packages may be missing or out of date, as in a new container.
    let installed = apt_get("update").and_then(|()| apt_get(&install));
    installed.with_context(|| format!("{why}, and installing {packages} failed"))
}

/// Whether apt knows a Debian package; if not, its list of packages is renewed where allowed.
pub fn are_known(package: &str) -> bool {
    let knows = || process::succeeds(command("apt-cache show").arg(package));
    knows() || process::succeeds(&mut command("apt-get update")) && knows()
}

/// Installs QEMU's PC, if missing.
pub fn ensure_qemu_pc() -> Result<()> {
    if process::find_program("qemu-system-x86_64").is_none() {
        install("qemu-system-x86", "the emulator of a PC is missing")?;
    }
    Ok(())
}

/// Installs QEMU's Cortex-M machines for tests and benchmark, if missing.
pub fn ensure_qemu() -> Result<()> {
    if process::find_program("qemu-system-arm").is_none() {
        install("qemu-system-arm", "the Cortex-M emulator is missing")?;
    }
    Ok(())
}

/// The path of a browser for the test of `hivtac view`'s page.
pub fn chromium() -> Result<PathBuf> {
    let names = "chromium chromium-browser google-chrome google-chrome-stable";
    let find = || names.split(' ').find_map(process::find_program);
    if find().is_none() {
        install("chromium fonts-dejavu-core", "a browser is missing")?;
    }
    find().context("Chromium was installed and is not found")
}
