//! Installs missing Debian packages if allowed, or else names them.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};

use crate::process::{self, command, find_program};

/// Installs a Debian package if this program of it is missing.
pub fn ensure(program: &str, package: &str) -> Result<()> {
    match find_program(program) {
        Some(_) => Ok(()),
        None => install(package, &format!("{program} is missing")),
    }
}

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
    if find_program("apt-get").is_none() {
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

/// The path of a browser for the tests of pages.
pub fn chromium() -> Result<PathBuf> {
    let names = "chromium chromium-browser google-chrome google-chrome-stable";
    let find = || names.split(' ').find_map(find_program);
    if find().is_none() {
        install("chromium fonts-dejavu-core", "a browser is missing")?;
    }
    find().context("Chromium was installed and is not found")
}
