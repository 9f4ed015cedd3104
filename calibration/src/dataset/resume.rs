//! Data sets that go on where they were interrupted.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::file::{lines, opening};
use super::generate::Renderer;
use super::{Dataset, Recipe};

/// Rows that are rendered before they are written.
const BLOCK: usize = 512;

/// Writes the data set of a recipe to a file, block by block, and reads it back. What an interrupted run left there is
/// kept: the file ends up the same. `progress` is told the number of rows that are done, from any thread.
///
/// # Errors
/// When the file is another data set or cannot be written, or the recipe asks for what the scene cannot do.
pub fn generate_file(
    recipe: &Recipe,
    path: &Path,
    progress: impl Fn(u64) + Sync,
) -> Result<Dataset> {
    let opening = opening(&recipe.about()?)?;
    let renderer = Renderer::new(recipe)?;
    let done = resume(path, &opening, recipe.rows())
        .with_context(|| format!("cannot go on with {}", path.display()))?;
    progress(done as u64);
    let mut file = OpenOptions::new().append(true).open(path)?;
    for first in (done..recipe.rows()).step_by(BLOCK) {
        let rows = renderer.rows(first..(first + BLOCK).min(recipe.rows()), || progress(1))?;
        file.write_all(&lines(&rows)?)
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Dataset::load(path)
}

/// Makes the file hold its opening and whole rows only; how many.
fn resume(path: &Path, opening: &str, rows: usize) -> Result<usize> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(error.into()),
    };
    // An interrupted run may have left a part of the opening, too.
    if opening.as_bytes().starts_with(&bytes) {
        fs::write(path, opening)?;
        return Ok(0);
    }
    ensure!(
        bytes.starts_with(opening.as_bytes()),
        "it is there and holds something else: remove it, or use another name"
    );
    let whole = bytes
        .iter()
        .rposition(|&byte| byte == b'\n')
        .map_or(0, |end| end + 1);
    let done = bytes[opening.len()..whole]
        .iter()
        .filter(|&&byte| byte == b'\n')
        .count();
    ensure!(done <= rows, "it has {done} rows, and {rows} are wanted");
    let file: File = OpenOptions::new().write(true).open(path)?;
    file.set_len(whole as u64)?;
    Ok(done)
}

#[cfg(test)]
mod tests {
    use super::super::Loads;
    use super::*;

    fn recipe() -> Recipe {
        Recipe {
            loads: Loads::Random(20),
            rest: 2,
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
