//! Tests that `docs/troubleshooting.md` names every fault, with what to do.

use hivtac_host::failure::Kind;
use hivtac_wire::usb::{PRODUCT_ID, VENDOR_ID};
use std::path::Path;

pub fn root_file(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let text = std::fs::read_to_string(root.join(name));
    text.unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The three cells of the table's row with this first cell; none of them is empty.
pub fn row<'t>(text: &'t str, first: &str) -> [&'t str; 3] {
    let begin = format!("| {first} |");
    let mut rows = text.lines().filter(|line| line.starts_with(&begin));
    let row = rows.next();
    let row = row.unwrap_or_else(|| panic!("docs/troubleshooting.md lacks {first}"));
    assert_eq!(rows.next(), None, "{first} stands there twice");
    let cells = row.trim_matches('|').split(" | ").map(str::trim);
    let cells: Vec<_> = cells.collect();
    let three = <[&str; 3]>::try_from(cells);
    let three = three.unwrap_or_else(|cells| panic!("a row has three cells: {cells:?}"));
    assert!(three.iter().all(|cell| !cell.is_empty()), "{three:?}");
    three
}

/// The first cells of a table's rows, without its head.
pub fn first_cells(text: &str) -> Vec<String> {
    let rows = text.lines().filter_map(|line| line.strip_prefix("| "));
    let cells = rows.skip(1).filter_map(|row| row.split(" | ").next());
    cells.map(str::to_owned).collect()
}

/// The text between two headings of the same level.
pub fn section<'t>(text: &'t str, heading: &str) -> &'t str {
    let begin = format!("\n## {heading}\n");
    let (_, rest) = text
        .split_once(&begin)
        .unwrap_or_else(|| panic!("no {heading}"));
    rest.split("\n## ").next().unwrap()
}

#[test]
fn every_exit_code_has_its_meaning() {
    let text = root_file("docs/troubleshooting.md");
    let text = section(&text, "Exit codes of hivtac");
    for kind in Kind::ALL {
        let [_, meaning, _] = row(text, &kind.exit_code().to_string());
        assert_eq!(meaning, kind.meaning());
    }
    // One row for each kind, one for success, and the table's head.
    assert_eq!(text.matches("\n| ").count(), Kind::ALL.len() + 2);
}

/// By the names of the enumeration's variants; `messages.rs` provokes each.
#[test]
fn every_refusal_has_its_row() {
    let source = root_file("wire/src/message.rs");
    let (_, rest) = source.split_once("pub enum Outcome {").unwrap();
    let (body, _) = rest.split_once("\n}").unwrap();
    // The fields of a variant are indented further.
    let lines = body.lines().filter_map(|line| line.strip_prefix("    "));
    let variants = lines.filter(|line| line.starts_with(char::is_uppercase));
    let names = variants.map(|line| line.trim_end_matches([',', '{', ' ']));
    let refusals: Vec<_> = names.filter(|name| *name != "Done").collect();
    let text = root_file("docs/troubleshooting.md");
    let text = section(&text, "What a device refuses");
    let rows = first_cells(text);
    for name in &refusals {
        assert!(rows.contains(&format!("`{name}`")), "the page lacks {name}");
    }
    assert_eq!(rows.len(), refusals.len());
}

/// By the table at the head of the source file with the patterns.
#[test]
fn every_pattern_of_the_led_has_its_meaning() {
    let source = root_file("firmware/src/led.rs");
    let table = source
        .lines()
        .filter_map(|line| line.strip_prefix("//! | "));
    let rows: Vec<_> = table
        .skip(1)
        .filter_map(|line| line.split_once(" | "))
        .collect();
    assert_eq!(rows.len(), 5, "{rows:?}");
    let text = root_file("docs/troubleshooting.md");
    let text = section(&text, "The LED");
    for (pattern, meaning) in rows {
        let [_, reported, _] = row(text, pattern);
        let meaning = meaning.trim_end_matches(" |").split(": `").next().unwrap();
        assert_eq!(reported, meaning, "{pattern}");
    }
}

#[test]
fn the_udev_rule_is_for_this_device() {
    let rule = root_file("docs/70-hivtac.rules");
    for (key, id) in [("idVendor", VENDOR_ID), ("idProduct", PRODUCT_ID)] {
        assert!(
            rule.contains(&format!("ATTRS{{{key}}}==\"{id:04x}\"")),
            "{rule}"
        );
    }
}
