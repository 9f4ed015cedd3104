//! From a data set to a weights file: split, fit, and measure what the chip makes of it on what was held out.

pub mod quick;

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_sensing::model::Model;
use hivtac_sensing::network::Network as ChipNetwork;

use crate::closed_form::{self, ClosedForm, Effort};
use crate::dataset::{Dataset, Observation, Split};
use crate::errors::{Errors, norm};
use crate::network::{Meaning, Network, Standardization};
use crate::quantize::export;
use crate::train::{Options, Progress, Samples, train};
use crate::weights::{Range, Training, Uncertainty, Weights, features_from_q16};

/// The fewest accepted rows to train on.
const FEWEST_ROWS: usize = 20;

/// A fitted model, with its errors on the rows that were held out and lie inside the calibrated range.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Ready to be saved or exported.
    pub weights: Weights,
    /// Errors of the model in floats.
    pub float: Errors,
    /// Errors of the same model as the chip computes it.
    pub quantized: Errors,
}

/// What a data set is fitted with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A network.
    Network,
    /// A closed form, and a network for what it leaves.
    Both,
}

type Rows<'a> = Vec<(&'a Observation, [f64; 3])>;

/// Trains on nine tenths of the accepted rows of a data set, its sessions tared, and measures on the rest.
///
/// # Errors
/// When the data set has too few accepted rows or none at rest, or training fails.
pub fn fit(
    dataset: &Dataset,
    split: Split,
    kind: Kind,
    options: &Options,
    report: impl FnMut(Progress),
) -> Result<Fit> {
    let dataset = dataset.clone().tared()?;
    let (training, held_out) = parts(&dataset, split, options.seed)?;
    let form = match kind {
        Kind::Network => None,
        Kind::Both => Some(form_of(&dataset, &training, Effort::Many)?),
    };
    ensure!(
        form.is_none() || options.meaning == Meaning::ForceVector,
        "beside a closed form a network answers with a force vector"
    );
    let rest = dataset.rest()?.features_px();
    let samples = |rows: &Rows<'_>| {
        samples(rows, options, |seen| match &form {
            Some(form) => form.force_n(&seen.features_px(), &rest),
            None => [0.0; 3],
        })
    };
    let network = train(&samples(&training), &samples(&held_out), options, report)?;
    let record = Training {
        seed: options.seed,
        epochs: options.epochs,
        rounded_epochs: options.rounded_epochs,
        ..record(&dataset, split, training.len())
    };
    measured(&dataset, form, network, record, &held_out)
}

/// Fits a closed form to nine tenths of the accepted rows of a data set and measures on the rest.
///
/// # Errors
/// When the data set has too few accepted rows or none at rest, or its forces are too alike.
pub fn fit_closed_form(dataset: &Dataset, split: Split, seed: u64) -> Result<Fit> {
    let dataset = dataset.clone().tared()?;
    let (training, held_out) = parts(&dataset, split, seed)?;
    let form = form_of(&dataset, &training, Effort::Many)?;
    let record = Training {
        seed,
        ..record(&dataset, split, training.len())
    };
    measured(
        &dataset,
        Some(form),
        no_network(&training)?,
        record,
        &held_out,
    )
}

/// Takes a network that was trained elsewhere: what the chip's hidden layers must carry, the rest position and the
/// uncertainties come from the data set.
///
/// # Errors
/// When the data set has no accepted row inside the calibrated range or none at rest, or the network does not fit the
/// chip.
pub fn adopt(dataset: &Dataset, network: Network, source: &str) -> Result<Fit> {
    let dataset = dataset.clone().tared()?;
    let rows = in_range(dataset.accepted());
    ensure!(
        !rows.is_empty(),
        "the data set has no accepted row inside the calibrated range"
    );
    let features: Vec<_> = rows.iter().map(|(seen, _)| seen.features_px()).collect();
    let network = Network {
        activation_max: network.activation_maxima(&features),
        ..network
    };
    let record = Training {
        scene: format!("imported from {source}"),
        ..Training::default()
    };
    measured(&dataset, None, network, record, &rows)
}

