//! The command that makes the model embedded in firmware and host tool.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_calibration::data::conditions::pixel_format;
use hivtac_calibration::data::dataset::{Loads, Recipe};
use hivtac_calibration::network::Meaning;
use hivtac_calibration::train::Options;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;

use super::data::rendered;
use super::model::{CheckArgs, exported};
use super::network::trained;

/// Options of `default-model`.
#[derive(Args)]
pub struct DefaultModelArgs {
    /// Lens and camera: ov7725 (320 × 240), or mt9v034 (160 × 152, mono, black markers).
    #[arg(long, default_value = "ov7725")]
    preset: Preset,
    /// Pixel format: rgb565, yuv422 or mono; the preset's own if not given.
    #[arg(long, value_parser = pixel_format)]
    format: Option<PixelFormat>,
    /// Plain means of each marker's pixels, not weighted by redness: faster and less accurate.
    #[arg(long)]
    binary: bool,
    /// Gauss–Newton steps from the network's answer, 0 to 3; with 0 the network alone.
    #[arg(long, default_value_t = 1)]
    steps: u8,
    #[command(flatten)]
    options: Options,
    /// Where default.weights and default.hvtm go.
    #[arg(long, default_value = "calibration/models")]
    out_dir: PathBuf,
}

impl DefaultModelArgs {
    pub fn run(&self) -> Result<()> {
        let usual = Recipe::of(self.preset);
        let recipe = Recipe {
            format: self.format.unwrap_or(usual.format),
            centroid: match self.binary {
                true => CentroidEstimator::BinaryMask,
                false => usual.centroid,
            },
            ..usual
        };
        let noise = Recipe {
            loads: Loads::Random(6_000),
            seed: 5,
            ..recipe
        };
        let options = Options {
            meaning: Meaning::ForceAndPlace,
            ..self.options.clone()
        };
        let mut weights = trained(&rendered(&recipe)?, &options)?;
        if self.steps > 0 {
            weights = weights.with_film(self.steps, &rendered(&noise)?)?;
            weights = weights.with_others()?;
        }
        weights.save(&self.out_dir.join("default.weights"))?;
        let model = self.out_dir.join("default.hvtm");
        exported(&weights, &model)?;
        CheckArgs::of(model).run()
    }
}
