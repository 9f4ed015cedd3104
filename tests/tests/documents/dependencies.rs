//! Tests that `docs/dependencies.md` names every external package of this project.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use hivtac_tests::workspaces::{files, from_root, packages, root, table_rows};

/// Returns the names of the dependencies without a path in the manifests, of every kind and target.
fn used() -> BTreeSet<String> {
    let packages = packages();
    let all = packages
        .iter()
        .flat_map(|package| package["dependencies"].as_array().unwrap());
    let foreign = all.filter(|dependency| dependency["path"].is_null());
    foreign
        .map(|dependency| dependency["name"].as_str().unwrap().to_owned())
        .collect()
}

/// Returns the document's rows that name a package: its name, its purpose, the alternatives.
fn rows(text: &str) -> Vec<[&str; 3]> {
    let rows = table_rows(text).into_iter();
    let rows = rows.map(|cells| <[&str; 3]>::try_from(cells).expect("a row has three cells"));
    rows.filter(|[name, ..]| name.starts_with('`')).collect()
}

#[test]
fn every_dependency_has_one_row_and_each_row_a_dependency() {
    let text = fs::read_to_string(root().join("docs/dependencies.md")).unwrap();
    let rows = rows(&text);
    let named: BTreeSet<String> = rows
        .iter()
        .map(|[name, ..]| name.replace('`', ""))
        .collect();
    let used = used();
    assert!(used.contains("serde"), "the test can see dependencies");
    let missing: Vec<_> = used.difference(&named).collect();
    let gone: Vec<_> = named.difference(&used).collect();
    assert!(missing.is_empty(), "docs/dependencies.md lacks {missing:?}");
    assert!(
        gone.is_empty(),
        "docs/dependencies.md names {gone:?}, which nothing uses"
    );
    assert_eq!(rows.len(), named.len(), "a package is named twice");
}

#[test]
fn every_row_says_why_and_what_else_there_is() {
    let text = fs::read_to_string(root().join("docs/dependencies.md")).unwrap();
    for [name, why, else_there_is] in rows(&text) {
        assert!(why.len() > 10, "{name}: why is it there?");
        assert!(else_there_is.len() > 10, "{name}: what else is there?");
    }
}

#[test]
fn every_manifest_belongs_to_a_known_workspace() {
    let mut known: BTreeSet<String> = packages()
        .iter()
        .map(|package| from_root(Path::new(package["manifest_path"].as_str().unwrap())))
        .collect();
    // The root's manifest only names packages for its members.
    known.insert("Cargo.toml".to_owned());
    let manifests: BTreeSet<String> = files("Cargo.toml").into_iter().collect();
    let unknown: Vec<_> = manifests.difference(&known).collect();
    assert!(
        unknown.is_empty(),
        "{unknown:?}: their workspaces are not among `WORKSPACES` in tests/src/workspaces.rs"
    );
}
