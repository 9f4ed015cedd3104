//! How to train.

use anyhow::{Result, ensure};

use crate::network::{Arithmetic, Meaning, Network};

/// The widest layer that a model file can hold.
const WIDEST: usize = hivtac_sensing::model::MAX_WIDTH;
/// The most layers between inputs and outputs.
const MOST_HIDDEN: usize = hivtac_sensing::model::MAX_LAYERS - 1;

/// How to train.
#[derive(Clone, Debug)]
pub struct Options {
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// What the outputs are.
    pub meaning: Meaning,
    /// How the chip holds the weights.
    pub arithmetic: Arithmetic,
    /// Passes over the data in floats.
    pub epochs: usize,
    /// Passes over the data after that, with the chip's rounding.
    pub rounded_epochs: usize,
    /// Rows that share one optimizer step.
    pub batch: usize,
    /// Adam's step size at the beginning; it falls linearly to nothing.
    pub learning_rate: f64,
    /// Passes without a better loss on held-out samples after which a phase ends early; 0 for never.
    pub patience: usize,
    /// Whether the first layer is trained on the features' principal components, weak ones made larger; the network is then
    /// folded back to features.
    pub whitened: bool,
    /// Decides first weights and shuffling.
    pub seed: u64,
    /// A network to go on from instead of random weights; its widths, meaning and scaling then hold.
    pub start: Option<Network>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            hidden: vec![64, 64],
            meaning: Meaning::ForceVector,
            arithmetic: Arithmetic::Int8PerChannel,
            epochs: 150,
            rounded_epochs: 100,
            batch: 256,
            learning_rate: 5e-3,
            patience: 0,
            whitened: true,
            seed: 1,
            start: None,
        }
    }
}

impl Options {
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
        self.start.as_ref().map_or(Ok(()), Network::validate)
    }
}
