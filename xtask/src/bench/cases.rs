//! What is measured: scripts that `benchmark-cases` (in `tests`) writes.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use serde::Deserialize;

use crate::{artifacts, process, workspace};

/// One script, as `benchmark-cases` describes it.
#[derive(Clone, Debug, Deserialize)]
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
#[derive(Clone, Debug, Deserialize)]
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

    /// True for a frame that has nothing special.
    pub fn is_usual_frame(&self) -> bool {
        matches!(&self.work, Work::Frame(special) if special.is_empty())
    }
}

/// Multiplications of an inference.
pub fn multiplications(widths: &[u64]) -> u64 {
    widths.windows(2).map(|pair| pair[0] * pair[1]).sum()
}

/// Neurons of a model.
pub fn neurons(widths: &[u64]) -> u64 {
    widths.iter().skip(1).sum()
}

/// Writes all scripts into a folder.
///
/// # Errors
/// When they cannot be made.
pub fn write(folder: &Path) -> Result<Vec<Case>> {
    write_frames(folder, &[])
}

/// Writes frames of the demo's scene at these times, in µs; of none, what [`write`] does.
///
/// # Errors
/// When they cannot be made.
pub fn write_frames(folder: &Path, times_us: &[u64]) -> Result<Vec<Case>> {
    let times: Vec<String> = times_us.iter().map(u64::to_string).collect();
    describe(folder, &times)
}

fn describe(folder: &Path, which: &[String]) -> Result<Vec<Case>> {
    let mut command = Command::new(artifacts::benchmark_cases()?);
    command.current_dir(workspace::root()).arg(folder);
    process::show(command.args(which));
    let lines = process::output(&mut command)?;
    lines
        .lines()
        .map(|line| serde_json::from_str(line).with_context(|| format!("reading the case {line}")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_network_has_so_many_multiplications() {
        assert_eq!(multiplications(&[11, 64, 64, 3]), 4_992);
        assert_eq!(neurons(&[11, 64, 64, 3]), 131);
    }

    #[test]
    fn cases_are_read() {
        let line =
            r#"{"work":{"Frame":""},"file":"/t/0.script","size":[320,240],"format":"rgb565"}"#;
        let case: Case = serde_json::from_str(line).unwrap();
        assert!(case.is_usual_frame());
        assert_eq!(case.frame(), "320x240");
    }
}
