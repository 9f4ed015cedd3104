//! The Rust toolchain for the microcontroller, found or installed without touching the version the
//! user has.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;

use crate::{packages, process, workspace};

/// The microcontroller's target: Cortex-M7 with a double-precision FPU.
pub const TARGET: &str = "thumbv7em-none-eabihf";

const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_CLIPPY: &str = "/usr/bin/clippy-driver";

/// What runs in the compiler's place for the project's own packages, and lints them.
const LINTER: &str = "RUSTC_WORKSPACE_WRAPPER";
/// Of the toolchain in use.
const CLIPPY: &str = "clippy-driver";

/// Where the toolchain for the microcontroller may come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Choice {
    /// The first that works: already there, added by rustup, Debian's packages.
    Auto,
    /// Only the user's own toolchain with the target that is already there or that rustup adds.
    Own,
    /// Only Debian's packages.
    Debian,
}

/// A toolchain that can build for [`TARGET`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Toolchain {
    /// The one that runs this program.
    Own,
    /// Debian's compiler, which has no library for the target and builds `core` itself.
    Debian {
        /// `ld.lld`: Debian has no `rust-lld`.
        linker: PathBuf,
    },
}

impl Toolchain {
    /// Finds a toolchain for the target, and installs what is missing.
    ///
    /// # Errors
    /// Says what was tried, and what to install by hand.
    pub fn prepare(choice: Choice) -> Result<Toolchain> {
        if choice != Choice::Debian && (own_has_target() || rustup_adds_target()) {
            return Ok(Toolchain::Own);
        }
        if choice == Choice::Own {
            bail!("{}", advice());
        }
        if choice == Choice::Auto {
            eprintln!("the toolchain in use cannot get {TARGET}: trying Debian's own packages");
        }
        debian().with_context(advice)
    }

    /// What the compiler for the target calls itself: `rustc 1.95.0 (59807616e 2026-04-14)`.
    ///
    /// # Errors
    /// When it cannot be run.
    pub fn compiler(&self) -> Result<String> {
        let mut command = match self {
            Toolchain::Own => Command::new(own_rustc()),
            Toolchain::Debian { .. } => {
                let mut command = Command::new(DEBIAN_RUSTC);
                without_rustup(&mut command);
                command
            }
        };
        Ok(process::output(command.arg("-V"))?.trim().to_owned())
    }

    /// `cargo build` for the target, run in `folder`.
    pub fn build(&self, folder: &Path) -> Command {
        match self {
            Toolchain::Own => for_target(cargo("build", folder)),
            Toolchain::Debian { linker } => {
                let mut command = Command::new(DEBIAN_CARGO);
                command.arg("build");
                debian_settings(command, folder, linker)
            }
        }
    }

    /// Has a command of [`build`](Self::build) lint the packages of this project that it builds.
    ///
    /// # Errors
    /// When Debian's clippy is needed and cannot be installed.
    pub fn lint(&self, command: &mut Command) -> Result<()> {
        let driver = match self {
            Toolchain::Own => CLIPPY,
            Toolchain::Debian { .. } => {
                if !Path::new(DEBIAN_CLIPPY).is_file() {
                    packages::install(&["rust-web-clippy"], "Debian's clippy is missing")?;
                }
                DEBIAN_CLIPPY
            }
        };
        command.env(LINTER, driver);
        Ok(())
    }
}

/// Has a cargo command for this computer lint likewise.
pub fn lint(command: &mut Command) {
    command.env(LINTER, CLIPPY);
}

/// A cargo command for this computer, run in `folder`, by the toolchain that runs this program.
pub fn cargo(verb: &str, folder: &Path) -> Command {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.arg(verb).current_dir(folder);
    command
}

/// The programs `cargo fmt` and `cargo clippy` of the toolchain in use; rustup adds them when it
/// can.
///
/// # Errors
/// Names the component that is missing.
pub fn ensure_components() -> Result<()> {
    for (verb, component) in [("fmt", "rustfmt"), ("clippy", "clippy")] {
        if has(verb) {
            continue;
        }
        eprintln!("`cargo {verb}` is missing: asking rustup for it");
        let added = process::run(Command::new("rustup").args(["component", "add", component]));
        if added.is_err() || !has(verb) {
            bail!(
                "`cargo {verb}` is missing: `rustup component add {component}`, or your system's \
                 package for it"
            );
        }
    }
    Ok(())
}

