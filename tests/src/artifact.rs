//! Finds the programs that the tests run. `cargo xtask test` builds them and names them in
//! environment variables.

use std::{env, path::PathBuf};

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
