//! Writes a study's results: a page under `docs/results` with its pictures, or one JSON object.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

/// The mark in a page that the results replace.
const PLACE: &str = "<!-- results -->";

/// Writes a page: `text` with the results in place of the mark.
pub fn write(name: &str, text: &str, results: &str) -> Result<()> {
    let (before, after) = text
        .split_once(PLACE)
        .context("the page has no place for its results")?;
    let path = Path::new("docs/results").join(name);
    fs::write(&path, format!("{before}{}{after}", results.trim_end()))
        .with_context(|| format!("cannot write {}: run it in the project", path.display()))?;
    println!("wrote {}", path.display());
    Ok(())
}

/// Prints `{"rows":[…]}` on one line.
pub fn print_rows(rows: &[impl Serialize]) -> Result<()> {
    let report = BTreeMap::from([("rows", rows)]);
    println!("{}", serde_json::to_string(&report)?);
    Ok(())
}
