//! `README.md` is short, and begins with pictures.

use std::fs;

use hivtac_tests::workspaces::root;

/// Most lines of it.
const LONGEST: usize = 150;
/// Its first picture stands within so many lines.
const FIRST_PICTURE: usize = 12;
/// Most rows of its table of figures.
const MOST_FIGURES: usize = 3;

#[test]
fn it_is_short_and_begins_with_pictures() {
    let text = fs::read_to_string(root().join("README.md")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(
        lines.len() <= LONGEST,
        "README.md has {} lines",
        lines.len()
    );
    let first = lines.iter().position(|line| line.starts_with("!["));
    assert!(first.is_some_and(|line| line < FIRST_PICTURE), "{first:?}");
}

/// Each figure with the page that it is from.
#[test]
fn its_figures_are_few_and_from_pages_that_have_them() {
    let text = fs::read_to_string(root().join("README.md")).unwrap();
    let (_, rest) = text.split_once("\n## What it measures, so far\n").unwrap();
    let section = rest.split("\n## ").next().unwrap();
    let rows: Vec<&str> = section
        .lines()
        .filter(|line| line.starts_with("| "))
        .skip(1)
        .collect();
    assert!((1..=MOST_FIGURES).contains(&rows.len()), "{rows:?}");
    for row in rows {
        let (_, link) = row.rsplit_once("](docs/results/").expect(row);
        let page = link.split(')').next().unwrap();
        assert!(root().join("docs/results").join(page).is_file(), "{row}");
    }
}
