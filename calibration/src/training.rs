//! The training commands.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;
use hivtac_calibration::dataset::{Dataset, Split};
use hivtac_calibration::errors::{Errors, WEAK_N};
use hivtac_calibration::fit::{Fit, adopt, fit, judged_by};
use hivtac_calibration::loss_plot::LossPlot;
use hivtac_calibration::network::{Arithmetic, Meaning};
use hivtac_calibration::train::{Options, Progress};
use hivtac_calibration::weights::Weights;
use serde::de::DeserializeOwned;

/// How to train.
#[derive(Args)]
pub struct OptionArgs {
    /// Widths of the hidden layers.
    #[arg(long, value_delimiter = ',', default_values_t = Options::default().hidden)]
    hidden: Vec<usize>,
    /// Passes over the data in floats.
    #[arg(long, default_value_t = Options::default().epochs)]
    epochs: usize,
    /// Passes after that with the chip's rounding in the forward pass.
    #[arg(long, default_value_t = Options::default().rounded_epochs)]
    rounded_epochs: usize,
    /// Rows that share one step.
    #[arg(long, default_value_t = Options::default().batch)]
    batch: usize,
    /// What the network answers: force-vector, force-and-place, or the paper's angles-magnitude. Without
    /// this, force-and-place for a data set that knows where the tip is, otherwise force-vector.
    #[arg(long, value_parser = named::<Meaning>)]
    outputs: Option<Meaning>,
    /// How the chip holds weights: int8-per-channel, int8-per-tensor or int16.
    #[arg(long, value_parser = named::<Arithmetic>, default_value = "int8-per-channel")]
    arithmetic: Arithmetic,
    /// End a phase after this many passes without a better loss on held-out rows; 0 for never.
    #[arg(long, default_value_t = Options::default().patience)]
    patience: usize,
    /// What is held out together.
    #[arg(long, value_enum, default_value_t)]
    held_out: Split,
    /// Go on from the network of this weights file.
    #[arg(long)]
    start: Option<PathBuf>,
    /// Draw the losses into this SVG file, again after every pass.
    #[arg(long)]
    loss_plot: Option<PathBuf>,
    /// Adam's first step size; it falls linearly.
    #[arg(long, default_value_t = Options::default().learning_rate)]
    learning_rate: f64,
    /// Train the first layer on the features themselves instead of their principal components, weak ones made larger: slower, and
    /// never better here.
    #[arg(long)]
    plain_features: bool,
    /// Weigh what is off across a force by 1 / √(|F|² + (10 mN)²), with this as the mean weight (what is off along it has 1): weak
    /// forces' directions count, too.
    #[arg(long)]
    direction_weight: Option<f64>,
    /// What a step takes off each weight, times the step size (AdamW).
    #[arg(long, default_value_t = Options::default().weight_decay)]
    weight_decay: f64,
    /// With int8, make so many units of each whose activation would have seven bits, one for each part of its reach: a wider layer on
    /// the chip, with finer steps.
    #[arg(long, default_value_t = Options::default().unit_parts)]
    unit_parts: usize,
    /// Decides first weights, shuffling and which rows are held out.
    #[arg(long = "training-seed", default_value_t = Options::default().seed)]
    training_seed: u64,
}

impl OptionArgs {
    /// Trains with these options and prints the errors on held-out rows.
    pub fn train(&self, dataset: &Dataset) -> Result<Weights> {
        let options = self.options(dataset)?;
        let loss_plot = self.loss_plot.as_deref();
        run(dataset, self.held_out, &options, loss_plot)
    }

    fn options(&self, dataset: &Dataset) -> Result<Options> {
        let start = self.start.as_deref().map(Weights::load).transpose()?;
        Ok(Options {
            meaning: self.outputs.unwrap_or(match dataset.knows_places() {
                true => Meaning::ForceAndPlace,
                false => Meaning::ForceVector,
            }),
            arithmetic: self.arithmetic,
            patience: self.patience,
            start: start.map(|weights| weights.network),
            hidden: self.hidden.clone(),
            epochs: self.epochs,
            rounded_epochs: self.rounded_epochs,
            batch: self.batch,
            learning_rate: self.learning_rate,
            whitened: !self.plain_features,
            direction_weight: self.direction_weight,
            weight_decay: self.weight_decay,
            unit_parts: self.unit_parts,
            seed: self.training_seed,
        })
    }
}

/// A value by the name that files give it.
fn named<T: DeserializeOwned>(name: &str) -> Result<T, String> {
    serde_json::from_value(name.into()).map_err(|error| error.to_string())
}

/// Trains and prints the errors on held-out rows; draws the losses into a file, where one is named.
pub fn run(
    dataset: &Dataset,
    held_out: Split,
    options: &Options,
    loss_plot: Option<&Path>,
) -> Result<Weights> {
    let mut plot = LossPlot::default();
    let bar =
        hivtac_calibration::progress::bar("training", options.epochs + options.rounded_epochs);
    let fitted = fit(dataset, held_out, options, |progress: Progress| {
        bar.inc(1);
        let phase = if progress.rounded {
            "with rounding"
        } else {
            "in floats"
        };
        bar.set_message(format!("loss {:.5} {phase}", progress.loss));
        plot.add(progress);
        if let Some(path) = loss_plot {
            // The last write is checked below: a plot is no reason to lose a training.
            let _ = fs::write(path, plot.to_svg());
        }
    })?;
    bar.finish_and_clear();
    if let Some(path) = loss_plot {
        fs::write(path, plot.to_svg())
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(told(fitted, "held-out rows"))
}

fn told(fitted: Fit, rows: &str) -> Weights {
    println!("contact reading `{}`", fitted.weights.conditions.contact);
    print_errors(&format!("{rows}, floats"), &fitted.float);
    print_errors(&format!("{rows}, quantized"), &fitted.quantized);
    fitted.weights
}

/// Makes uncertainties anew, and prints the errors that they are from.
pub fn judged(weights: Weights, dataset: &Dataset) -> Result<Weights> {
    Ok(told(judged_by(weights, dataset)?, "rows of other sessions"))
}

/// Takes a network from a safetensors file and prints its errors on the data set.
pub fn import(dataset: &Dataset, tensors: &Path) -> Result<Weights> {
    let network = hivtac_calibration::import::load(tensors)?;
    let fitted = adopt(dataset, network, &tensors.display().to_string())?;
    Ok(told(fitted, "the data set"))
}

fn print_errors(what: &str, errors: &Errors) {
    let place = errors.place_rmse_mm().map_or(String::new(), |mm| {
        format!(", RMSE of the place {:.0} µm along x and y each", mm * 1e3)
    });
    println!(
        "{what}: {} rows, mean direction error {:.3}° ({:.3}° from {} mN up), RMSE of |F| {:.3} mN{}",
        errors.count(),
        errors.mean_direction_deg(),
        errors.mean_strong_direction_deg(),
        WEAK_N * 1e3,
        errors.magnitude_rmse_n() * 1e3,
        place,
    );
}
