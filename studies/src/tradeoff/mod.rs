//! `hivtac-studies tradeoff`: picks the best configuration under a user's limits
//! (`docs/tradeoff.md`).

mod pick;

use std::fmt;

use anyhow::{Context, Result};
use clap::Args;
use serde::Deserialize;

use pick::{Limits, best};

/// All measured configurations, with simulated accuracy and modelled cost.
const TABLE: &str = include_str!("../../tradeoff/configurations.csv");
/// The core's cycles in a microsecond.
const CYCLES_PER_US: f64 = 480.0;

/// Pick the configuration that is best under limits of time and error; without any, the default
/// model's.
#[derive(Args)]
pub struct TradeoffArgs {
    #[command(flatten)]
    limits: Limits,
}

/// One configuration, as a row of the table. All that the firmware supports unchanged have frames
/// of 320×240.
#[derive(Clone, Debug, Deserialize)]
struct Configuration {
    /// Estimator of the markers' positions: `binary` or `weighted`.
    centroid: String,
    /// Widths of the network's hidden layers, such as `64-64`.
    network: String,
    /// Format of its numbers: `int16` or `int8 per channel`.
    numbers: String,
    /// Least number of Gauss–Newton steps from the network's answer; 0 for the network alone.
    steps: u8,
    /// Mean angle between found and true force, degrees.
    direction_deg: f64,
    /// The same for forces from 50 mN up, and half of the 95 % interval of the true mean.
    strong_direction_deg: f64,
    strong_direction_deg_95: Option<f64>,
    /// Root mean square error of |F|, mN, and of each coordinate of the place, µm.
    force_rmse_mn: f64,
    place_rmse_um: f64,
    /// Part of the judged frames that no single contact explains.
    unexplained: f64,
    /// Cycles for a frame.
    modelled_cycles: i64,
    /// Time from the last pixel to the sample, µs.
    latency_microseconds: f64,
}

impl TradeoffArgs {
    /// Picks a configuration; prints it and the command that makes its model.
    pub fn run(&self) -> Result<()> {
        let all = configurations()?;
        let picked = best(&all, &self.limits)?;
        println!("{}\n\n{}", described(picked), picked.command());
        Ok(())
    }
}

/// The configurations that the firmware supports unchanged.
fn configurations() -> Result<Vec<Configuration>> {
    let mut reader = csv::Reader::from_reader(TABLE.as_bytes());
    let titles = reader.headers()?.clone();
    let reach = titles.iter().position(|title| title == "reach");
    let reach = reach.context("the table has no reach")?;
    let mut all = Vec::new();
    for row in reader.records() {
        let row = row?;
        if &row[reach] == "firmware" {
            all.push(row.deserialize(Some(&titles))?);
        }
    }
    Ok(all)
}

impl Configuration {
    fn microseconds(&self) -> f64 {
        self.modelled_cycles as f64 / CYCLES_PER_US
    }

    /// Frames a second.
    fn rate(&self) -> f64 {
        1e6 / self.microseconds()
    }

    /// Upper end of the interval of the direction error from 50 mN up, degrees.
    fn limit_error_deg(&self) -> f64 {
        self.strong_direction_deg + self.strong_direction_deg_95.unwrap_or(0.0)
    }

    /// The command that makes its model.
    fn command(&self) -> String {
        let binary = if self.centroid == "binary" {
            " --binary"
        } else {
            ""
        };
        format!(
            "hivtac-calibrate default-model{binary} --hidden {} --arithmetic {} --steps {} \
             --out-dir .",
            self.network.replace('-', ","),
            self.numbers.replace(' ', "-"),
            self.steps
        )
    }
}

impl fmt::Display for Configuration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            centroid,
            network,
            numbers,
            steps,
            ..
        } = self;
        let s = if *steps == 1 { "" } else { "s" };
        write!(
            f,
            "{network} ({numbers}) with {steps} step{s} on {centroid} centroids"
        )
    }
}

fn described(picked: &Configuration) -> String {
    format!(
        "picked: {picked}\n  simulated: direction {:.3}° ± {:.3}° from 50 mN up, {:.3}° over all; \
         |F| {:.3} mN RMSE; place {:.1} µm along x and y each\n  modelled: {} cycles, {:.0} µs, \
         {:.0} frames a second, {:.0} µs from the last pixel to the sample",
        picked.strong_direction_deg,
        picked.strong_direction_deg_95.unwrap_or(0.0),
        picked.direction_deg,
        picked.force_rmse_mn,
        picked.place_rmse_um,
        picked.modelled_cycles,
        picked.microseconds(),
        picked.rate(),
        picked.latency_microseconds
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_sensor::force::model::Model;

    #[test]
    fn the_table_picks_the_default_model() {
        let all = configurations().unwrap();
        let picked = best(&all, &Limits::default()).unwrap();
        let bytes = include_bytes!("../../../calibration/models/default.hvtm");
        let model = Model::parse(bytes).unwrap();
        assert_eq!(model.conditions.centroid.name(), "redness-weighted");
        let name = format!("11-{}-5 ov7725", picked.network);
        assert_eq!(model.name().as_str(), name);
        assert_eq!(model.forward.map_or(0, |film| film.steps), picked.steps);
        let weights = include_str!("../../../calibration/models/default.weights");
        assert!(weights.contains(r#""arithmetic":"int8-per-channel""#));
        assert_eq!(
            picked.command(),
            "hivtac-calibrate default-model --hidden 64,64 --arithmetic int8-per-channel --steps 1 \
             --out-dir ."
        );
    }
}
