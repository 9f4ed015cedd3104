//! Lines of the committed text that are wider than [`WIDEST`].

use std::collections::BTreeSet;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::{process, raw_strings, workspace};

/// Columns of the widest line, in characters.
const WIDEST: usize = 100;

/// Endings of the files that are read; data, lock files and pictures are not.
const TEXT: [&str; 9] = [
    ".rs", ".md", ".toml", ".py", ".sh", ".yml", ".s", ".x", "/run",
];

/// A line that is too wide.
#[derive(Debug, PartialEq, Eq)]
struct Wide {
    /// From 1.
    line: usize,
    columns: usize,
}

/// Reads every committed text file.
///
/// # Errors
/// When a line is too wide: each was named, with its length.
pub fn check() -> Result<()> {
    let mut count = 0;
    for name in committed()? {
        let path = workspace::folder(&name);
        let text = std::fs::read_to_string(&path)
            .with_context(|| format!("reading {}", path.display()))?;
        for Wide { line, columns } in too_wide(&name, &text) {
            eprintln!("{name}:{line}: {columns} columns");
            count += 1;
        }
    }
    if count > 0 {
        bail!("{count} lines have more than {WIDEST} columns");
    }
    Ok(())
}

/// The text files that git knows and that are there, from the root.
fn committed() -> Result<Vec<String>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z"]).current_dir(workspace::root());
    let names = process::output(&mut git)?;
    let is_text = |name: &&str| TEXT.iter().any(|ending| name.ends_with(ending));
    let is_there = |name: &&str| workspace::folder(name).is_file();
    let names = names.split('\0').filter(is_text).filter(is_there);
    Ok(names.map(str::to_owned).collect())
}

/// The lines of a file that are too wide. Rows of tables, addresses, fenced blocks, what programs
/// wrote into a document, and raw strings may be: breaking these is impossible or makes them worse.
fn too_wide(name: &str, text: &str) -> Vec<Wide> {
    let is_document = name.ends_with(".md");
    let verbatim = match name.rsplit_once('.') {
        Some((_, "md")) => fenced_or_written(text),
        Some((_, "rs")) => raw_strings::lines(text),
        _ => BTreeSet::new(),
    };
    let wide = (1..).zip(text.lines()).filter_map(|(line, text)| {
        let columns = text.chars().count();
        let may_be = verbatim.contains(&line) || is_row(is_document, text);
        let is_wide = !may_be && columns - in_addresses(text) > WIDEST;
        is_wide.then_some(Wide { line, columns })
    });
    wide.collect()
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

/// Whether a line is a row of a Markdown table, in a document or in a comment.
fn is_row(is_document: bool, line: &str) -> bool {
    let words = line.trim_start();
    let comment = || {
        ["//!", "///"]
            .into_iter()
            .find_map(|mark| words.strip_prefix(mark))
    };
    let text = if is_document { Some(words) } else { comment() };
    let begins = ["| ", "|-", "|:"];
    text.is_some_and(|text| begins.iter().any(|row| text.trim_start().starts_with(row)))
}

/// Characters of a line that belong to web addresses.
fn in_addresses(line: &str) -> usize {
    let words = line.split(' ').filter(|word| word.contains("://"));
    words.map(|word| word.chars().count()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(name: &str, text: &str) -> Vec<usize> {
        too_wide(name, text).iter().map(|wide| wide.line).collect()
    }

    #[test]
    fn a_line_of_a_hundred_characters_is_narrow_enough() {
        let wide = "é".repeat(WIDEST + 1);
        let text = format!("short\n{}\n{wide}\n", "é".repeat(WIDEST));
        let columns = WIDEST + 1;
        assert_eq!(too_wide("a.rs", &text), [Wide { line: 3, columns }]);
    }

    #[test]
    fn rows_of_tables_may_be_wide() {
        let row = format!("| {} |", "a".repeat(WIDEST));
        let text = format!(
            "    /// {row}\n//! {row}\n{row}\n/// {}\n",
            row.replace(' ', "")
        );
        assert!(lines("a.md", &row).is_empty());
        assert_eq!(lines("a.rs", &text), [3, 4]);
    }

    #[test]
    fn addresses_count_for_nothing() {
        let address = format!("https://example.org/{}", "a".repeat(WIDEST));
        assert!(lines("a.md", &format!("see {address}")).is_empty());
        let wide = format!("{} {address}", "a".repeat(WIDEST));
        assert_eq!(lines("a.md", &wide), [1]);
    }

    #[test]
    fn fenced_blocks_and_what_programs_wrote_may_be_wide_and_what_follows_may_not() {
        let wide = "a ".repeat(WIDEST);
        let fenced = format!("```console\n{wide}\n```\n{wide}\n```text a\n{wide}\n```\n{wide}\n");
        assert_eq!(lines("a.md", &fenced), [4, 8]);
        let written = format!("<!-- a: begin, by x -->\n{wide}\n<!-- a: end -->\n{wide}\n");
        assert_eq!(lines("a.md", &written), [4]);
        assert_eq!(lines("a.rs", &written), [2, 4]);
    }

    #[test]
    fn raw_strings_may_be_wide_in_rust_and_fenced_blocks_of_its_comments_may_not() {
        let wide = "a".repeat(WIDEST);
        let raw = format!("r\"{wide}\n{wide}b\nc {wide}\"; d\n\"{wide}\"\n");
        assert_eq!(lines("a.rs", &raw), [4]);
        assert_eq!(lines("a.py", &raw), [1, 2, 3, 4]);
        let fenced = format!("//! ```text\n//! {wide}\n//! ```\n");
        assert_eq!(lines("a.rs", &fenced), [2]);
    }
}
