//! `hivtac-studies tradeoff`: the best configuration under a user's limits (`docs/tradeoff.md`).

mod model;
mod pick;

use std::fmt;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;
use hivtac_calibration::progress::bar;
use hivtac_terms::conditions::CentroidEstimator;
use serde::Deserialize;

use pick::{Limits, best};

/// Every configuration that was measured: its accuracy, simulated, and its cost, modelled.
const TABLE: &str = include_str!("../../tradeoff/configurations.csv");
/// The core's cycles in a microsecond.
const CYCLES_PER_US: f64 = 480.0;

/// Under which limits to pick, and whether to train what is picked.
#[derive(Args)]
pub struct TradeoffArgs {
    /// Pick the best that takes at most so many µs a frame, at 480 MHz, modelled.
    #[arg(long)]
    budget_us: Option<f64>,
    /// Pick the best that the core can do at least so often a second, modelled.
    #[arg(long)]
    min_rate: Option<f64>,
    /// Pick the fastest whose mean direction error from 50 mN up is at most this, simulated; the
    /// upper end of its interval counts.
    #[arg(long)]
    max_error_deg: Option<f64>,
    /// Train the pick on as many frames as the default model, and write its model and settings into
    /// this folder. Without any limit the pick is the default.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// One configuration, as a row of the table has it.
#[derive(Clone, Debug, Deserialize)]
struct Configuration {
    /// Columns and rows of a frame.
    width: u16,
    height: u16,
    /// How markers' positions are taken: `binary` or `weighted`.
    centroid: String,
    /// Widths of the network's hidden layers, such as `64-64`.
    network: String,
    /// How its numbers are held: `f32`, `int16` or `int8 per channel`.
    numbers: String,
    /// Gauss–Newton steps from the network's answer, at the least; 0: it stands alone.
    steps: u8,
    /// How far it is from use: `firmware` does it; a `camera` delivers it, but the firmware captures
    /// another size; `none`: the chip runs no floats, or no camera has the size.
    reach: String,
    /// Mean angle between found and true force, degrees.
    direction_deg: f64,
    /// The same from 50 mN up, and half of the interval that holds the true mean with 95 %.
    strong_direction_deg: f64,
    strong_direction_deg_95: Option<f64>,
    /// Root mean square error of |F|, mN, and of each coordinate of the place, µm.
    force_rmse_mn: f64,
    place_rmse_um: f64,
    /// Frames that no single contact explains, in parts of those that are judged.
    unexplained: f64,
    /// Of a frame; none of floats, which the chip does not run.
    modelled_cycles: Option<i64>,
    /// From the last pixel to the sample, µs.
    latency_microseconds: Option<f64>,
}

impl TradeoffArgs {
    /// Picks, says what, and trains it when a folder is given.
    pub fn run(&self) -> Result<()> {
        let limits = Limits {
            budget_us: self.budget_us,
            min_rate: self.min_rate,
            max_error_deg: self.max_error_deg,
        };
        let all = configurations()?;
        let picked = best(&all, &limits)?;
        println!("{}", told(picked));
        if let Some(folder) = &self.out {
            let rendering = bar("rendering", model::FRAMES);
            println!("{}", model::write(picked, folder, || rendering.inc(1))?);
        }
        Ok(())
    }
}

fn configurations() -> Result<Vec<Configuration>> {
    let rows = csv::Reader::from_reader(TABLE.as_bytes()).into_deserialize();
    let rows: Result<_, csv::Error> = rows.collect();
    rows.context("studies/tradeoff/configurations.csv")
}

impl Configuration {
    /// As the sensing has it.
    fn estimator(&self) -> CentroidEstimator {
        match self.centroid.as_str() {
            "binary" => CentroidEstimator::BinaryMask,
            _ => CentroidEstimator::RednessWeighted,
        }
    }

    fn microseconds(&self) -> Option<f64> {
        Some(self.modelled_cycles? as f64 / CYCLES_PER_US)
    }

    /// Frames a second.
    fn rate(&self) -> Option<f64> {
        Some(1e6 / self.microseconds()?)
    }

    /// The upper end of the interval of the direction error from 50 mN up, degrees.
    fn limit_error_deg(&self) -> f64 {
        self.strong_direction_deg + self.strong_direction_deg_95.unwrap_or(0.0)
    }
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            width,
            height,
            centroid,
            network,
            numbers,
            steps,
            ..
        } = self;
        write!(
            f,
            "{network} ({numbers}) with {steps} step{} on {centroid} centroids of {width}×{height}",
            if *steps == 1 { "" } else { "s" }
        )
    }
}

fn told(picked: &Configuration) -> String {
    let mut text = format!(
        "picked: {picked}\n  simulated: direction {:.3}° ± {:.3}° from 50 mN up, {:.3}° over all; \
         |F| {:.3} mN RMSE; place {:.1} µm along x and y each",
        picked.strong_direction_deg,
        picked.strong_direction_deg_95.unwrap_or(0.0),
        picked.direction_deg,
        picked.force_rmse_mn,
        picked.place_rmse_um
    );
    if let (Some(cycles), Some(us), Some(rate), Some(latency)) = (
        picked.modelled_cycles,
        picked.microseconds(),
        picked.rate(),
        picked.latency_microseconds,
    ) {
        text += &format!(
            "\n  modelled: {cycles} cycles, {us:.0} µs, {rate:.0} frames a second, {latency:.0} µs \
             from the last pixel to the sample"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_sensing::model::Model;

    #[test]
    fn the_table_picks_the_default_model() {
        let all = configurations().unwrap();
        let picked = best(&all, &Limits::default()).unwrap();
        let bytes = include_bytes!("../../../calibration/models/default.hvtm");
        let model = Model::parse(bytes).unwrap();
        assert_eq!(model.conditions.centroid, picked.estimator());
        let name = format!("11-{}-5 ov7725", picked.network);
        assert_eq!(model.name().as_str(), name);
        assert_eq!(model.forward.map_or(0, |film| film.steps), picked.steps);
    }
}
