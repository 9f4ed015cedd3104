//! Writes a study's results: a page under `docs/results` with its pictures, or one JSON object.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

/// The lines of a page between which its results are.
const MARKS: [&str; 2] = ["<!-- results: begin -->\n", "\n<!-- results: end -->"];

/// Writes results into their page, in place of those before.
pub fn write(name: &str, results: &str) -> Result<()> {
    let path = Path::new("docs/results").join(name);
    let page = fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}: run it in the project", path.display()))?;
    let page = with_results(&page, results).context("the page has no place for its results")?;
    fs::write(&path, page).with_context(|| format!("cannot write {}", path.display()))?;
    println!("wrote {}", path.display());
    Ok(())
}

/// A page with these results; `None` if it has no place for them.
fn with_results(page: &str, results: &str) -> Option<String> {
    let [begin, end] = MARKS;
    let (before, rest) = page.split_once(begin)?;
    let (_, after) = rest.split_once(end)?;
    Some(format!("{before}{begin}\n{}\n{end}{after}", results.trim()))
}

/// Prints `{"rows":[…]}` on one line.
pub fn print_rows(rows: &[impl Serialize]) -> Result<()> {
    let report = BTreeMap::from([("rows", rows)]);
    println!("{}", serde_json::to_string(&report)?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_take_the_place_of_those_before() {
        let page = |results| format!("# A\n\n{}\n{results}\n{}\n", MARKS[0], MARKS[1]);
        assert_eq!(with_results(&page("old"), "new\n"), Some(page("new")));
        assert_eq!(with_results("# A\n", "new"), None);
    }

    #[test]
    fn each_page_has_a_place_for_its_results() {
        let pages = ["units", "real-films", "contacts", "touches", "anywhere"];
        for page in pages {
            let file = format!("../docs/results/{page}.md");
            let text = fs::read_to_string(&file).unwrap();
            let (_, rest) = text.split_once(MARKS[0]).unwrap();
            let (results, _) = rest.split_once(MARKS[1]).unwrap();
            assert_eq!(with_results(&text, results).as_ref(), Some(&text), "{file}");
        }
    }
}
