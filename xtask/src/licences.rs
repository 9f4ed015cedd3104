//! Licences and sources of packages from elsewhere, as `deny.toml` allows them, where cargo-deny is
//! installed.

use anyhow::Result;

use crate::toolchain::cargo;
use crate::{process, workspace};

/// Why they cannot be checked here; nothing when they can.
pub fn obstacle() -> Option<&'static str> {
    let has_cargo_deny = process::succeeds(cargo("deny", workspace::root()).arg("--version"));
    (!has_cargo_deny).then_some("cargo-deny is not installed: `cargo install cargo-deny`")
}

/// Checks these workspaces. Known flaws (`cargo deny check advisories`) are left out: which there
/// are needs the network, and changes from day to day.
///
/// # Errors
/// When one has a package of another licence or source.
pub fn check<'w>(folders: impl Iterator<Item = &'w str>) -> Result<()> {
    for folder in folders {
        let mut command = cargo("deny", &workspace::folder(folder));
        command.args(["--log-level", "error", "--config"]);
        command.arg(workspace::folder("deny.toml"));
        process::run(command.args(["check", "licenses", "bans", "sources"]))?;
    }
    Ok(())
}
