//! Where things lie in the project.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use crate::{process, toolchain};

/// The project's root folder: the one above this package.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap_or(Path::new("."))
}

/// A folder of the project, named from the root.
pub fn folder(name: &str) -> PathBuf {
    root().join(name)
}

/// A folder for what `cargo xtask` makes, below the target directory in use.
pub fn work_folder(name: &str) -> Result<PathBuf> {
    let mut command = toolchain::cargo("metadata", root());
    command.args(["--no-deps", "--format-version", "1"]);
    let metadata: serde_json::Value = serde_json::from_str(&process::output(&mut command)?)
        .context("`cargo metadata` printed something else than JSON")?;
    let target = metadata["target_directory"]
        .as_str()
        .context("`cargo metadata` names no target directory")?;
    let folder = Path::new(target).join("xtask").join(name);
    std::fs::create_dir_all(&folder).with_context(|| format!("creating {}", folder.display()))?;
    Ok(folder)
}
