//! Debian packages: installed when missing and allowed, named plainly when not.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::process;

/// Installs Debian packages as root or through sudo. Called only when something is missing, so that
/// a machine that has everything needs no network.
///
/// # Errors
/// Says which packages are missing and why they could not be installed.
pub fn install(packages: &[&str], why: &str) -> Result<()> {
    let names = packages.join(" ");
    process::say(&format!("{why}: installing the Debian packages {names}"));
    let Some(prefix) = root_prefix() else {
        bail!("{why}; as root, install the packages: {names}");
    };
    if process::find_program("apt-get").is_none() {
        bail!("{why}; this system has no apt-get: install what your system calls {names}");
    }
    if try_install(prefix, packages).is_ok() {
        return Ok(());
    }
    // The list of packages may be missing or out of date, as in a fresh container.
    process::run(&mut apt_get(prefix, &["update"]))
        .and_then(|()| try_install(prefix, packages))
        .map_err(|error| error.context(format!("{why}, and installing {names} failed")))
}

fn try_install(prefix: &[&str], packages: &[&str]) -> Result<()> {
    let arguments = [&["install", "--yes", "--no-install-recommends"], packages].concat();
    process::run(&mut apt_get(prefix, &arguments))
}

/// Waits while somebody else installs, such as another step or the system itself.
fn apt_get(prefix: &[&str], arguments: &[&str]) -> Command {
    let waits = ["apt-get", "-o", "DPkg::Lock::Timeout=300"];
    let words = [prefix, &waits, arguments].concat();
    let mut command = Command::new(words[0]);
    command
        .args(&words[1..])
        .env("DEBIAN_FRONTEND", "noninteractive");
    command
}

/// What to put before a command that needs root; `None` when there is no way without a password.
fn root_prefix() -> Option<&'static [&'static str]> {
    let user = process::output(Command::new("id").arg("-u")).ok()?;
    if user.trim() == "0" {
        return Some(&[]);
    }
    process::succeeds(Command::new("sudo").args(["--non-interactive", "true"]))
        .then_some(&["sudo", "--non-interactive"])
}

/// QEMU's Cortex-M7 machine, for the tests and the benchmark.
pub fn ensure_qemu() -> Result<()> {
    if process::find_program("qemu-system-arm").is_none() {
        install(&["qemu-system-arm"], "the Cortex-M7 emulator is missing")?;
    }
    Ok(())
}

/// Names by which systems have a Chromium.
const CHROMIUM: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// A browser for the test of the page of `hivtac view`.
///
/// # Errors
/// When there is none and none can be installed.
pub fn chromium() -> Result<PathBuf> {
    let find = || CHROMIUM.iter().find_map(|name| process::find_program(name));
    if find().is_none() {
        install(&["chromium", "fonts-dejavu-core"], "a browser is missing")?;
    }
    find().context("Chromium was installed and is not found")
}
