//! Tests that the status bits have the same meaning in `hivtac-terms` and `docs/wire.md`.

use hivtac_terms::status::Status;
use std::collections::BTreeMap;

const DOCUMENT: &str = include_str!("../../docs/wire.md");

fn named_bits() -> BTreeMap<u32, &'static str> {
    Status::NAMES
        .iter()
        .map(|(bit, name)| (bit.0, *name))
        .collect()
}

/// Returns the rows of the document's table: bit, name, whether it means "no force".
fn documented_bits() -> Vec<(u32, String, bool)> {
    let section = DOCUMENT
        .split("### Status bits")
        .nth(1)
        .expect("the section");
    let section = section.split("\n### ").next().unwrap();
    let rows = section.lines().filter_map(|line| line.strip_prefix("| "));
    rows.filter_map(|row| {
        let mut cells = row.split('|').map(str::trim);
        let bit: u32 = cells.next()?.parse().ok()?;
        let name = cells.next()?.to_owned();
        let no_force = match cells.next()? {
            "yes" => true,
            "–" => false,
            cell => panic!("{name}: {cell:?} is neither yes nor –"),
        };
        Some((bit, name, no_force))
    })
    .collect()
}

#[test]
fn the_document_lists_exactly_these_bits() {
    let documented = documented_bits();
    let names: BTreeMap<u32, &str> = documented
        .iter()
        .map(|(bit, name, _)| (1 << bit, name.as_str()))
        .collect();
    assert_eq!(names, named_bits());
    let no_force = documented.iter().filter(|(_, _, no_force)| *no_force);
    let mask = no_force.fold(0, |mask, (bit, ..)| mask | 1 << bit);
    assert_eq!(mask, Status::NO_FORCE.0);
}
