//! The command that makes the model of a layout of dots.

use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::forward::layout_model;
use hivtac_twin::film::Layout;

/// Number of Gauss–Newton steps.
const STEPS: u8 = 2;

/// Options of `layout`.
#[derive(Args)]
pub struct LayoutArgs {
    /// The layout: 8v has dots at (±7, ±4.5), (±2.5, 0) and (0, ±2.4) mm.
    #[arg(default_value = "8v")]
    layout: Layout,
    /// The model file.
    #[arg(long)]
    out: PathBuf,
}

impl LayoutArgs {
    /// Makes the model and writes its file.
    pub fn run(&self) -> Result<()> {
        let spec = layout_model(self.layout, STEPS)?;
        let bytes = spec.encode().map_err(|error| anyhow!("{error}"))?;
        std::fs::write(&self.out, &bytes)
            .with_context(|| format!("cannot write {}", self.out.display()))?;
        println!("{}: {} bytes", self.out.display(), bytes.len());
        Ok(())
    }
}
