//! Tests with the corpus of each attack: inputs of high coverage, and those that once found a
//! fault.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::ATTACKS;

/// The largest size of a corpus in bytes.
const LARGEST: usize = 64 << 10;

fn here() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn names_in(folder: &str) -> BTreeSet<String> {
    let entries = fs::read_dir(here().join(folder)).unwrap();
    let stems = entries.map(|entry| entry.unwrap().path().file_stem().unwrap().to_owned());
    stems.map(|stem| stem.into_string().unwrap()).collect()
}

fn inputs(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = fs::read_dir(here().join("corpus").join(name)).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .map(|path| (path.clone(), fs::read(path).unwrap()))
        .collect()
}

#[test]
fn every_attack_has_a_corpus() {
    let listed = ATTACKS.iter().map(|(name, _)| (*name).to_owned());
    let listed: BTreeSet<String> = listed.collect();
    assert_eq!(names_in("corpus"), listed);
}

#[test]
fn every_input_is_withstood_and_one_of_each_corpus_comes_far() {
    for (name, attack) in ATTACKS {
        let mut reached = 0;
        for (path, input) in inputs(name) {
            println!("{}", path.display());
            reached += usize::from(attack(&input));
        }
        assert!(reached > 0, "no input of {name} comes as far as it should");
    }
}

#[test]
fn the_corpus_is_small() {
    let sizes = ATTACKS.iter().flat_map(|(name, _)| inputs(name));
    let all: usize = sizes.map(|(_, input)| input.len()).sum();
    assert!(all <= LARGEST, "{all} bytes");
}
