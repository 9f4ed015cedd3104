//! Lists the project's workspaces, packages and committed files, for tests of documents.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::string::String;
use std::vec::Vec;

use serde_json::Value;

/// Folders of the project's workspaces, relative to its root.
pub const WORKSPACES: [&str; 2] = ["", "tests/qemu"];

/// Returns the project's root folder.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).into()
}

/// Returns the output of a cargo command in a folder. Panics if the command fails.
pub fn cargo(folder: &Path, arguments: &[&str]) -> String {
    let program = env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(program)
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "cargo {arguments:?} in {}: {said}",
        folder.display()
    );
    String::from_utf8(output.stdout).unwrap()
}

/// Returns the packages of all workspaces, as `cargo metadata` describes them. Panics if it fails.
pub fn packages() -> Vec<Value> {
    let of = |workspace: &&str| {
        let arguments = ["metadata", "--no-deps", "--format-version", "1"];
        let text = cargo(&root().join(workspace), &arguments);
        let metadata: Value = serde_json::from_str(&text).unwrap();
        metadata["packages"].as_array().unwrap().clone()
    };
    WORKSPACES.iter().flat_map(of).collect()
}

/// Returns a path relative to the project's root. Panics if it is outside.
pub fn from_root(path: &Path) -> String {
    let path = path.canonicalize().unwrap();
    let root = root().canonicalize().unwrap();
    let inside = path.strip_prefix(root).unwrap();
    String::from(inside.to_str().unwrap())
}

/// Returns every file of the project whose name has this ending, relative to its root and sorted.
/// Build output and hidden folders are left out. Panics if a folder cannot be read.
pub fn files(ending: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = Vec::from([root()]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy();
            if path.is_dir() && !name.starts_with('.') && name != "target" {
                folders.push(path);
            } else if path.is_file() && name.ends_with(ending) {
                found.push(from_root(&path));
            }
        }
    }
    found.sort();
    found
}

/// Returns the cells of every row of the tables in a Markdown text, including heads and rules.
pub fn table_rows(text: &str) -> Vec<Vec<&str>> {
    text.lines().filter_map(cells).collect()
}

fn cells(line: &str) -> Option<Vec<&str>> {
    let inside = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    Some(inside.split('|').map(str::trim).collect())
}
