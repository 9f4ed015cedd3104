//! The model and the settings of a picked configuration, ready to flash.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::{Arithmetic, Meaning};
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::Options;
use hivtac_data::conditions::Conditions;
use hivtac_data::dataset::{Loads, Recipe, generate};
use hivtac_data::range::Range;
use hivtac_evaluation::check::check;
use hivtac_terms::conditions::CentroidEstimator;
use serde_json::json;

use super::{Centroid, Configuration, Numbers};

/// Frames that the network is trained on, and frames that tell the markers' noise and their seed:
/// as for the default model.
const ROWS: usize = 80_000;
const NOISE: (usize, u64) = (6_000, 5);
/// Loads of the frames that are rendered, a little beyond those that are judged.
const RENDERED: Range = Range {
    force_n: 0.25,
    alpha_deg: 10.0,
    beta_deg: 10.0,
    place_mm: 4.2,
};
/// Frames that are rendered for a model.
pub(super) const FRAMES: usize = ROWS + NOISE.0;
/// Frames to check on, and the seed of their loads and noise.
const CHECKED: (usize, u64) = (4000, 1_000_001);

/// Trains the model of a configuration on as many frames as the default model has, and writes
/// `model.weights`, `model.hvtm` and `settings.json` into a folder. `progress` is called for every
/// rendered frame.
///
/// Gives what to do with them, in words.
///
/// # Errors
/// When the frames cannot be rendered, training fails, or a file cannot be written.
pub(super) fn write(
    picked: &Configuration,
    folder: &Path,
    progress: impl Fn() + Sync,
) -> Result<String> {
    let recipe = Recipe {
        width: picked.width,
        height: picked.height,
        centroid: picked.centroid.estimator(),
        loads: Loads::Random(ROWS),
        range: RENDERED,
        ..Recipe::default()
    };
    let dataset = generate(&recipe, &progress)?;
    let widths = picked.network.split('-').map(str::parse);
    let options = Options {
        meaning: Meaning::ForceAndPlace,
        hidden: widths.collect::<Result<_, _>>()?,
        arithmetic: match picked.numbers {
            Numbers::Int8PerChannel => Arithmetic::Int8PerChannel,
            Numbers::F32 | Numbers::Int16 => Arithmetic::Int16,
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
    let file = |name: &str| folder.join(name);
    weights.save(&file("model.weights"))?;
    let save = |name: &str, bytes: &[u8]| {
        fs::write(file(name), bytes)
            .with_context(|| format!("cannot write {}", file(name).display()))
    };
    save("model.hvtm", &bytes)?;
    let settings = settings(&weights.conditions);
    save(
        "settings.json",
        (serde_json::to_string_pretty(&settings)? + "\n").as_bytes(),
    )?;
    let (samples, seed) = CHECKED;
    // The contact reading is `force`: no friction has a part in it.
    let report = check(&bytes, samples, seed, || ())?;
    Ok(format!(
        "{report}\n\nwrote model.hvtm, model.weights and settings.json into {}\n\n{}",
        folder.display(),
        orders(&file("model.hvtm"))
    ))
}

fn settings(conditions: &Conditions) -> serde_json::Value {
    json!({
        "conditions": conditions,
        "commands": ["hivtac tare"],
    })
}

/// What to type. The model file carries all settings of the sensing; the firmware takes them from
/// it at the start.
fn orders(model: &Path) -> String {
    format!(
        "flash it, from the root of the repository:\n\n  HIVTAC_MODEL={} \\\n    cargo run \
         --release -p hivtac-firmware --target thumbv7em-none-eabihf\n\nthen, while nothing \
         touches the film:\n\n  hivtac tare",
        model.display()
    )
}

impl Centroid {
    /// As the sensing has it.
    pub(super) fn estimator(self) -> CentroidEstimator {
        match self {
            Centroid::Binary => CentroidEstimator::BinaryMask,
            Centroid::Weighted => CentroidEstimator::RednessWeighted,
        }
    }
}
