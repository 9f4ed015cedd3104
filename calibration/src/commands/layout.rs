//! The command that makes the model of a layout of dots.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_calibration::forward::{layout_model, layout_weights};

use super::model::exported;
use hivtac_twin::film::Layout;

/// Number of Gauss–Newton steps.
const STEPS: u8 = 2;

/// Options of `layout`.
#[derive(Args)]
pub struct LayoutArgs {
    /// The layout: 8v has dots at (±7, ±4.5), (±2.5, 0) and (0, ±2.4) mm.
    #[arg(default_value = "8v")]
    layout: Layout,
    /// The weights file, with which a unit's calibration begins. The model file has the same name
    /// with `hvtm`.
    #[arg(long)]
    out: PathBuf,
}

impl LayoutArgs {
    /// Makes the model, and writes its weights file and its model file.
    pub fn run(&self) -> Result<()> {
        let weights = layout_weights(&layout_model(self.layout, STEPS)?)?;
        weights.save(&self.out)?;
        exported(&weights, &self.out.with_extension("hvtm"))
    }
}
