//! Relinks the firmware when the memory map changes, which cargo does not detect, and passes on the
//! model file to embed with its known answer.

use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network;
use hivtac_sensor::known_answer::{self, Answer};
use std::path::Path;

fn main() {
    println!("cargo:rerun-if-changed=../memory.x");
    println!("cargo:rerun-if-env-changed=HIVTAC_MODEL");
    let second_board = std::env::var_os("CARGO_FEATURE_BOARD_OPENMV_H7").is_some();
    let usual_model = match second_board {
        false => "calibration/models/default.hvtm",
        true => "calibration/models/mt9v034/default.hvtm",
    };
    let model = std::env::var("HIVTAC_MODEL");
    let named = model.as_deref().unwrap_or(usual_model);
    let root = Path::new(&std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("..");
    let file = root.join(named);
    let file = file.canonicalize().unwrap_or_else(|error| {
        panic!(
            "HIVTAC_MODEL={named}: {error}; name a model file, from the root of the repository \
                or in full"
        )
    });
    println!("cargo:rerun-if-changed={}", file.display());
    println!("cargo:rustc-env=HIVTAC_MODEL_FILE={}", file.display());
    write_answer(&file);
}

/// Writes this computer's answer of the model; `None` if the file is not a model, which the
/// firmware reports itself.
fn write_answer(file: &Path) {
    let bytes = std::fs::read(file).expect("it was found");
    let model = Model::parse(&bytes).ok();
    let answer: Option<Answer> = model.map(|model| known_answer::of(&model, &mut Network::new()));
    let folder = std::env::var("OUT_DIR").expect("cargo sets it");
    let source = Path::new(&folder).join("known_answer.rs");
    std::fs::write(source, format!("{answer:?}")).expect("cargo's own folder is written");
}