/// Rows to train on, and held-out ones inside the calibrated range.
fn parts(dataset: &Dataset, split: Split, seed: u64) -> Result<(Rows<'_>, Rows<'_>)> {
    let accepted = dataset.accepted().count();
    ensure!(
        accepted >= FEWEST_ROWS,
        "{accepted} accepted rows are too few to train on"
    );
    let [training, held_out] = split.of(dataset, seed)?.map(|rows| dataset.pick(&rows));
    Ok((training, in_range(held_out.into_iter())))
}

fn in_range<'a>(rows: impl Iterator<Item = (&'a Observation, [f64; 3])>) -> Rows<'a> {
    rows.filter(|(_, force)| norm(*force) <= Range::default().force_n)
        .collect()
}

fn form_of(dataset: &Dataset, rows: &Rows<'_>, effort: Effort) -> Result<ClosedForm> {
    let rows: Vec<_> = rows
        .iter()
        .map(|(seen, force)| (seen.features_px(), *force))
        .collect();
    closed_form::fit(&dataset.rest()?.features_px(), &rows, effort)
}

/// No layers, but the scaling that every model file has.
fn no_network(rows: &Rows<'_>) -> Result<Network> {
    let features: Vec<_> = rows.iter().map(|(seen, _)| seen.features_px()).collect();
    let forces: Vec<_> = rows.iter().map(|(_, force)| *force).collect();
    Ok(Network {
        input: Standardization::of(&features)?,
        output: Standardization::of_answers(&forces)?,
        ..Network::default()
    })
}

/// Measures a model on `rows` and writes down what it holds for.
fn measured(
    dataset: &Dataset,
    closed_form: Option<ClosedForm>,
    network: Network,
    training: Training,
    rows: &Rows<'_>,
) -> Result<Fit> {
    let mut weights = Weights {
        format: Weights::format(),
        conditions: dataset.about.conditions.clone(),
        rest: dataset.rest()?,
        range: Range::default(),
        uncertainty: Uncertainty::default(),
        training,
        closed_form,
        network,
    };
    let mut float = Errors::default();
    for (seen, force) in rows {
        float.add(weights.force_n(&seen.features_px()), *force);
    }
    let quantized = quantized_errors(&weights, rows)?;
    weights.uncertainty = Uncertainty {
        lateral_n: quantized.lateral_rmse_n(),
        normal_n: quantized.normal_rmse_n(),
    };
    Ok(Fit {
        weights,
        float,
        quantized,
    })
}

/// What the network shall answer: the force, less what is `known` of it without.
fn samples(
    rows: &Rows<'_>,
    options: &Options,
    known: impl Fn(&Observation) -> [f64; 3],
) -> Samples {
    let meaning = options
        .start
        .as_ref()
        .map_or(options.meaning, |start| start.meaning);
    let answer = |(seen, force): &(&Observation, [f64; 3])| {
        let known = known(seen);
        let left = std::array::from_fn(|i| force[i] - known[i]);
        (seen.features_px(), meaning.of_force(left))
    };
    let (features, answers) = rows.iter().map(answer).unzip();
    Samples { features, answers }
}

fn record(dataset: &Dataset, split: Split, rows: usize) -> Training {
    Training {
        scene: dataset.about.scene.clone(),
        data_seed: dataset.about.seed,
        rows,
        split,
        ..Training::default()
    }
}

/// Errors of the exported model, run by `sensing`'s own arithmetic.
fn quantized_errors(weights: &Weights, rows: &Rows<'_>) -> Result<Errors> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes)
        .map_err(|error| anyhow!("{error}"))
        .context("the exported model")?;
    let rest = model.rest.features;
    let (mut chip, mut errors) = (ChipNetwork::new(), Errors::default());
    let (meaning, units) = (
        weights.network.meaning,
        weights.network.meaning.chip_units(),
    );
    for (seen, force) in rows {
        let output = chip.run(&model, &features_from_q16(&seen.features_q16)?, &rest);
        let outputs = std::array::from_fn(|o| f64::from(output.values[o]) / units[o]);
        errors.add(meaning.to_force(outputs), *force);
    }
    Ok(errors)
}
