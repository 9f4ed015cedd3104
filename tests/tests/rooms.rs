//! Tests that each of the project's packages depends only on those that the table of folders in
//! `docs/architecture.md` allows.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use hivtac_tests::workspaces::{self, cargo, from_root, root};

/// A row of the table: a folder, its package, and the folders it may use; `None` means all.
struct Room {
    folder: String,
    package: String,
    may_use: Option<BTreeSet<String>>,
}

/// Returns the words of a cell that are formatted as code.
fn code_words(cell: &str) -> Vec<String> {
    cell.split('`')
        .skip(1)
        .step_by(2)
        .map(|word| word.trim_end_matches('/').to_owned())
        .collect()
}

fn rooms() -> Vec<Room> {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    text.lines().filter_map(room).collect()
}

fn room(line: &str) -> Option<Room> {
    let cells: Vec<&str> = line.strip_prefix('|')?.split('|').map(str::trim).collect();
    let [folder, package, _, may_use, _] = cells[..] else {
        return None;
    };
    Some(Room {
        folder: code_words(folder).first()?.clone(),
        package: code_words(package).first()?.clone(),
        may_use: (may_use != "everything").then(|| code_words(may_use).into_iter().collect()),
    })
}

/// Returns the project's packages: name, folder relative to the root, and the project's folders on
/// which it depends.
fn packages() -> BTreeMap<String, (String, BTreeSet<String>)> {
    let mut packages = BTreeMap::new();
    for package in workspaces::packages() {
        let manifest = Path::new(package["manifest_path"].as_str().unwrap());
        let uses = package["dependencies"].as_array().unwrap().iter();
        // Dependencies of a package's own tests are not part of anything built from it.
        let uses = uses.filter(|dependency| dependency["kind"] != "dev");
        let uses = uses.filter_map(|dependency| dependency["path"].as_str());
        let uses = uses.map(|path| from_root(Path::new(path))).collect();
        let name = package["name"].as_str().unwrap().to_owned();
        packages.insert(name, (from_root(manifest.parent().unwrap()), uses));
    }
    packages
}

#[test]
fn packages_use_only_what_the_table_allows() {
    let (rooms, packages) = (rooms(), packages());
    assert!(rooms.len() >= 9, "the table of rooms has a row for each");
    for room in rooms {
        let (folder, uses) = packages
            .get(&room.package)
            .unwrap_or_else(|| panic!("no package {}", room.package));
        assert_eq!(
            folder, &room.folder,
            "{} lies where the table says",
            room.package
        );
        let Some(may_use) = room.may_use else {
            continue;
        };
        let others: Vec<_> = uses.difference(&may_use).collect();
        assert!(
            others.is_empty(),
            "{} must not use {others:?}",
            room.package
        );
    }
}

#[test]
fn every_package_has_a_room() {
    let rooms = rooms();
    for (package, (folder, _)) in packages() {
        let is_inside = |room: &Room| Path::new(&folder).starts_with(&room.folder);
        assert!(
            rooms.iter().any(is_inside),
            "{package} in {folder} is in no room of the table"
        );
    }
}

/// Returns the modules of its package that a source names by `crate::`.
fn modules_used(text: &str) -> BTreeSet<String> {
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let after = text.split("crate::").skip(1);
    let names = after.map(|rest| rest.chars().take_while(|c| is_of_name(*c)).collect());
    names.collect()
}

/// Borders between folders of one package hold, too.
#[test]
fn folders_use_only_the_modules_that_the_table_allows() {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let (_, borders) = text.split_once("\n| folder | may use |\n").unwrap();
    let rows = borders.lines().skip(1).map_while(|line| {
        let cells: Vec<&str> = line.strip_prefix('|')?.split('|').collect();
        Some((code_words(cells[0]).first()?.clone(), code_words(cells[1])))
    });
    let rows: Vec<_> = rows.collect();
    assert!(rows.len() >= 5, "{rows:?}");
    let sources = workspaces::files(".rs");
    for (folder, mut allowed) in rows {
        allowed.extend(folder.rsplit('/').next().map(str::to_owned));
        let is_inside = |file: &&String| file.starts_with(&format!("{folder}/"));
        let mut used = BTreeSet::new();
        for file in sources.iter().filter(is_inside) {
            used.extend(modules_used(
                &fs::read_to_string(root().join(file)).unwrap(),
            ));
        }
        let own = allowed.last().unwrap();
        assert!(used.contains(own), "the test can see what {folder} uses");
        let others: Vec<_> = used.iter().filter(|it| !allowed.contains(it)).collect();
        assert!(others.is_empty(), "{folder} must not use {others:?}");
    }
}

/// Returns the packages that a package's build includes, one per line.
fn tree_of(package: &str, features: &str) -> String {
    let arguments = [
        "tree",
        "--package",
        package,
        "--features",
        features,
        "--prefix",
        "none",
        "--edges",
        "normal,build",
    ];
    cargo(&root(), &arguments)
}

/// Users build it themselves.
#[test]
fn the_host_tool_is_small_unless_more_is_asked_for() {
    let packages = |features: &str| {
        let tree = tree_of("hivtac", features);
        let lines = tree
            .lines()
            .map(|line| line.trim_end_matches(" (*)").to_owned());
        lines.collect::<BTreeSet<_>>().len()
    };
    assert!(packages("") < 150, "{}", packages(""));
    assert!(packages("ros2") > 150, "the test can see features");
}

#[test]
fn the_demo_builds_no_training_and_no_solver() {
    let of = |package: &str| tree_of(package, "");
    let demo = ["hivtac", "hivtac-firmware", "xtask", "hivtac-rig"].map(of);
    for line in demo.iter().flat_map(|tree| tree.lines()) {
        let name = line.split(' ').next().unwrap_or("");
        assert!(
            name != "hivtac-calibration" && !name.starts_with("faer"),
            "the demo builds {name}"
        );
    }
    assert!(
        of("hivtac-shell").contains("\nfaer"),
        "the test can see the sparse solver"
    );
}
