//! Options of a training.

use std::path::Path;

use anyhow::{Result, ensure};
use clap::Args;

use crate::import;
use crate::network::{Arithmetic, Meaning, Network};
use crate::weights::Weights;

/// The widest layer that a model file can hold.
const WIDEST: usize = hivtac_sensor::force::layer::MAX_WIDTH;
/// The most layers between inputs and outputs.
const MOST_HIDDEN: usize = hivtac_sensor::force::model::MAX_LAYERS - 1;

/// How to train. Those without an argument are for studies of other networks; their defaults are
/// best.
#[derive(Args, Clone, Debug, PartialEq)]
pub struct Options {
    /// Widths of the hidden layers.
    #[arg(long, value_delimiter = ',', default_values_t = Options::default().hidden)]
    pub hidden: Vec<usize>,
    /// The meaning of the outputs.
    #[arg(skip)]
    pub meaning: Meaning,
    /// How the chip holds the weights.
    #[arg(long, value_enum, default_value_t)]
    pub arithmetic: Arithmetic,
    /// Passes over the data in floats.
    #[arg(long, default_value_t = Options::default().epochs)]
    pub epochs: usize,
    /// Passes over the data after that, with the chip's rounding.
    #[arg(long, default_value_t = Options::default().rounded_epochs)]
    pub rounded_epochs: usize,
    /// Rows that share one optimizer step.
    #[arg(skip = Options::default().batch)]
    pub batch: usize,
    /// Adam's step size at the beginning; it falls linearly to nothing.
    #[arg(skip = Options::default().learning_rate)]
    pub learning_rate: f64,
    /// Weights errors by their effect on the direction. `None` for no weights; outputs of angles
    /// are never weighted.
    #[arg(skip = Options::default().direction_weight)]
    pub direction_weight: Option<DirectionWeight>,
    /// Decides first weights and shuffling.
    #[arg(skip = Options::default().seed)]
    pub seed: u64,
    /// A weights file, or a network of PyTorch (.safetensors), to go on from instead of random
    /// weights; its widths, outputs and scaling then hold.
    #[arg(long, value_name = "FILE", value_parser = network_in)]
    pub start: Option<Network>,
}

/// Weights errors across each row's force by 1 / √(|F|² + floor²), scaled so that the mean weight
/// of all rows is `mean`. Thus directions of weak forces count as well; errors along the force
/// always weigh 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DirectionWeight {
    /// Mean of the weights, above 0.
    pub mean: f64,
    /// Below this |F|, N, above 0, the weight grows no further.
    pub floor_n: f64,
}

impl Default for Options {
    /// The default model's options, without the place.
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            meaning: Meaning::ForceVector,
            arithmetic: Arithmetic::Int8PerChannel,
            epochs: 600,
            rounded_epochs: 450,
            batch: 256,
            learning_rate: 5e-3,
            direction_weight: Some(DirectionWeight {
                mean: 40.0,
                floor_n: 0.15,
            }),
            seed: 1,
            start: None,
        }
    }
}

/// The network in a weights file or in a file from PyTorch.
fn network_in(file: &str) -> Result<Network, String> {
    let path = Path::new(file);
    let network = match path.extension().is_some_and(|it| it == "safetensors") {
        true => import::load(path),
        false => Weights::load(path).and_then(|weights| weights.network().cloned()),
    };
    network.map_err(|error| format!("{error:#}"))
}

impl Options {
    /// Meaning of the trained network's outputs.
    pub(crate) fn meaning_in_use(&self) -> Meaning {
        self.start.as_ref().map_or(self.meaning, |it| it.meaning)
    }

    /// The weight of directions; `None` when the outputs are angles.
    pub(super) fn direction_weight_in_use(&self) -> Option<DirectionWeight> {
        let is_vector = self.meaning_in_use().is_vector();
        self.direction_weight.filter(|_| is_vector)
    }

    pub(super) fn check(&self) -> Result<()> {
        ensure!(self.batch > 0, "a batch needs at least one row");
        ensure!(
            self.hidden.iter().all(|w| (1..=WIDEST).contains(w)),
            "hidden layers are 1 to {WIDEST} wide"
        );
        ensure!(
            self.hidden.len() <= MOST_HIDDEN,
            "a network has at most {MOST_HIDDEN} hidden layers"
        );
        ensure!(
            self.learning_rate > 0.0 && self.learning_rate.is_finite(),
            "the learning rate must be above zero"
        );
        self.start.as_ref().map_or(Ok(()), Network::validate)?;
        self.check_weighing()
    }

    fn check_weighing(&self) -> Result<()> {
        let Some(weight) = self.direction_weight else {
            return Ok(());
        };
        ensure!(
            [weight.mean, weight.floor_n]
                .iter()
                .all(|part| part.is_finite() && *part > 0.0),
            "the weight of directions, and its floor, must be above zero"
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        options: Options,
    }

    #[test]
    fn without_arguments_they_are_the_default() {
        assert_eq!(Command::parse_from(["train"]).options, Options::default());
    }
}
