//! The commands that make and judge model files.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use hivtac_calibration::data::dataset::Dataset;
use hivtac_calibration::evaluation::Evaluation;
use hivtac_calibration::evaluation::check::check;
use hivtac_calibration::progress::bar;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;

/// Number of frames in a check.
const CHECKED: usize = 4000;
/// Seed of their loads and noise; no training data uses it.
const CHECK_SEED: u64 = 1_000_001;

/// Options of `export`.
#[derive(Args)]
pub struct ExportArgs {
    /// The weights file.
    #[arg(long)]
    weights: PathBuf,
    /// The model file to write.
    #[arg(long)]
    out: PathBuf,
}

impl ExportArgs {
    pub fn run(&self) -> Result<()> {
        exported(&Weights::load(&self.weights)?, &self.out)
    }
}

/// Writes a model file.
pub fn exported(weights: &Weights, out: &Path) -> Result<()> {
    let bytes = export(weights)?;
    fs::write(out, &bytes).with_context(|| format!("cannot write {}", out.display()))?;
    println!("wrote {} ({} bytes)", out.display(), bytes.len());
    Ok(())
}

fn read(model: &Path) -> Result<Vec<u8>> {
    fs::read(model).with_context(|| format!("cannot read {}", model.display()))
}

/// Options of `evaluate`.
#[derive(Args)]
pub struct EvaluateArgs {
    /// The model file.
    #[arg(long)]
    model: PathBuf,
    /// A data set that it was not made from.
    #[arg(long)]
    data: PathBuf,
    /// The HTML file to write.
    #[arg(long)]
    out: PathBuf,
}

impl EvaluateArgs {
    pub fn run(&self) -> Result<()> {
        let Self { model, data, out } = self;
        let bytes = read(model)?;
        let dataset = Dataset::load(data)?;
        if let Some(free) = &dataset.about.free {
            let anywhere = dataset.rows.iter().filter(|row| dataset.is_free(row));
            eprintln!(
                "{} of {} frames are of presses anywhere, whose direction is known to {}° only: \
                 errors of direction have that in them",
                anywhere.count(),
                dataset.rows.len(),
                free.direction_deg
            );
        }
        let evaluation = Evaluation::of(&bytes, &dataset)
            .with_context(|| format!("cannot judge {} on {}", model.display(), data.display()))?;
        fs::write(out, evaluation.to_html())
            .with_context(|| format!("cannot write {}", out.display()))?;
        println!("{evaluation}\nwrote {}", out.display());
        Ok(())
    }
}

/// Options of `check`.
#[derive(Args)]
pub struct CheckArgs {
    /// The model file.
    #[arg(long)]
    model: PathBuf,
    /// Frames to render.
    #[arg(long, default_value_t = CHECKED)]
    samples: usize,
}

impl CheckArgs {
    /// The check of a model with the default number of frames.
    pub fn of(model: PathBuf) -> Self {
        Self {
            model,
            samples: CHECKED,
        }
    }

    pub fn run(&self) -> Result<()> {
        let bytes = read(&self.model)?;
        let bar = bar("checking", self.samples);
        let report = check(&bytes, self.samples, CHECK_SEED, || bar.inc(1))
            .with_context(|| format!("cannot check {}", self.model.display()))?;
        bar.finish_and_clear();
        println!("{report}");
        Ok(())
    }
}