/// Whether cargo knows a command, such as `clippy`.
pub fn has(verb: &str) -> bool {
    process::succeeds(cargo(verb, workspace::root()).arg("--version"))
}

/// What the toolchain in use calls this computer: `x86_64-unknown-linux-gnu`.
///
/// # Errors
/// When its compiler cannot be run, or does not say.
pub fn host() -> Result<String> {
    let version = process::output(Command::new(own_rustc()).arg("-vV"))?;
    let mut lines = version.lines();
    let host = lines.find_map(|line| line.strip_prefix("host: "));
    Ok(host
        .context("the compiler does not say for which computer it is")?
        .to_owned())
}

fn own_rustc() -> OsString {
    std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into())
}

fn own_has_target() -> bool {
    let mut command = Command::new(own_rustc());
    command.args(["--print", "target-libdir", "--target", TARGET]);
    process::output(&mut command).is_ok_and(|folder| has_core(Path::new(folder.trim())))
}

fn has_core(library: &Path) -> bool {
    let Ok(files) = library.read_dir() else {
        return false;
    };
    files
        .flatten()
        .any(|file| file.file_name().to_string_lossy().starts_with("libcore-"))
}

/// Adds the target to the toolchain in use and to no other; never moves it to another version.
fn rustup_adds_target() -> bool {
    if process::find_program("rustup").is_none() {
        return false;
    }
    eprintln!("{TARGET} is missing: asking rustup for it");
    let mut command = Command::new("rustup");
    command
        .args(["target", "add", TARGET])
        .env("RUSTUP_AUTO_INSTALL", "0");
    match process::run(&mut command) {
        Ok(()) => own_has_target(),
        Err(error) => {
            eprintln!("{error:#}");
            false
        }
    }
}

fn debian() -> Result<Toolchain> {
    if !debian_is_complete() {
        let why = format!("a Rust compiler that can build for {TARGET} is missing");
        packages::install(&["rustc-web", "cargo-web", "rust-web-src", "lld"], &why)?;
    }
    let linker = process::find_program("ld.lld")
        .context("the package lld is installed, but there is no `ld.lld` on PATH")?;
    Ok(Toolchain::Debian { linker })
}

fn debian_is_complete() -> bool {
    [DEBIAN_CARGO, DEBIAN_RUSTC]
        .iter()
        .all(|file| Path::new(file).is_file())
        && debian_sources().is_some_and(|folder| folder.is_dir())
        && process::find_program("ld.lld").is_some()
}

fn debian_sources() -> Option<PathBuf> {
    let mut command = Command::new(DEBIAN_RUSTC);
    without_rustup(&mut command);
    let sysroot = process::output(command.args(["--print", "sysroot"])).ok()?;
    Some(Path::new(sysroot.trim()).join("lib/rustlib/src/rust/library/core"))
}

fn for_target(mut command: Command) -> Command {
    command.args(["--target", TARGET]);
    command
}

fn debian_settings(mut command: Command, folder: &Path, linker: &Path) -> Command {
    without_rustup(&mut command);
    command
        .current_dir(folder)
        .env("CARGO", DEBIAN_CARGO)
        .env("RUSTC", DEBIAN_RUSTC)
        // A released compiler builds `core` only when told that it is the one meant to.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker)
        .arg("-Zbuild-std=core");
    for_target(command)
}

/// Forgets what the cargo that runs this program has set for its own toolchain.
fn without_rustup(command: &mut Command) {
    for name in ["RUSTUP_TOOLCHAIN", "LD_LIBRARY_PATH", "CARGO", "RUSTC"] {
        command.env_remove(name);
    }
}

fn advice() -> String {
    format!(
        "no Rust toolchain for {TARGET}: run `rustup target add {TARGET}`, \
         or as root `apt-get install rustc-web cargo-web rust-web-src lld`"
    )
}
