//! The training commands.

use anyhow::Result;
use clap::Args;
use hivtac_calibration::dataset::Dataset;
use hivtac_calibration::errors::{Errors, WEAK_N};
use hivtac_calibration::fit::fit;
use hivtac_calibration::train::{Options, Progress};
use hivtac_calibration::weights::Weights;

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
    /// Adam's first step size; it falls linearly.
    #[arg(long, default_value_t = Options::default().learning_rate)]
    learning_rate: f64,
    /// Decides first weights, shuffling and which rows are held out.
    #[arg(long = "training-seed", default_value_t = Options::default().seed)]
    training_seed: u64,
}

impl OptionArgs {
    fn options(&self) -> Options {
        Options {
            hidden: self.hidden.clone(),
            epochs: self.epochs,
            rounded_epochs: self.rounded_epochs,
            batch: self.batch,
            learning_rate: self.learning_rate,
            seed: self.training_seed,
        }
    }
}

/// Trains and prints the errors on held-out rows.
pub fn run(dataset: &Dataset, args: &OptionArgs) -> Result<Weights> {
    let options = args.options();
    let bar = crate::bar("training", options.epochs + options.rounded_epochs);
    let fitted = fit(dataset, &options, |progress: Progress| {
        bar.inc(1);
        let phase = if progress.rounded {
            "with rounding"
        } else {
            "in floats"
        };
        bar.set_message(format!("loss {:.5} {phase}", progress.loss));
    })?;
    bar.finish_and_clear();
    print_errors("held-out rows, floats", &fitted.float);
    print_errors("held-out rows, quantized", &fitted.quantized);
    Ok(fitted.weights)
}

fn print_errors(what: &str, errors: &Errors) {
    println!(
        "{what}: {} rows, mean direction error {:.3}° ({:.3}° from {} mN up), RMSE of |F| {:.3} mN",
        errors.count(),
        errors.mean_direction_deg(),
        errors.mean_strong_direction_deg(),
        WEAK_N * 1e3,
        errors.magnitude_rmse_n() * 1e3,
    );
}
