//! Writes the files of a unit with a stretched film, for tests of the host tool.

use std::fs;
use std::path::Path;

use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Load;
use hivtac_twin::film::DiscMotion;
use serde_json::{Value, json};

use super::Bench;
use crate::anywhere::WEIGHTS;
use crate::press::TestedUnit;

/// The number of the film that is stretched by 2.6 % along x and 2.4 % along y.
const NUMBER: u64 = 16;
/// Straight presses at this place, mm, with these forces, N: those during a tare, and the last one
/// afterwards.
const PLACE_MM: [f64; 2] = [1.0, -0.5];
const FORCES_N: [f64; 6] = [5e-4, 1e-3, 1.5e-3, 2e-3, 1e-2, 0.1];

/// Calibrates the unit by ten loads, and writes its model and the motion of its film.
#[test]
#[ignore = "writes host-tool/tests/tool/stretched"]
fn a_stretched_unit_is_written() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let weights = Weights::load(&root.join(WEIGHTS)).unwrap();
    let file = export(&weights).unwrap();
    let model = Model::parse(&file).unwrap();
    let unit = TestedUnit::with_real_film(&model.conditions, NUMBER).unwrap();
    let mut tared = unit.tare(&model).unwrap();
    let own = export(
        &Bench::Ten
            .calibrate(&weights, &unit, &mut tared, NUMBER)
            .unwrap(),
    )
    .unwrap();
    let loads = FORCES_N.map(|force_n| {
        let load = Load::from_angles(force_n, 0.0, 0.0).unwrap();
        load.with_offset_mm(PLACE_MM).unwrap()
    });
    let states = [Load::REST].iter().chain(&loads);
    let states: Vec<Value> = states.map(|load| state(&unit, load)).collect();
    let options = unit.scene.options();
    let told = json!({
        "shift_px": options.mounting.shift_px,
        "roll_deg": options.mounting.roll_deg,
        "pitch_um": options.lens.pitch_um,
        "glued_mm": options.glued_mm,
        "states": states,
    });
    let folder = root.join("host-tool/tests/tool/stretched");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("model.hvtm"), own).unwrap();
    fs::write(folder.join("film.json"), format!("{told}\n")).unwrap();
}

/// The film's state under a load.
fn state(unit: &TestedUnit, load: &Load) -> Value {
    let load = unit.with_tip(*load).unwrap();
    let pressed = unit.pressed(&load).unwrap();
    let pressed = pressed.expect("a film that is not the scene's");
    let motion = |disc: DiscMotion| [disc.moved_mm, disc.along_x, disc.along_y];
    json!({
        "force_n": pressed.force_n,
        "touches_mm": pressed.touches_mm,
        "centres_mm": pressed.centres_mm,
        "discs": pressed.discs.map(motion),
    })
}
