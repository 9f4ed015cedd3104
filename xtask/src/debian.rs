//! Debian's Rust for the microcontroller, used where rustup cannot add the target. Its compiler
//! lacks that target's library and builds `core` itself.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use anyhow::{Context, Result};

use crate::{packages, process};

const CARGO: &str = "/usr/bin/cargo";
const RUSTC: &str = "/usr/bin/rustc";
/// The linter for this compiler.
pub const CLIPPY: &str = "/usr/bin/clippy-driver";
const PACKAGES: &str = "rustc-web cargo-web rust-web-src rust-web-clippy lld";

/// The path of `ld.lld`, set once Debian's compiler was chosen: Debian has no `rust-lld`.
static LINKER: OnceLock<PathBuf> = OnceLock::new();

/// Chooses Debian's compiler for all later builds for the microcontroller; installs it if missing.
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

fn is_complete() -> bool {
    let sources = || {
        let sysroot = process::output(rustc().args(["--print", "sysroot"])).ok()?;
        Some(Path::new(sysroot.trim()).join("lib/rustlib/src/rust/library/core"))
    };
    [CARGO, RUSTC, CLIPPY]
        .iter()
        .all(|file| Path::new(file).is_file())
        && sources().is_some_and(|folder| folder.is_dir())
        && process::find_program("ld.lld").is_some()
}

/// Debian's compiler.
fn rustc() -> Command {
    without_rustup(Command::new(RUSTC))
}

/// Debian's compiler, if it was chosen.
pub fn chosen() -> Option<Command> {
    LINKER.get().map(|_| rustc())
}

/// Whether a command is of Debian's cargo.
pub fn runs(command: &Command) -> bool {
    command.get_program() == CARGO
}

/// Changes a cargo command for the microcontroller to use Debian's compiler, if chosen.
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
        // A released compiler builds `core` only with this permission.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker)
        .arg("-Zbuild-std=core");
    debian
}

/// Removes the variables that the running cargo has set for its own toolchain.
fn without_rustup(mut command: Command) -> Command {
    for name in ["RUSTUP_TOOLCHAIN", "LD_LIBRARY_PATH", "CARGO", "RUSTC"] {
        command.env_remove(name);
    }
    command
}
