//! What is measured: scripts that `benchmark-cases` (in `tests`) writes.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::{artifacts, process, toolchain};

/// One script, as `benchmark-cases` describes it.
#[derive(Debug, Deserialize)]
pub struct Case {
    /// What it runs.
    pub work: Work,
    /// Its script.
    pub file: PathBuf,
    /// Columns and rows of the frame, or of the frames that the model is for.
    pub size: [u64; 2],
    /// Pixel format of that frame: `rgb565`, `yuv422` or `mono`.
    pub format: String,
}

/// What a case runs.
#[derive(Debug, Deserialize)]
pub enum Work {
    /// One frame, from its first row to the force; what is special about it, empty for the usual
    /// one.
    Frame(String),
    /// One inference of a model with these layer widths.
    Network(Vec<u64>),
    /// The network of a model that tells places, and so many steps from its answer.
    Steps(u64),
    /// The threshold's table of 64 KiB, made once for each threshold.
    Table,
}

impl Case {
    /// `320x240`
    pub fn frame(&self) -> String {
        let [width, height] = self.size;
        format!("{width}x{height}")
    }
}

/// Writes all scripts into a folder.
pub fn write(folder: &Path) -> Result<Vec<Case>> {
    let mut command = Command::new(artifacts::benchmark_cases()?);
    let lines = process::output(command.current_dir(toolchain::at("")).arg(folder))?;
    let case = |line| serde_json::from_str(line).with_context(|| format!("the case `{line}`"));
    lines.lines().map(case).collect()
}
