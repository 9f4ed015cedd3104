//! Attacks on everything that reads foreign data, guided by coverage. Each attack is a function
//! that takes any bytes. It panics if it finds a fault; otherwise it returns whether the bytes
//! reached the code under attack.
//!
//! `cargo xtask test --all attacks` runs each for some seconds if there is a C++ compiler. The
//! tests here run its corpus without one. [`ATTACKS`] is the list.
//!
//! To attack longer (`-help=1` shows libFuzzer's options; cargo-fuzz can run the targets as well),
//! and to try an input that an attack found:
//!
//! ```sh
//! cd target/xtask/fuzz
//! x86_64-unknown-linux-gnu/tools/model found/model ../../../../tests/fuzz/corpus/model \
//!     -artifact_prefix=found/model/ -max_total_time=1800
//! cargo run -p hivtac-fuzz --bin model -- found/model/crash-*
//! ```
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
pub type Attack = fn(&[u8]) -> bool;

/// Every attack by the name of its target, which is also the name of its folder in
/// `tests/fuzz/corpus`.
pub const ATTACKS: [(&str, Attack); 11] = [
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

/// Returns the attack of that name.
///
/// # Panics
/// If there is no such attack: a target without its entry in [`ATTACKS`].
pub fn attack(name: &str) -> Attack {
    let found = ATTACKS.iter().find(|(known, _)| *known == name);
    found.expect("every target is listed").1
}

/// Runs an attack on the files that the command line names. Without libFuzzer a target does nothing
/// else.
///
/// # Panics
/// If a file cannot be read, or the attack finds a fault.
pub fn replay(name: &str) {
    for path in std::env::args_os().skip(1) {
        let input = std::fs::read(&path).expect("the file can be read");
        let reached = attack(name)(&input);
        println!("{}: withstood, reached {reached}", path.display());
    }
}

/// The complete code of a fuzz target.
#[macro_export]
macro_rules! target {
    ($name:literal) => {
        #[cfg(fuzzing)]
        libfuzzer_sys::fuzz_target!(|input: &[u8]| {
            $crate::attack($name)(input);
        });

        #[cfg(not(fuzzing))]
        fn main() {
            $crate::replay($name);
        }
    };
}
