//! Shows a sensor in Rerun, by Python's `hivtac`: its `rerun-sdk` brings the viewer with it.

use super::{ServeArguments, usage};
use hivtac_host::failure::Failure;
use hivtac_host::shown::shown;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const MODULE: &str = "hivtac.rerun";

/// Goes on as the Python program, or waits for its end.
///
/// # Errors
/// When several sensors are to be shown, or Python or its package is missing.
pub fn run(arguments: &ServeArguments) -> Result<(), Failure> {
    let words = arguments.devices.words();
    if words.len() > 2 {
        return Err(usage("Rerun is served one sensor; run it once for each"));
    }
    let python = python();
    check(&python)?;
    let mut command = Command::new(&python);
    command.args(["-m", MODULE]).args(words);
    become_it(command.args(&arguments.rerun_options))
}

/// The Python next to this program, as in a wheel, otherwise that of the path.
fn python() -> PathBuf {
    let name = format!("python{}", if cfg!(windows) { ".exe" } else { "3" });
    let beside = std::env::current_exe().map(|program| program.with_file_name(&name));
    let beside = beside.ok().filter(|program| program.is_file());
    beside.unwrap_or_else(|| PathBuf::from(name))
}

/// An error if this Python lacks the module.
fn check(python: &PathBuf) -> Result<(), Failure> {
    let mut import = Command::new(python);
    import.args(["-c", &format!("import {MODULE}")]);
    let tried = import.stdin(Stdio::null()).output();
    let said = match tried {
        Ok(output) if output.status.success() => return Ok(()),
        Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
        Err(error) => error.to_string(),
    };
    let cause = said.lines().last().unwrap_or_default();
    Err(usage(&format!(
        "Rerun is served by Python's hivtac, which {} cannot use ({}): pip install \
         \"hivtac[rerun]\", in a checkout pip install \"./host-tool/python[rerun]\"",
        python.display(),
        shown(cause)
    )))
}

#[cfg(unix)]
fn become_it(command: &mut Command) -> Result<(), Failure> {
    let error = std::os::unix::process::CommandExt::exec(command);
    Err(Failure::input(format!("cannot start Python: {error}")))
}

#[cfg(not(unix))]
fn become_it(command: &mut Command) -> Result<(), Failure> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Failure::input(format!("{MODULE} ended with {status}"))),
        Err(error) => Err(Failure::input(format!("cannot start Python: {error}"))),
    }
}
