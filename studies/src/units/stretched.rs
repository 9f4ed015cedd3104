//! Writes the files of a unit with a stretched film, which tests of the host tool read.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Load;
use hivtac_twin::film::{DiscMotion, Layout};
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

/// Calibrate a unit with a stretched film by ten loads; write its model and the motion of its film.
#[derive(Args)]
pub struct Stretched {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// The folder that gets `model.hvtm` and `film.json`.
    #[arg(long, default_value = "host-tool/tests/tool/stretched")]
    into: PathBuf,
}

impl Stretched {
    /// Writes both files.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let file = export(&weights)?;
        let model = Model::parse(&file).map_err(|error| anyhow!("{error}"))?;
        let unit = TestedUnit::with_real_film(&model.conditions, Layout::default(), NUMBER)?;
        let mut tared = unit.tare(&model)?;
        let own = export(&Bench::Ten.calibrate(&weights, &unit, &mut tared, NUMBER)?)?;
        let loads = FORCES_N.map(|force_n| {
            let load = Load::from_angles(force_n, 0.0, 0.0)?;
            load.with_offset_mm(PLACE_MM)
        });
        let mut states = vec![state(&unit, &Load::REST)?];
        for load in loads {
            states.push(state(&unit, &load?)?);
        }
        let options = unit.scene.options();
        let told = json!({
            "shift_px": options.mounting.shift_px,
            "roll_deg": options.mounting.roll_deg,
            "pitch_um": options.lens.pitch_um,
            "glued_mm": options.glued_mm.array::<4>(),
            "states": states,
        });
        fs::create_dir_all(&self.into)?;
        fs::write(self.into.join("model.hvtm"), own)?;
        fs::write(self.into.join("film.json"), format!("{told}\n"))?;
        Ok(())
    }
}

/// The film's state under a load.
fn state(unit: &TestedUnit, load: &Load) -> Result<Value> {
    let load = unit.with_tip(*load)?;
    let pressed = unit.pressed(&load)?.context("the film is the scene's")?;
    let motion = |disc: DiscMotion| [disc.moved_mm, disc.along_x, disc.along_y];
    Ok(json!({
        "force_n": pressed.force_n,
        "touches_mm": pressed.touches_mm,
        "centres_mm": pressed.centres_mm.array::<4>(),
        "discs": pressed.discs.array::<4>().map(motion),
    }))
}
