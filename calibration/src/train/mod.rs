//! Trains networks: first in floats, then with the chip's own integers in the forward pass.
//!
//! Networks this small need only three matrix products per layer and Adam, so the code is written
//! here. It gives the same bits on every machine.

mod adam;
mod loss;
mod mlp;
mod options;
mod product;
mod rounded;
mod state;
mod whitening;

use anyhow::{Context, Result, ensure};

use crate::network::{
    CONSTANT_ANSWER, INPUTS, Meaning, Network, OUTPUTS, PLACE_OUTPUTS, Standardization,
};
pub use options::{DirectionWeight, Options};
use state::{Phase, State};

/// Features and the answers wanted from the network.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Features (px, px²), row by row.
    pub features: Vec<[f64; INPUTS]>,
    /// Answers except places, in the units of the network's meaning, row by row.
    pub answers: Vec<[f64; OUTPUTS]>,
    /// The whole force (N) of each row; the answers may be a part of it. Used only by
    /// [`Options::direction_weight`].
    pub forces_n: Vec<[f64; OUTPUTS]>,
    /// The tip's place (mm), row by row, for a network that gives places; otherwise empty.
    pub places_mm: Vec<[f64; PLACE_OUTPUTS]>,
}

/// One finished pass over the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Passes finished, from 1.
    pub epoch: usize,
    /// All passes.
    pub epochs: usize,
    /// Whether the chip's rounding was on.
    pub rounded: bool,
    /// Mean squared error of the standardized answers over the pass. A constant answer has a loss
    /// of 1, unless [`Options::direction_weight`] weights rows.
    pub loss: f64,
    /// The same on the held-out samples after the pass; NaN without them.
    pub held_out: f64,
}

/// Trains a network. The same samples and options give the same network, on every machine.
///
/// `held_out` decides which pass was best: the result is the network after that pass. Without
/// held-out samples it is the network after the last.
///
/// # Errors
/// When there is too little data, the numbers of features and answers differ, or training diverges.
pub fn train(
    training: &Samples,
    held_out: &Samples,
    options: &Options,
    mut report: impl FnMut(Progress),
) -> Result<Network> {
    options.check()?;
    training.check(options).context("training data")?;
    ensure!(
        !training.features.is_empty(),
        "the data set has no usable row"
    );
    held_out.check(options).context("held-out data")?;
    let mut state = State::new(training, held_out, options)?;
    let epochs = options.epochs + options.rounded_epochs;
    let phases = [
        Phase {
            rounded: false,
            epochs: options.epochs,
            rate: options.learning_rate,
        },
        // A third of the first step: the weights are already near their optimum.
        Phase {
            rounded: true,
            epochs: options.rounded_epochs,
            rate: options.learning_rate / 3.0,
        },
    ];
    let mut before = 0;
    for phase in phases {
        state.begin(&phase, training)?;
        for epoch in 0..phase.epochs {
            let [loss, held_out] = state.pass(&phase, epoch)?;
            report(Progress {
                epoch: before + epoch + 1,
                epochs,
                rounded: phase.rounded,
                loss,
                held_out,
            });
            ensure!(
                loss.is_finite(),
                "training diverged: try a smaller learning rate"
            );
        }
        state.take_best();
        before += phase.epochs;
    }
    state
        .network()
        .context("training diverged: try a smaller learning rate")
}

impl Samples {
    fn check(&self, options: &Options) -> Result<()> {
        let (rows, answers) = (self.features.len(), self.answers.len());
        ensure!(
            rows == answers,
            "{rows} rows of features, but {answers} of answers"
        );
        let forces = self.forces_n.len();
        ensure!(
            options.direction_weight_in_use().is_none() || forces == rows,
            "{rows} rows of features, but {forces} of forces to weigh them by"
        );
        let (places, wanted) = (self.places_mm.len(), options.meaning_in_use().tells_place());
        ensure!(
            places == if wanted { rows } else { 0 },
            "{rows} rows of features, but {places} of places, which the network shall {}tell",
            if wanted { "" } else { "not " }
        );
        let finite = |row: &[f64]| row.iter().all(|x| x.is_finite());
        let odd = (0..rows).find(|&i| !finite(&self.features[i]) || !finite(&self.answer(i)));
        ensure!(
            odd.is_none(),
            "row {} holds a number that is not finite",
            odd.unwrap_or(0)
        );
        Ok(())
    }
}

impl Samples {
    /// All answers wanted for a row.
    fn answer(&self, row: usize) -> Vec<f64> {
        let place = self.places_mm.get(row).into_iter().flatten();
        self.answers[row].iter().chain(place).copied().collect()
    }
}

/// The largest ratio of a component's deviation to the common one. With a larger ratio, nobody
/// tilted the force on purpose.
const MOST_APART: f64 = 16.0;

/// Scaling of features and answers, from the data.
///
/// The varying components of a force share the smallest of their deviations, so that a millinewton
/// counts the same in each. F_z varies several times as much as F_x and F_y; with its own deviation
/// it would be learnt more coarsely by the same factor. A place has deviations of its own.
fn scaling(training: &Samples, meaning: Meaning) -> Result<[Standardization; 2]> {
    let mut answers = Standardization::of_answers(&training.answers)?;
    if meaning.is_vector() {
        let varying = |sigma: &&mut f64| **sigma > CONSTANT_ANSWER;
        let most = answers.sigma.iter().copied().fold(0.0, f64::max);
        let shared = answers.sigma.iter_mut().filter(varying);
        let least = shared.fold(most, |least, sigma| least.min(*sigma));
        let common = least.max(most / MOST_APART);
        let shared = answers.sigma.iter_mut().filter(varying);
        shared.for_each(|sigma| *sigma = common);
    }
    if meaning.tells_place() {
        let places = Standardization::of_answers(&training.places_mm)?;
        answers.mean.extend(places.mean);
        answers.sigma.extend(places.sigma);
    }
    Ok([Standardization::of(&training.features)?, answers])
}

#[cfg(test)]
mod tests;
