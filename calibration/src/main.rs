//! `hivtac-calibrate`: from data to a model on the chip.

#[cfg(feature = "train")]
mod training;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::{Args, Parser, Subcommand};
use hivtac_calibration::check::check;
use hivtac_calibration::conditions::preset;
use hivtac_calibration::dataset::{Dataset, Recipe, generate};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use indicatif::{ProgressBar, ProgressStyle};

/// From data to a model on the chip: data sets, training, quantization, a check.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render frames of random forces, let the pipeline look at them, write forces and features as CSV.
    Dataset {
        #[command(flatten)]
        recipe: RecipeArgs,
        /// The CSV file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Train a network on a data set; writes a weights file.
    #[cfg(feature = "train")]
    Train {
        /// The data set.
        #[arg(long)]
        data: PathBuf,
        #[command(flatten)]
        options: training::OptionArgs,
        /// The weights file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Quantize a weights file; writes a model file. The same weights give the same bytes on every machine.
    Export {
        /// The weights file.
        #[arg(long)]
        weights: PathBuf,
        /// Take the rest position from this data set instead (mean of its frames without force).
        #[arg(long)]
        rest: Option<PathBuf>,
        /// The model file to write.
        #[arg(long)]
        out: PathBuf,
    },
    /// Measure freshly rendered frames with a model file and print how far its forces are from the truth.
    Check {
        /// The model file.
        #[arg(long)]
        model: PathBuf,
        #[command(flatten)]
        frames: CheckArgs,
    },
    /// All of this from scratch, for the model that firmware and host tool embed.
    #[cfg(feature = "train")]
    DefaultModel {
        #[command(flatten)]
        recipe: RecipeArgs,
        #[command(flatten)]
        options: training::OptionArgs,
        /// Where default.weights and default.hvtm go.
        #[arg(long, default_value = "calibration/models")]
        out_dir: PathBuf,
    },
}

#[derive(Args)]
struct RecipeArgs {
    /// Geometry preset: paper or ov7725.
    #[arg(long, default_value = "ov7725")]
    preset: String,
    /// Columns of a frame.
    #[arg(long, default_value_t = 320)]
    width: u16,
    /// Rows of a frame.
    #[arg(long, default_value_t = 240)]
    height: u16,
    /// Frames to render.
    #[arg(long, default_value_t = Recipe::default().samples)]
    samples: usize,
    /// Decides forces and noise.
    #[arg(long = "data-seed", visible_alias = "seed", default_value_t = 1)]
    data_seed: u64,
}

#[derive(Args)]
struct CheckArgs {
    /// Frames to render.
    #[arg(long, default_value_t = 4000)]
    samples: usize,
    /// Decides forces and noise; use another seed than the training data's.
    #[arg(long, default_value_t = 1_000_001)]
    seed: u64,
}

impl RecipeArgs {
    fn recipe(&self) -> Result<Recipe> {
        Ok(Recipe {
            preset: preset(&self.preset)?,
            width: self.width,
            height: self.height,
            samples: self.samples,
            seed: self.data_seed,
            ..Recipe::default()
        })
    }
}

fn main() -> Result<()> {
    match Cli::parse().command {
        Command::Dataset { recipe, out } => make_dataset(&recipe)?.save(&out),
        #[cfg(feature = "train")]
        Command::Train { data, options, out } => {
            training::run(&Dataset::load(&data)?, &options)?.save(&out)
        }
        Command::Export { weights, rest, out } => export_file(&weights, rest.as_deref(), &out),
        Command::Check { model, frames } => check_file(&model, &frames),
        #[cfg(feature = "train")]
        Command::DefaultModel {
            recipe,
            options,
            out_dir,
        } => default_model(&recipe, &options, &out_dir),
    }
}

fn make_dataset(args: &RecipeArgs) -> Result<Dataset> {
    let recipe = args.recipe()?;
    let bar = bar("rendering", recipe.samples);
    let dataset = generate(&recipe, || bar.inc(1))?;
    bar.finish_and_clear();
    let rejected = dataset.rejected();
    println!(
        "data set: {} frames, {} rejected",
        dataset.rows.len(),
        rejected.values().sum::<usize>()
    );
    rejected
        .iter()
        .for_each(|(status, count)| println!("  {status}: {count}"));
    Ok(dataset)
}

fn export_file(weights: &Path, rest: Option<&Path>, out: &Path) -> Result<()> {
    let mut weights = Weights::load(weights)?;
    if let Some(data) = rest {
        weights.rest = Dataset::load(data)?.rest()?;
    }
    let bytes = export(&weights)?;
    fs::write(out, &bytes).with_context(|| format!("cannot write {}", out.display()))?;
    println!("wrote {} ({} bytes)", out.display(), bytes.len());
    Ok(())
}

fn check_file(model: &Path, args: &CheckArgs) -> Result<()> {
    let bytes = fs::read(model).with_context(|| format!("cannot read {}", model.display()))?;
    let bar = bar("checking", args.samples);
    let report = check(&bytes, args.samples, args.seed, || bar.inc(1))
        .with_context(|| format!("cannot check {}", model.display()))?;
    bar.finish_and_clear();
    println!("{report}");
    Ok(())
}

#[cfg(feature = "train")]
fn default_model(
    recipe: &RecipeArgs,
    options: &training::OptionArgs,
    out_dir: &Path,
) -> Result<()> {
    let (weights, model) = (
        out_dir.join("default.weights"),
        out_dir.join("default.hvtm"),
    );
    training::run(&make_dataset(recipe)?, options)?.save(&weights)?;
    export_file(&weights, None, &model)?;
    check_file(
        &model,
        &CheckArgs {
            samples: 4000,
            seed: 1_000_001,
        },
    )
}

/// A progress bar on the terminal's error stream; nothing when that is no terminal.
fn bar(what: &'static str, steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {eta} {msg}");
    let bar = ProgressBar::new(steps as u64).with_prefix(what);
    match style {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
