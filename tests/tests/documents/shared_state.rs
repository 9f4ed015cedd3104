//! Tests that `docs/shared-state.md` lists every static of the firmware with its file.

use std::collections::BTreeSet;
use std::fs;

use hivtac_tests::workspaces::{files, root, table_rows};

/// Returns the name of the static that a line of source declares; `None` for other lines and for
/// the linker's statics, which are lower case.
fn declared(line: &str) -> Option<&str> {
    let line = line.strip_prefix("pub ").unwrap_or(line);
    let rest = line.strip_prefix("static ")?;
    let rest = rest.strip_prefix("mut ").unwrap_or(rest);
    let name = rest.split(':').next()?;
    name.starts_with(|first: char| first.is_ascii_uppercase())
        .then_some(name)
}

fn in_sources() -> BTreeSet<(String, String)> {
    let mut found = BTreeSet::new();
    for file in files(".rs") {
        let Some(name) = file.strip_prefix("firmware/src/") else {
            continue;
        };
        let text = fs::read_to_string(root().join(&file)).unwrap();
        let statics = text.lines().filter_map(declared);
        found.extend(statics.map(|it| (it.to_owned(), name.to_owned())));
    }
    found
}

#[test]
fn every_static_of_the_firmware_is_listed_with_its_file() {
    let text = fs::read_to_string(root().join("docs/shared-state.md")).unwrap();
    let rows = table_rows(&text).into_iter();
    let listed: BTreeSet<_> = rows
        .filter(|cells| cells[0].starts_with('`'))
        .map(|cells| (cells[0].replace('`', ""), cells[1].replace('`', "")))
        .collect();
    let found = in_sources();
    assert!(found.len() > 20, "the test can see statics");
    assert_eq!(listed, found);
}
