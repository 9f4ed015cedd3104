//! Finds the programs that the tests run. `cargo xtask test` builds them and names them in
//! environment variables.

use std::env;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::string::String;

/// Starts a program, and waits for its first line, `ready ADDRESS`. Returns the address, too.
///
/// # Panics
/// If it cannot be started, or says something else.
pub fn ready(command: &mut Command) -> (Child, String) {
    let mut process = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut said = String::new();
    let stdout = process.stdout.take().unwrap();
    BufReader::new(stdout).read_line(&mut said).unwrap();
    let address = said.trim().strip_prefix("ready ").expect("an address");
    (process, String::from(address))
}

/// Returns the file or folder that an environment variable names.
///
/// # Panics
/// If the variable is not set: the test cannot run, and must not pass.
pub fn named_by(variable: &str) -> PathBuf {
    let path = env::var_os(variable).map(PathBuf::from);
    let path = path
        .unwrap_or_else(|| panic!("{variable} is not set: run the tests by `cargo xtask test`"));
    assert!(
        path.exists(),
        "{variable} names {}, which does not exist",
        path.display()
    );
    path
}
