//! Debian's own Rust for the microcontroller, where rustup cannot add the target: its compiler has
//! no library for that and builds `core` itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::{Context, Result};

use crate::{packages, process};

const CARGO: &str = "/usr/bin/cargo";
const RUSTC: &str = "/usr/bin/rustc";
const CLIPPY: &str = "/usr/bin/clippy-driver";
const PACKAGES: &str = "rustc-web cargo-web rust-web-src lld";

/// `ld.lld`, once Debian's compiler was chosen: Debian has no `rust-lld`.
static LINKER: OnceLock<PathBuf> = OnceLock::new();

/// From here on, what is for the microcontroller is built by Debian's compiler; installs it when it
/// is missing.
pub fn choose() -> Result<()> {
    if !is_complete() {
        packages::install(
            PACKAGES,
            "a Rust compiler for the microcontroller is missing",
        )?;
    }
    let linker = process::find_program("ld.lld").context("there is no `ld.lld` on PATH")?;
    LINKER.get_or_init(|| linker);
    Ok(())
}

/// Whether it was chosen.
pub fn is_chosen() -> bool {
    LINKER.get().is_some()
}

fn is_complete() -> bool {
    let sources = || {
        let sysroot = process::output(rustc().args(["--print", "sysroot"])).ok()?;
        Some(Path::new(sysroot.trim()).join("lib/rustlib/src/rust/library/core"))
    };
    [CARGO, RUSTC].iter().all(|file| Path::new(file).is_file())
        && sources().is_some_and(|folder| folder.is_dir())
        && process::find_program("ld.lld").is_some()
}

/// Debian's compiler.
pub fn rustc() -> Command {
    without_rustup(Command::new(RUSTC))
}

/// Turns a cargo command for the microcontroller into one of Debian's, if it was chosen.
pub fn instead(command: Command) -> Command {
    let Some(linker) = LINKER.get() else {
        return command;
    };
    let mut debian = without_rustup(Command::new(CARGO));
    debian.args(command.get_args());
    if let Some(folder) = command.get_current_dir() {
        debian.current_dir(folder);
    }
    debian
        .env("CARGO", CARGO)
        .env("RUSTC", RUSTC)
        // A released compiler builds `core` only when told that it is the one meant to.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker)
        .arg("-Zbuild-std=core");
    debian
}

/// The linter of what it builds.
pub fn linter() -> Result<&'static str> {
    if !Path::new(CLIPPY).is_file() {
        packages::install("rust-web-clippy", "Debian's clippy is missing")?;
    }
    Ok(CLIPPY)
}

/// Forgets what the cargo that runs this program has set for its own toolchain.
fn without_rustup(mut command: Command) -> Command {
    for name in ["RUSTUP_TOOLCHAIN", "LD_LIBRARY_PATH", "CARGO", "RUSTC"] {
        command.env_remove(name);
    }
    command
}
