//! The model that firmware and host tool embed.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_calibration::conditions::pixel_format;
use hivtac_calibration::dataset::{Loads, Recipe};
use hivtac_calibration::network::Meaning;
use hivtac_calibration::train::Options;
use hivtac_terms::threshold::PixelFormat;

use super::data::rendered;
use super::model::{CheckArgs, exported};
use super::network::trained;

/// Gauss–Newton steps.
const STEPS: u8 = 1;

/// Options of `default-model`.
#[derive(Args)]
pub struct DefaultModelArgs {
    /// Pixel format: rgb565, yuv422 or mono.
    #[arg(long, value_parser = pixel_format, default_value = "rgb565")]
    format: PixelFormat,
    /// Where default.weights and default.hvtm go.
    #[arg(long, default_value = "calibration/models")]
    out_dir: PathBuf,
}

impl DefaultModelArgs {
    pub fn run(&self) -> Result<()> {
        let recipe = Recipe {
            format: self.format,
            ..Recipe::default()
        };
        let noise = Recipe {
            loads: Loads::Random(6_000),
            seed: 5,
            ..recipe
        };
        let options = Options {
            meaning: Meaning::ForceAndPlace,
            ..Options::default()
        };
        let weights = trained(&rendered(&recipe)?, &options)?;
        let weights = weights.with_film(STEPS, &rendered(&noise)?)?;
        weights.save(&self.out_dir.join("default.weights"))?;
        let model = self.out_dir.join("default.hvtm");
        exported(&weights, &model)?;
        CheckArgs::of(model).run()
    }
}
