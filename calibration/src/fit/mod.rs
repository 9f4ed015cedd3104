//! Fits a network to a data set and makes a weights file: splits, trains, and measures the chip's
//! errors on held-out rows.

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network as ChipNetwork;
use hivtac_terms::marker::LEAST_MARKERS;

use crate::data::dataset::{About, Dataset, Observation, Sample};
use crate::data::loads::norm;
use crate::data::range::Range;
use crate::data::rest::features_from_q16;
use crate::evaluation::errors::Errors;
use crate::network::Network;
use crate::quantize::export;
use crate::train::{Options, Progress, Samples, train};
use crate::uncertainty::Miss;
use crate::weights::{Training, Uncertainty, Weights};

/// The unit of the split, in files: single rows, whatever their pose.
const WITHIN_POSE: &str = "within-pose";

/// The fewest accepted rows to train on.
const FEWEST_ROWS: usize = 20;

/// A fitted model, with its errors on the held-out rows inside the calibrated range. Its
/// uncertainties come from all held-out rows, so that they are known up to the range's end.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Ready to save or export.
    pub weights: Weights,
    /// Errors of the model in floats.
    pub float: Errors,
    /// Errors of the same model as the chip computes it.
    pub quantized: Errors,
}

type Rows<'a> = Vec<Sample<'a>>;

/// Trains on nine tenths of the accepted rows of a data set, its sessions tared, and measures on
/// the others.
///
/// # Errors
/// When the data set has too few accepted rows or none at rest, or training fails.
pub fn fit(dataset: &Dataset, options: &Options, report: impl FnMut(Progress)) -> Result<Fit> {
    ensure!(
        dataset.about.conditions.markers == LEAST_MARKERS,
        "networks are of four dots, and the data set is of {}",
        dataset.about.conditions.markers
    );
    let dataset = dataset.clone().tared()?;
    let (training, held_out) = parts(&dataset, options.seed)?;
    ensure!(
        dataset.knows_places() || !options.meaning_in_use().tells_place(),
        "the data set does not know where the tip is: no network can learn it"
    );
    let judges = samples(&in_range(&held_out, &calibrated(&dataset.about)), options);
    let network = train(&samples(&training, options), &judges, options, report)?;
    let record = Training {
        seed: options.seed,
        epochs: options.epochs,
        rounded_epochs: options.rounded_epochs,
        ..record(&dataset, training.len())
    };
    finished(&dataset, network, record, &held_out)
}

/// Rows to train on, and held-out ones.
fn parts(dataset: &Dataset, seed: u64) -> Result<(Rows<'_>, Rows<'_>)> {
    let accepted = dataset.accepted().count();
    ensure!(
        accepted >= FEWEST_ROWS,
        "{accepted} accepted rows are too few to train on"
    );
    let [training, held_out] = dataset.split(seed)?.map(|rows| dataset.pick(&rows));
    Ok((training, held_out))
}

/// Ratio of a data set's range to the range calibrated with it, if it has places: for forces, a
/// tenth more; for places, a twentieth more.
const BEYOND: f64 = 1.1;
const PLACE_BEYOND: f64 = 1.05;

/// The range for which a model of such a data set is calibrated. The paper's range; if the tip may
/// be anywhere, the range that the data set fills.
fn calibrated(about: &About) -> Range {
    if !about.range.knows_places() {
        return Range::default();
    }
    Range {
        force_n: about.range.force_n / BEYOND,
        alpha_deg: about.range.alpha_deg / BEYOND,
        beta_deg: about.range.beta_deg / BEYOND,
        place_mm: about.range.place_mm / PLACE_BEYOND,
    }
}

fn in_range<'a>(rows: &[Sample<'a>], range: &Range) -> Rows<'a> {
    let inside = rows.iter().filter(|row| is_inside(row, range));
    inside.copied().collect()
}

fn is_inside(row: &Sample<'_>, range: &Range) -> bool {
    let near = |tip: [f64; 2]| tip.iter().all(|part| part.abs() <= range.place_mm);
    norm(row.force_n) <= range.force_n && row.tip_mm.is_none_or(near)
}

/// Records a model's conditions, and measures it on `rows` that were not used to make it.
fn finished(
    dataset: &Dataset,
    network: Network,
    training: Training,
    rows: &Rows<'_>,
) -> Result<Fit> {
    let mut range = calibrated(&dataset.about);
    if !network.meaning.tells_place() {
        range.place_mm = 0.0;
    }
    let weights = Weights {
        format: Weights::format(),
        conditions: dataset.about.conditions.clone(),
        rest: dataset.rest()?,
        range,
        uncertainty: Uncertainty::default(),
        training,
        film: None,
        network: Some(network),
    };
    let tare = features_from_q16(&weights.rest.features_q16)?;
    measured(weights, &tare, rows)
}

