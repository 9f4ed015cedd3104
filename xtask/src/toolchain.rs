//! The compiler and the project's paths: cargo for this computer and for the microcontroller.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use anyhow::{Context, Result, ensure};

use crate::debian;
use crate::process::{self, command};

/// The microcontroller's target: Cortex-M7 with a double-precision FPU.
pub const TARGET: &str = "thumbv7em-none-eabihf";
/// The target of a Cortex-M55, which only QEMU runs.
pub const M55_TARGET: &str = "thumbv8m.main-none-eabihf";
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

/// `cargo build` for a microcontroller's target, as for flashing.
pub fn build_for(target: &str, folder: &str) -> Command {
    let mut command = cargo("build --release --target", folder);
    command.arg(target);
    match target {
        TARGET => debian::instead(command),
        _ => command,
    }
}

/// Makes a cargo command lint this project's packages that it builds.
pub fn lint(command: &mut Command) {
    let linter = match debian::runs(command) {
        true => debian::CLIPPY,
        false => "clippy-driver",
    };
    command.env("RUSTC_WORKSPACE_WRAPPER", linter);
}

/// The version of the compiler for the microcontroller: `rustc 1.95.0 (59807616e 2026-04-14)`.
pub fn target_compiler() -> Result<String> {
    match debian::chosen() {
        Some(mut compiler) => Ok(process::output(compiler.arg("-V"))?.trim().to_owned()),
        None => rustc("-V"),
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

/// Adds a target to the current toolchain if missing, without a change of version.
pub fn ensure_target(target: &str) -> Result<()> {
    if has_target(target)? {
        return Ok(());
    }
    let mut add = command("rustup target add");
    let added = process::run(add.arg(target).env("RUSTUP_AUTO_INSTALL", "0"));
    ensure!(
        added.is_ok() && has_target(target)?,
        "rustup cannot add {target}: run `rustup target add {target}`; without rustup, install your \
         system's package of it (Debian and Ubuntu for the page: libstd-rust-dev-wasm32)"
    );
    Ok(())
}

/// Ensures that the microcontroller's target is there. If rustup cannot add it, Debian's own
/// compiler is chosen for the microcontroller.
pub fn ensure_microcontroller() -> Result<()> {
    ensure_target(TARGET).or_else(|missing| {
        process::say(&format!("{missing:#}; trying Debian's own packages"));
        debian::choose().context(missing)
    })
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
