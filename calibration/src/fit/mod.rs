//! From a data set to a weights file: split, fit, and measure what the chip makes of it on what was held out.

pub mod quick;

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_sensing::features::Features;
use hivtac_sensing::model::Model;
use hivtac_sensing::network::Network as ChipNetwork;

use crate::closed_form::{self, ClosedForm, Effort};
use crate::dataset::{Dataset, Observation, Split};
use crate::errors::{Errors, norm};
use crate::network::{Meaning, Network, Standardization};
use crate::quantize::export;
use crate::train::{Options, Progress, Samples, train};
use crate::uncertainty::Miss;
use crate::weights::{Range, Training, Uncertainty, Weights, features_from_q16};

/// The fewest accepted rows to train on.
const FEWEST_ROWS: usize = 20;

/// A fitted model, with its errors on the rows that were held out and lie inside the calibrated range. Its uncertainties are
/// from all that were held out, so that they are known up to the range's end.
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
    let judges = samples(&in_range(held_out.iter().copied()));
    let network = train(&samples(&training), &judges, options, report)?;
    let record = Training {
        seed: options.seed,
        epochs: options.epochs,
        rounded_epochs: options.rounded_epochs,
        ..record(&dataset, split, training.len())
    };
    finished(&dataset, form, network, record, &held_out)
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
    finished(
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
    let rows: Rows<'_> = dataset.accepted().collect();
    let inside = in_range(rows.iter().copied());
    ensure!(
        !inside.is_empty(),
        "the data set has no accepted row inside the calibrated range"
    );
    let features: Vec<_> = inside.iter().map(|(seen, _)| seen.features_px()).collect();
    let network = Network {
        activation_max: network.activation_maxima(&features),
        ..network
    };
    let record = Training {
        scene: format!("imported from {source}"),
        ..Training::default()
    };
    finished(&dataset, None, network, record, &rows)
}

/// Makes a model's uncertainties anew, from a data set that it was not made from, its sessions tared: what it is off by in
/// other set-ups than that of its training.
///
/// # Errors
/// When the data set is for other conditions, or has no accepted row with a force or none at rest.
pub fn judged_by(weights: Weights, dataset: &Dataset) -> Result<Fit> {
    ensure!(
        dataset.about.conditions == weights.conditions,
        "the weights are for other conditions than the data set's: {:?} and {:?}",
        weights.conditions,
        dataset.about.conditions
    );
    let dataset = dataset.clone().tared()?;
    let tare = features_from_q16(&dataset.rest()?.features_q16)?;
    measured(weights, &tare, &dataset.accepted().collect())
}

/// Rows to train on, and held-out ones.
fn parts(dataset: &Dataset, split: Split, seed: u64) -> Result<(Rows<'_>, Rows<'_>)> {
    let accepted = dataset.accepted().count();
    ensure!(
        accepted >= FEWEST_ROWS,
        "{accepted} accepted rows are too few to train on"
    );
    let [training, held_out] = split.of(dataset, seed)?.map(|rows| dataset.pick(&rows));
    Ok((training, held_out))
}

fn in_range<'a>(rows: impl Iterator<Item = (&'a Observation, [f64; 3])>) -> Rows<'a> {
    rows.filter(|(_, force)| is_inside(force)).collect()
}

fn is_inside(force: &[f64; 3]) -> bool {
    norm(*force) <= Range::default().force_n
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

/// Writes down what a model holds for, and measures it on `rows` that it was not made from.
fn finished(
    dataset: &Dataset,
    closed_form: Option<ClosedForm>,
    network: Network,
    training: Training,
    rows: &Rows<'_>,
) -> Result<Fit> {
    let weights = Weights {
        format: Weights::format(),
        conditions: dataset.about.conditions.clone(),
        rest: dataset.rest()?,
        range: Range::default(),
        uncertainty: Uncertainty::default(),
        training,
        closed_form,
        network,
    };
    let tare = features_from_q16(&weights.rest.features_q16)?;
    measured(weights, &tare, rows)
}

/// Measures a model on rows that it was not made from: its errors, and from these its uncertainties.
fn measured(mut weights: Weights, tare: &Features, rows: &Rows<'_>) -> Result<Fit> {
    let answers = quantized_answers(&weights, tare, rows)?;
    let misses: Vec<Miss> = answers
        .iter()
        .zip(rows)
        .filter(|(_, (_, truth))| *truth != [0.0; 3])
        .map(|(found, (_, truth))| Miss::of(*found, *truth))
        .collect();
    weights.uncertainty = Uncertainty::of(&misses, weights.range.force_n)?;
    let (mut float, mut quantized) = (Errors::default(), Errors::default());
    for ((seen, force), found) in rows
        .iter()
        .zip(answers)
        .filter(|((_, force), _)| is_inside(force))
    {
        float.add(weights.force_n(&seen.features_px()), *force);
        quantized.add(found, *force);
    }
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
    Samples {
        features,
        answers,
        forces_n: rows.iter().map(|(_, force)| *force).collect(),
    }
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

/// The forces (N) that the exported model gives, run by `sensing`'s own arithmetic.
fn quantized_answers(weights: &Weights, tare: &Features, rows: &Rows<'_>) -> Result<Vec<[f64; 3]>> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes)
        .map_err(|error| anyhow!("{error}"))
        .context("the exported model")?;
    let mut chip = ChipNetwork::new();
    let (meaning, units) = (
        weights.network.meaning,
        weights.network.meaning.chip_units(),
    );
    let mut answer = |(seen, _): &(&Observation, [f64; 3])| {
        let output = chip.run(&model, &features_from_q16(&seen.features_q16)?, tare);
        let outputs = std::array::from_fn(|o| f64::from(output.values[o]) / units[o]);
        Ok(meaning.to_force(outputs))
    };
    rows.iter().map(&mut answer).collect()
}
