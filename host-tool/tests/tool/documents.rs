//! Tests that `docs/troubleshooting.md` names every fault, with what to do.

use hivtac_host::failure::Kind;
use hivtac_host::reply::judge;
use hivtac_terms::status::Status;
use hivtac_wire::message::Outcome;
use hivtac_wire::usb::{PRODUCT_ID, VENDOR_ID};
use std::path::Path;

fn root_file(name: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let text = std::fs::read_to_string(root.join(name));
    text.unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The three cells of the table's row with this first cell; none of them is empty.
fn row<'t>(text: &'t str, first: &str) -> [&'t str; 3] {
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

/// The text between two headings of the same level.
fn section<'t>(text: &'t str, heading: &str) -> &'t str {
    let begin = format!("\n## {heading}\n");
    let (_, rest) = text
        .split_once(&begin)
        .unwrap_or_else(|| panic!("no {heading}"));
    rest.split("\n## ").next().unwrap()
}

#[test]
fn every_status_has_its_cause_and_what_to_do() {
    let text = root_file("docs/troubleshooting.md");
    let text = section(&text, "Status");
    for (bit, name) in Status::NAMES {
        let [_, cause, _] = row(text, &format!("`{name}`"));
        let takes_force = Status::NO_FORCE.contains(*bit);
        assert_eq!(
            cause.starts_with("no force: "),
            takes_force,
            "{name}: {cause}"
        );
    }
    assert_eq!(text.matches("\n| `").count(), Status::NAMES.len());
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

/// By the names of the enumeration's variants, and the tool's words for them.
#[test]
fn every_refusal_has_its_words_and_what_to_do() {
    let source = root_file("wire/src/message.rs");
    let (_, rest) = source.split_once("pub enum Outcome {").unwrap();
    let (body, _) = rest.split_once("\n}").unwrap();
    // The fields of a variant are indented further.
    let lines = body.lines().filter_map(|line| line.strip_prefix("    "));
    let variants = lines.filter(|line| line.starts_with(char::is_uppercase));
    let names: Vec<_> = variants
        .map(|line| line.trim_end_matches([',', '{', ' ']))
        .collect();
    assert!(names.len() > 10, "{names:?}");
    let text = root_file("docs/troubleshooting.md");
    let text = section(&text, "What a device refuses");
    for name in &names {
        let outcome = match *name {
            "Touched" => r#"{"Touched": {"looks_like": 1200}}"#.to_owned(),
            _ => format!("\"{name}\""),
        };
        let outcome: Outcome = serde_json::from_str(&outcome).unwrap();
        let Err(refusal) = judge("x", outcome) else {
            assert_eq!(*name, "Done");
            continue;
        };
        let [_, words, _] = row(text, &format!("`{name}`"));
        let refusal = refusal.to_string();
        let begin = format!("the device refused \"x\": {words}");
        assert!(refusal.starts_with(&begin), "{name}: {words}: {refusal}");
    }
    assert_eq!(text.matches("\n| `").count(), names.len() - 1);
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
        let [_, told, _] = row(text, pattern);
        let meaning = meaning.trim_end_matches(" |").split(": `").next().unwrap();
        assert_eq!(told, meaning, "{pattern}");
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
