//! From a data set to a weights file: split, train, and measure the quantized network on what was held out.

use anyhow::{Result, anyhow, ensure};
use hivtac_sensing::model::Model;
use hivtac_sensing::network::Network as ChipNetwork;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::dataset::{Dataset, Observation};
use crate::errors::{Errors, norm};
use crate::quantize::export;
use crate::train::{Options, Progress, Samples, train};
use crate::weights::{Range, Training, Uncertainty, Weights, features_from_q16};

/// One accepted row in this many is held out.
const HELD_OUT_PART: usize = 10;

/// A fitted network, with its errors on the rows that were held out and lie inside the calibrated range.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Ready to be saved or exported.
    pub weights: Weights,
    /// Errors of the network in floats.
    pub float: Errors,
    /// Errors of the same network as the chip computes it.
    pub quantized: Errors,
}

type Held<'a> = Vec<(&'a Observation, [f64; 3])>;

/// Trains on nine tenths of the accepted rows of a data set and measures on the rest.
///
/// # Errors
/// When the data set has too few accepted rows or none at rest, or training fails.
pub fn fit(dataset: &Dataset, options: &Options, report: impl FnMut(Progress)) -> Result<Fit> {
    let mut rows: Held<'_> = dataset.accepted().collect();
    ensure!(
        rows.len() >= 2 * HELD_OUT_PART,
        "{} accepted rows are too few to train on",
        rows.len()
    );
    rows.shuffle(&mut ChaCha8Rng::seed_from_u64(options.seed));
    let training = rows.split_off(rows.len() / HELD_OUT_PART);
    let range = Range::default();
    rows.retain(|(_, force)| norm(*force) <= range.force_n);

    let network = train(&samples(&training), options, report)?;
    let mut float = Errors::default();
    for (seen, force) in &rows {
        float.add(network.predict(&seen.features_px()), *force);
    }
    let mut weights = Weights {
        format: Weights::format(),
        conditions: dataset.about.conditions.clone(),
        rest: dataset.rest()?,
        range,
        uncertainty: Uncertainty::default(),
        training: record(dataset, options, training.len()),
        network,
    };
    let quantized = quantized_errors(&weights, &rows)?;
    let (lateral_n, normal_n) = (quantized.lateral_rmse_n(), quantized.normal_rmse_n());
    weights.uncertainty = Uncertainty {
        lateral_n,
        normal_n,
    };
    Ok(Fit {
        weights,
        float,
        quantized,
    })
}

fn samples(rows: &[(&Observation, [f64; 3])]) -> Samples {
    let (features, forces) = rows
        .iter()
        .map(|(seen, force)| (seen.features_px(), *force))
        .unzip();
    Samples { features, forces }
}

fn record(dataset: &Dataset, options: &Options, rows: usize) -> Training {
    Training {
        scene: dataset.about.scene.clone(),
        data_seed: dataset.about.seed,
        rows,
        seed: options.seed,
        epochs: options.epochs,
        rounded_epochs: options.rounded_epochs,
    }
}

/// Errors of the exported network, run by `sensing`'s own arithmetic.
fn quantized_errors(weights: &Weights, rows: &Held<'_>) -> Result<Errors> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
    let rest = model.rest.features;
    let mut chip = ChipNetwork::new();
    let mut errors = Errors::default();
    for (seen, force) in rows {
        let output = chip.run(&model, &features_from_q16(&seen.features_q16)?, &rest);
        errors.add(output.values.map(|un| f64::from(un) / 1e6), *force);
    }
    Ok(errors)
}
