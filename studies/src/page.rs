//! Pages under `docs/results`.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

/// Where a page's results go.
const PLACE: &str = "<!-- results -->";

/// Writes a page: its text with the results in their place.
///
/// # Errors
/// When the text has no such place, or the page cannot be written.
pub fn write(name: &str, text: &str, results: &str) -> Result<()> {
    let (before, after) = text
        .split_once(PLACE)
        .context("the page has no place for its results")?;
    let path = Path::new("docs/results").join(name);
    fs::write(&path, format!("{before}{}{after}", results.trim_end())).with_context(|| {
        format!(
            "cannot write {}: run it in the project's folder",
            path.display()
        )
    })?;
    println!("wrote {}", path.display());
    Ok(())
}
