//! Makes the model and the settings of a picked configuration, ready to flash.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use hivtac_calibration::data::dataset::{Loads, Recipe, generate};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::evaluation::check::check;
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::{Arithmetic, Meaning};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::Options;
use serde_json::json;

use super::Configuration;

/// Number of training frames; then number and seed of the frames for the markers' noise. As for the
/// default model.
const ROWS: usize = 80_000;
const NOISE: (usize, u64) = (6_000, 5);
/// Loads of the rendered frames, slightly beyond those that are judged.
const RENDERED: Range = Range {
    force_n: 0.25,
    alpha_deg: 10.0,
    beta_deg: 10.0,
    place_mm: 4.2,
};
/// Number of rendered frames for a model.
pub(super) const FRAMES: usize = ROWS + NOISE.0;
/// Number of frames for the check, and the seed of their loads and noise.
const CHECKED: (usize, u64) = (4000, 1_000_001);

/// Trains the model of a configuration on as many frames as the default model has, and writes
/// `model.weights`, `model.hvtm` and `settings.json` into a folder. `progress` is called for every
/// rendered frame.
///
/// Returns a text that says how to use the files.
pub(super) fn write(
    picked: &Configuration,
    folder: &Path,
    progress: impl Fn() + Sync,
) -> Result<String> {
    let recipe = Recipe {
        width: picked.width,
        height: picked.height,
        centroid: picked.estimator(),
        loads: Loads::Random(ROWS),
        range: RENDERED,
        ..Recipe::default()
    };
    let dataset = generate(&recipe, &progress)?;
    let widths = picked.network.split('-').map(str::parse);
    let options = Options {
        meaning: Meaning::ForceAndPlace,
        hidden: widths.collect::<Result<_, _>>()?,
        arithmetic: match picked.numbers.as_str() {
            "int16" => Arithmetic::Int16,
            _ => Arithmetic::Int8PerChannel,
        },
        ..Options::default()
    };
    let mut weights = fit(&dataset, &options, |_| ())?.weights;
    if picked.steps > 0 {
        let (rows, seed) = NOISE;
        let recipe = Recipe {
            loads: Loads::Random(rows),
            seed,
            ..recipe
        };
        weights = weights.with_film(picked.steps, &generate(&recipe, &progress)?)?;
    }
    let bytes = export(&weights)?;
    fs::create_dir_all(folder)?;
    let folder = folder.canonicalize()?;
    weights.save(&folder.join("model.weights"))?;
    let settings = json!({ "conditions": weights.conditions, "commands": ["hivtac tare"] });
    let settings = serde_json::to_string_pretty(&settings)? + "\n";
    for (name, bytes) in [
        ("model.hvtm", &bytes[..]),
        ("settings.json", settings.as_bytes()),
    ] {
        let file = folder.join(name);
        fs::write(&file, bytes).with_context(|| format!("cannot write {}", file.display()))?;
    }
    let (samples, seed) = CHECKED;
    // With the contact reading `force`, friction has no effect.
    let report = check(&bytes, samples, seed, || ())?;
    let folder = folder.display();
    Ok(format!(
        "{report}\n\nwrote model.hvtm, model.weights and settings.json into {folder}\n\nflash it, \
         from the root of the repository:\n\n  HIVTAC_MODEL={folder}/model.hvtm \\\n    cargo run \
         --release -p hivtac-firmware --target thumbv7em-none-eabihf\n\nthen, while nothing \
         touches the film:\n\n  hivtac tare"
    ))
}
