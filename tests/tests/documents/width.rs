//! Lines of text are at most [`WIDEST`] columns wide.

use std::collections::BTreeSet;
use std::fs;

use hivtac_tests::workspaces::{files, root};

/// In characters.
const WIDEST: usize = 100;

/// Endings of the files that are read; data, lock files and pictures are not.
const TEXT: [&str; 7] = [".rs", ".md", ".toml", ".py", ".sh", ".s", ".x"];

#[test]
fn no_line_is_too_wide() {
    let mut wide = Vec::new();
    for name in TEXT.iter().flat_map(|ending| files(ending)) {
        let text = fs::read_to_string(root().join(&name)).unwrap();
        let lines = too_wide(&name, &text).into_iter();
        wide.extend(lines.map(|line| format!("{name}:{line}")));
    }
    assert!(wide.is_empty(), "more than {WIDEST} columns: {wide:#?}");
}

/// The lines of a file that are too wide, from 1. Rows of tables, addresses, fenced blocks and
/// generated text may be: breaking these is impossible or makes them worse. In Rust only comments
/// are checked: rustfmt breaks the rest where it can.
fn too_wide(name: &str, text: &str) -> Vec<usize> {
    let may_be = match name.ends_with(".md") {
        true => fenced_or_written(text),
        false => BTreeSet::new(),
    };
    let is_wide = |line: &str| {
        let words = line.trim_start();
        let is_code = name.ends_with(".rs") && !words.starts_with("//");
        let words = words.trim_start_matches(['/', '!']).trim_start();
        let is_row = ["| ", "|-", "|:"].iter().any(|row| words.starts_with(row));
        let words = line.split(' ').filter(|word| word.contains("://"));
        let address: usize = words.map(|word| word.chars().count()).sum();
        !is_code && !is_row && line.chars().count() - address > WIDEST
    };
    let wide = (1..).zip(text.lines()).filter(|(_, line)| is_wide(line));
    let wide = wide.map(|(number, _)| number);
    wide.filter(|number| !may_be.contains(number)).collect()
}

/// The lines of a document, from 1, that are in a fenced block or that a program wrote.
fn fenced_or_written(text: &str) -> BTreeSet<usize> {
    let (mut fenced, mut written) = (false, false);
    let mut found = BTreeSet::new();
    for (number, line) in (1..).zip(text.lines()) {
        let words = line.trim_start();
        fenced ^= words.starts_with("```");
        if words.starts_with("<!--") {
            written = words.contains(": begin");
        }
        if fenced || written {
            found.insert(number);
        }
    }
    found
}

#[test]
fn lines_are_wide_from_a_hundred_and_one_characters_on_where_they_can_be_broken() {
    let wide = "é ".repeat(WIDEST / 2) + "é";
    let address = format!("see https://example.org/{wide}", wide = "a".repeat(WIDEST));
    let text = format!("{}\n{wide}\n| {wide} |\n{address}\n", "é".repeat(WIDEST));
    assert_eq!(too_wide("a.md", &text), [2]);
    assert_eq!(
        too_wide("a.rs", &format!("// {wide}\n/// | {wide} |\nr\"{wide}\"\n")),
        [1]
    );
    let fenced = format!("```console\n{wide}\n```\n{wide}\n");
    assert_eq!(too_wide("a.md", &fenced), [4]);
    let written = format!("<!-- a: begin, by x -->\n{wide}\n<!-- a: end -->\n{wide}\n");
    assert_eq!(too_wide("a.md", &written), [4]);
}
