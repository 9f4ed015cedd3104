//! How to train.

use anyhow::{Result, ensure};

use crate::network::{Arithmetic, Layer, Meaning, Network};

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
    /// Weighs what is off across each row's force by 1 / √(|F|² + (10 mN)²), times what makes the mean weight this, so that weak
    /// forces' directions count, too; what is off along the force counts 1 everywhere. For force vectors. `None` weighs nothing.
    pub direction_weight: Option<f64>,
    /// Each step takes this times the step size off every weight (AdamW), biases excepted. What no data ask for goes away, such
    /// as the weights of components that never vary, which would make the chip's rounding of inputs larger.
    pub weight_decay: f64,
    /// Before training with rounding, each unit whose activation would have seven bits becomes so many, one for each part of its
    /// reach ([`Network::split`]): the layer is as many times wider on the chip, and its steps as many times finer. For int8.
    pub unit_parts: usize,
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
            direction_weight: None,
            weight_decay: 0.0,
            unit_parts: 1,
            seed: 1,
            start: None,
        }
    }
}

impl Options {
    /// What the outputs of the trained network are.
    pub(crate) fn meaning_in_use(&self) -> Meaning {
        self.start.as_ref().map_or(self.meaning, |it| it.meaning)
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
        self.check_weighing()?;
        self.check_parts()
    }

    fn check_weighing(&self) -> Result<()> {
        let usable = |part: f64| part.is_finite() && part >= 0.0;
        ensure!(
            usable(self.weight_decay),
            "the weight decay must be zero or above"
        );
        let Some(weight) = self.direction_weight else {
            return Ok(());
        };
        ensure!(
            weight.is_finite() && weight > 0.0,
            "the weight of directions must be above zero"
        );
        ensure!(
            self.meaning_in_use().is_vector(),
            "directions are weighed for networks that answer with a force vector only"
        );
        Ok(())
    }

    fn check_parts(&self) -> Result<()> {
        let start = self.start.as_ref();
        ensure!(
            self.epochs == 0 || !start.is_some_and(|it| it.saturates),
            "the network to go on from has units in parts: it can go on with rounding only, without passes in floats"
        );
        if self.unit_parts == 1 {
            return Ok(());
        }
        ensure!(self.unit_parts > 1, "a unit has at least one part");
        ensure!(
            self.arithmetic != Arithmetic::Int16 && self.rounded_epochs > 0,
            "units are split for int8, and before passes with rounding: ask for these, or leave the units whole"
        );
        let hidden = start.map_or_else(
            || self.hidden.clone(),
            |it| {
                it.layers
                    .iter()
                    .map(Layer::outputs)
                    .take(it.activation_max.len())
                    .collect()
            },
        );
        let (_, coarse) = hidden.split_last().unwrap_or((&0, &[]));
        ensure!(
            !coarse.is_empty(),
            "units are split between two hidden layers: this network has fewer, and no activation of seven bits"
        );
        let widest = coarse.iter().max().unwrap_or(&0) * self.unit_parts;
        ensure!(
            widest <= WIDEST,
            "units in {} parts make a layer {widest} wide: the most is {WIDEST}",
            self.unit_parts
        );
        Ok(())
    }
}
