//! Generates data sets and continues them after an interruption.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::file::{lines, opening};
use super::generate::Renderer;
use super::{About, Dataset, Recipe};

/// Rows that are rendered before each write.
const BLOCK: usize = 512;

/// A data set that is being written to a file.
struct Target {
    path: PathBuf,
    about: About,
    opening: String,
}

impl Target {
    fn of(path: PathBuf, about: About) -> Result<Self> {
        Ok(Self {
            path,
            opening: opening(&about)?,
            about,
        })
    }
}

/// Writes the data set of a recipe to a file, block by block, and reads it back. Rows of an
/// interrupted run are kept: the file ends up the same. `progress` gets the number of finished
/// rows, from any thread.
///
/// # Errors
/// When the file is a different data set or cannot be written, or the scene does not support the
/// recipe.
pub fn generate_file(
    recipe: &Recipe,
    path: &Path,
    progress: impl Fn(u64) + Sync,
) -> Result<Dataset> {
    let target = Target::of(path.into(), recipe.about()?)?;
    let renderer = Renderer::new(recipe)?;
    let done = target.begin(recipe.rows());
    let done = done.with_context(|| target.stuck())?;
    target.cut(done).with_context(|| target.stuck())?;
    progress(done as u64);
    for first in (done..recipe.rows()).step_by(BLOCK) {
        let range = first..(first + BLOCK).min(recipe.rows());
        let rows = renderer.rows(range, || progress(1))?;
        let mut file = OpenOptions::new().append(true).open(path)?;
        file.write_all(&lines(&target.about, &rows)?)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Dataset::load(path)
}

impl Target {
    fn stuck(&self) -> String {
        format!("cannot go on with {}", self.path.display())
    }

    /// Makes the file begin with its header, and returns the number of its whole rows.
    fn begin(&self, rows: usize) -> Result<usize> {
        let bytes = match fs::read(&self.path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(error.into()),
        };
        // An interrupted run may have written a part of the header.
        if self.opening.as_bytes().starts_with(&bytes) {
            fs::write(&self.path, &self.opening)?;
            return Ok(0);
        }
        ensure!(
            bytes.starts_with(self.opening.as_bytes()),
            "it is there and holds something else: remove it, or use another name"
        );
        let done = ends(&bytes[self.opening.len()..]).count();
        ensure!(done <= rows, "it has {done} rows, and {rows} are wanted");
        Ok(done)
    }

    /// Removes all rows after the first `rows`.
    fn cut(&self, rows: usize) -> Result<()> {
        let bytes = fs::read(&self.path)?;
        let start = self.opening.len();
        let end = match rows.checked_sub(1) {
            None => Some(0),
            Some(last) => ends(&bytes[start..]).nth(last),
        };
        let end = end.context("it has changed meanwhile")?;
        let file = OpenOptions::new().write(true).open(&self.path)?;
        file.set_len((start + end) as u64)?;
        Ok(())
    }
}

/// Where each whole line ends.
fn ends(bytes: &[u8]) -> impl Iterator<Item = usize> {
    let ends = bytes.iter().enumerate();
    ends.filter(|(_, byte)| **byte == b'\n').map(|(i, _)| i + 1)
}

#[cfg(test)]
mod tests {
    use super::super::Loads;
    use super::*;
    use crate::data::range::Range;

    fn recipe() -> Recipe {
        Recipe {
            loads: Loads::Random(20),
            rest: 2,
            range: Range::default(),
            sessions: 2,
            ..Recipe::default()
        }
    }

    #[test]
    fn an_interrupted_file_ends_up_the_same() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("data.csv");
        let whole = generate_file(&recipe(), &path, |_| ()).unwrap();
        assert_eq!(whole.rows.len(), 44);
        let bytes = fs::read(&path).unwrap();
        for length in [0, 10, 400, bytes.len() / 2, bytes.len() - 1, bytes.len()] {
            fs::write(&path, &bytes[..length]).unwrap();
            assert_eq!(generate_file(&recipe(), &path, |_| ()).unwrap(), whole);
            assert!(
                fs::read(&path).unwrap() == bytes,
                "cut after {length} bytes"
            );
        }
    }

    #[test]
    fn another_data_set_is_left_alone() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("data.csv");
        generate_file(&recipe(), &path, |_| ()).unwrap();
        let before = fs::read(&path).unwrap();
        let other = Recipe {
            seed: 2,
            ..recipe()
        };
        let error = format!("{:#}", generate_file(&other, &path, |_| ()).unwrap_err());
        assert!(error.contains("something else"), "{error}");
        assert!(fs::read(&path).unwrap() == before);
    }
}
