//! The status bits have one meaning in `hivtac-sensing`, `hivtac-wire` and `docs/wire.md`.

use hivtac_sensing::status::Status as SensingStatus;
use hivtac_wire::status::Status as WireStatus;
use std::collections::BTreeMap;

const DOCUMENT: &str = include_str!("../../docs/wire.md");

fn wire_bits() -> BTreeMap<u32, &'static str> {
    WireStatus::NAMES
        .iter()
        .map(|(bit, name)| (bit.0, *name))
        .collect()
}

#[test]
fn every_bit_of_the_pipeline_has_its_number_and_name_on_the_wire() {
    let wire = wire_bits();
    assert!(!SensingStatus::NAMES.is_empty());
    for (bit, name) in SensingStatus::NAMES {
        assert_eq!(wire.get(&bit.bits()), Some(name));
    }
}

#[test]
fn both_say_no_force_by_the_same_bits() {
    assert_eq!(SensingStatus::NO_FORCE.bits(), WireStatus::NO_FORCE.0);
}

/// Rows of the document's table: bit, name, whether it says "no force".
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
    assert_eq!(names, wire_bits());
    let no_force = documented.iter().filter(|(_, _, no_force)| *no_force);
    let mask = no_force.fold(0, |mask, (bit, ..)| mask | 1 << bit);
    assert_eq!(mask, WireStatus::NO_FORCE.0);
}