/// Measures a model on rows that were not used to make it: its errors, and its uncertainties from
/// them.
fn measured(mut weights: Weights, tare: &Features, rows: &Rows<'_>) -> Result<Fit> {
    let answers = quantized_answers(&weights, tare, rows)?;
    let misses: Vec<Miss> = answers
        .iter()
        .zip(rows)
        .filter(|(_, row)| row.force_n != [0.0; 3])
        .map(|(found, row)| found.miss(row))
        .collect();
    weights.uncertainty = Uncertainty::of(&misses, weights.range.force_n)?;
    let (mut float, mut quantized) = (Errors::default(), Errors::default());
    let judged = rows.iter().zip(answers);
    // If the model gives no place, the range of places does not matter.
    let range = Range {
        place_mm: match weights.network()?.meaning.tells_place() {
            true => weights.range.place_mm,
            false => f64::INFINITY,
        },
        ..weights.range
    };
    for (row, found) in judged.filter(|(row, _)| is_inside(row, &range)) {
        Answer::in_floats(weights.network()?, row.seen).add_to(&mut float, row);
        found.add_to(&mut quantized, row);
    }
    Ok(Fit {
        weights,
        float,
        quantized,
    })
}

/// A model's answer to a row.
struct Answer {
    force_n: [f64; 3],
    place_mm: Option<[f64; 2]>,
}

impl Answer {
    fn in_floats(network: &Network, seen: &Observation) -> Self {
        let features = seen.features_px();
        Self {
            force_n: network.force_n(&features),
            place_mm: network.place_mm(&features),
        }
    }

    /// The found and the true place, mm, if both are known.
    fn places(&self, row: &Sample<'_>) -> Option<([f64; 2], [f64; 2])> {
        self.place_mm.zip(row.tip_mm)
    }

    fn miss(&self, row: &Sample<'_>) -> Miss {
        let far = |(found, truth): ([f64; 2], [f64; 2])| {
            let off = [0, 1].map(|axis| found[axis] - truth[axis]);
            (off[0] * off[0] + off[1] * off[1]).sqrt()
        };
        let miss = Miss::of(self.force_n, row.force_n);
        miss.with_place_mm(self.places(row).map_or(0.0, far))
    }

    fn add_to(&self, errors: &mut Errors, row: &Sample<'_>) {
        errors.add(self.force_n, row.force_n);
        if let Some((found, truth)) = self.places(row) {
            errors.add_place(found, truth);
        }
    }
}

/// The answers wanted from the network: force and place.
fn samples(rows: &Rows<'_>, options: &Options) -> Samples {
    let meaning = options.meaning_in_use();
    let answer = |row: &Sample<'_>| (row.seen.features_px(), meaning.of_force(row.force_n));
    let (features, answers) = rows.iter().map(answer).unzip();
    // An untouched film counts as touched in its middle.
    let place = |row: &Sample<'_>| row.tip_mm.unwrap_or_default();
    Samples {
        features,
        answers,
        forces_n: rows.iter().map(|row| row.force_n).collect(),
        places_mm: match meaning.tells_place() {
            true => rows.iter().map(place).collect(),
            false => Vec::new(),
        },
    }
}

fn record(dataset: &Dataset, rows: usize) -> Training {
    Training {
        scene: dataset.about.scene.clone(),
        data_seed: dataset.about.seed,
        rows,
        split: WITHIN_POSE.to_owned(),
        ..Training::default()
    }
}

/// The exported model's answers, computed by the sensing's own arithmetic.
fn quantized_answers(weights: &Weights, tare: &Features, rows: &Rows<'_>) -> Result<Vec<Answer>> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes)
        .map_err(|error| anyhow!("{error}"))
        .context("the exported model")?;
    let mut chip = ChipNetwork::new();
    let meaning = weights.network()?.meaning;
    let units = meaning.chip_units();
    let mut answer = |row: &Sample<'_>| {
        let output = chip.run(&model, &features_from_q16(&row.seen.features_q16)?, tare);
        let outputs = std::array::from_fn(|o| f64::from(output.values[o]) / units[o]);
        let place_mm = output.place.map(|um| f64::from(um) / 1e3);
        Ok(Answer {
            force_n: meaning.to_force(outputs),
            place_mm: meaning.tells_place().then_some(place_mm),
        })
    };
    rows.iter().map(&mut answer).collect()
}
