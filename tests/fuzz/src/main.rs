//! Attacks on everything that reads foreign data, guided by coverage. Each attack is a function
//! that takes any bytes. It panics if it finds a fault; otherwise it returns whether the bytes
//! reached the code under attack.
//!
//! `cargo xtask test --all attacks` runs each for some seconds if there is a C++ compiler. The
//! tests here run its corpus without one. [`ATTACKS`] is the list; `HIVTAC_ATTACK` chooses one.
//!
//! To attack longer (`-help=1` shows libFuzzer's options), and to try an input that an attack
//! found:
//!
//! ```sh
//! cd target/xtask/fuzz
//! export HIVTAC_ATTACK=model
//! x86_64-unknown-linux-gnu/tools/hivtac-fuzz found/model ../../../../tests/fuzz/corpus/model \
//!     -artifact_prefix=found/model/ -max_total_time=1800
//! cargo run -p hivtac-fuzz -- found/model/crash-*
//! ```
#![cfg_attr(fuzzing, no_main)]
#![forbid(unsafe_code)]

mod calibration;
mod capture;
#[cfg(test)]
mod corpus;
mod frames;
mod markers;
mod model;
mod picture;
mod scene_file;
mod storage;
mod wire;

/// An attack: returns whether the input reached the code under attack.
type Attack = fn(&[u8]) -> bool;

/// Every attack by its name, which is also that of its folder in `tests/fuzz/corpus`.
const ATTACKS: [(&str, Attack); 11] = [
    ("from_device", wire::from_device),
    ("from_host", wire::from_host),
    ("model", model::attack),
    ("frames", frames::attack),
    ("capture", capture::attack),
    ("storage", storage::attack),
    ("scene_file", scene_file::attack),
    ("picture", picture::attack),
    ("dataset", calibration::dataset),
    ("recording", calibration::recording),
    ("network", calibration::network),
];

/// The attack that `HIVTAC_ATTACK` names.
///
/// # Panics
/// If it names none.
fn chosen() -> Attack {
    let name = std::env::var("HIVTAC_ATTACK").unwrap_or_default();
    let found = ATTACKS.iter().find(|(known, _)| *known == name);
    found
        .unwrap_or_else(|| {
            let known = ATTACKS.map(|(known, _)| known).join(", ");
            panic!("HIVTAC_ATTACK names no attack: {name:?}; there are {known}")
        })
        .1
}

#[cfg(fuzzing)]
libfuzzer_sys::fuzz_target!(|input: &[u8]| {
    static CHOSEN: std::sync::LazyLock<Attack> = std::sync::LazyLock::new(chosen);
    CHOSEN(input);
});

/// Runs the attack on the files that the command line names.
#[cfg(not(fuzzing))]
fn main() {
    let attack = chosen();
    for path in std::env::args_os().skip(1) {
        let input = std::fs::read(&path).expect("the file can be read");
        let reached = attack(&input);
        println!("{}: withstood, reached {reached}", path.display());
    }
}
