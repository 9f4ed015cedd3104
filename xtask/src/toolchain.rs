//! The compiler and the project's paths: cargo for this computer and for the microcontroller.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use anyhow::{Context, Result, ensure};

use crate::debian;
use crate::process::{self, command};

/// The microcontroller's target: Cortex-M7 with a double-precision FPU.
const TARGET: &str = "thumbv7em-none-eabihf";
/// The target of a Cortex-M55, which only QEMU runs.
const M55_TARGET: &str = "thumbv8m.main-none-eabihf";
/// The target of browsers.
pub const WEB_TARGET: &str = "wasm32-unknown-unknown";

/// A folder or file of the project, by its path from the root.
pub fn at(name: &str) -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).join(name)
}

/// A folder for the files of `cargo xtask`, below the target directory in use. This program itself
/// is in its folder `tools`.
pub fn work_folder(name: &str) -> Result<PathBuf> {
    let program = std::env::current_exe().context("this program's own path")?;
    let target = program
        .ancestors()
        .nth(2)
        .context("this program's folder")?;
    let folder = target.join("xtask").join(name);
    std::fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
    Ok(folder)
}

/// A cargo command from words without spaces, in a folder of the project, with the toolchain that
/// runs this program.
pub fn cargo(words: &str, folder: &str) -> Command {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words.split(' ')).current_dir(at(folder));
    command
}

/// `cargo build` for the microcontroller, as for flashing.
pub fn build_for_target(folder: &str) -> Command {
    let mut command = cargo("build --release --target", folder);
    command.arg(TARGET);
    debian::instead(command)
}

/// `cargo build` for a Cortex-M55, whose target is added if it is missing.
pub fn build_for_m55(folder: &str) -> Result<Command> {
    ensure!(
        add_target(M55_TARGET)?,
        "rustup cannot add {M55_TARGET}: run `rustup target add {M55_TARGET}`"
    );
    let mut command = cargo("build --release --target", folder);
    command.arg(M55_TARGET);
    Ok(command)
}

/// The variable with the program that replaces the compiler for the project's own packages.
const WRAPPER: &str = "RUSTC_WORKSPACE_WRAPPER";

/// Makes a cargo command for this computer lint this project's packages that it builds.
pub fn lint(command: &mut Command) {
    command.env(WRAPPER, "clippy-driver");
}

/// Makes a cargo command for the microcontroller lint.
pub fn lint_for_target(command: &mut Command) -> Result<()> {
    match debian::is_chosen() {
        true => drop(command.env(WRAPPER, debian::linter()?)),
        false => lint(command),
    }
    Ok(())
}

/// The version of the compiler for the microcontroller: `rustc 1.95.0 (59807616e 2026-04-14)`.
pub fn target_compiler() -> Result<String> {
    match debian::is_chosen() {
        true => Ok(process::output(debian::rustc().arg("-V"))?
            .trim()
            .to_owned()),
        false => rustc("-V"),
    }
}

/// The output of the compiler for this computer.
pub fn rustc(words: &str) -> Result<String> {
    let program = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let said = process::output(Command::new(program).args(words.split(' ')))?;
    Ok(said.trim().to_owned())
}

fn has_target(target: &str) -> Result<bool> {
    let folder = rustc(&format!("--print target-libdir --target {target}"))?;
    let is_core = |file: std::fs::DirEntry| file.path().display().to_string().contains("/libcore-");
    let files = Path::new(&folder).read_dir();
    Ok(files.is_ok_and(|files| files.flatten().any(is_core)))
}

/// Adds a target to the current toolchain if missing, without a change of version; returns whether
/// it is there then.
fn add_target(target: &str) -> Result<bool> {
    if has_target(target)? {
        return Ok(true);
    }
    let mut add = command("rustup target add");
    let added = process::run(add.arg(target).env("RUSTUP_AUTO_INSTALL", "0"));
    Ok(added.is_ok() && has_target(target)?)
}

/// Ensures that the microcontroller's target is there. If rustup cannot add it, Debian's own
/// compiler is chosen for the microcontroller.
pub fn ensure_target() -> Result<()> {
    if add_target(TARGET)? {
        return Ok(());
    }
    process::say(&format!(
        "rustup cannot add {TARGET}: trying Debian's own packages"
    ));
    debian::choose().with_context(|| {
        format!("no Rust for {TARGET}: run `rustup target add {TARGET}`, or install the packages")
    })
}

/// Ensures that the target of browsers is there.
pub fn ensure_web_target() -> Result<()> {
    let is_there = add_target(WEB_TARGET)?;
    ensure!(
        is_there,
        "rustup cannot add {WEB_TARGET}, which the page needs: run `rustup target add \
         {WEB_TARGET}`, or, without rustup, install your system's package of that target \
         (Debian and Ubuntu: libstd-rust-dev-wasm32)"
    );
    Ok(())
}

/// Whether cargo has a command, such as `clippy`.
pub fn has(verb: &str) -> bool {
    process::succeeds(cargo(verb, "").arg("--version"))
}

/// Ensures that `cargo fmt` or `cargo clippy` exists; rustup adds it if possible.
pub fn ensure_component(verb: &str, component: &str) -> Result<()> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _one = ONE_AT_A_TIME.lock();
    if !has(verb) {
        let added = process::run(command("rustup component add").arg(component));
        added.with_context(|| format!("`cargo {verb}` is missing: install {component}"))?;
    }
    Ok(())
}
