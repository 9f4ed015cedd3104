//! Forces along the film: to 0.8 of the force into it.

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Options;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{FORCES_MN, Held, REACH_MM, TestedUnit, tilted_press};

/// Tangential over normal force. The bound's differences go a little beyond, and tables end at 0.8.
const RATIOS: [f64; 5] = [0.0, 0.2, 0.4, 0.6, 0.79];

/// Press with a tangential force to 0.8 of the normal one and hold the errors against the
/// Cramér–Rao bound.
#[derive(Args)]
pub struct Tangential {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses of each force and ratio.
    #[arg(long, default_value_t = 500)]
    presses: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// Presses of one force and ratio.
#[derive(Serialize)]
struct Tilted {
    /// Tangential over normal force.
    ratio: f64,
    #[serde(flatten)]
    held: Held,
}

impl Tangential {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a press cannot be made.
    pub fn run(&self) -> Result<()> {
        let bytes = export(&Weights::load(&self.weights)?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let unit = TestedUnit::new(&model.conditions, Options::default(), 0.5, 1)?;
        let all = RATIOS.map(|ratio| FORCES_MN.map(|force_mn| (ratio, force_mn)));
        let rows = all.as_flattened().par_iter();
        let rows = rows.map(|&(ratio, force_mn)| self.tilted(&unit, &model, ratio, force_mn));
        let rows: Vec<Tilted> = rows.collect::<Result<_>>()?;
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| tangential over normal | force | direction, rms | \\|F\\|, rms | place, rms | times \
             the bound: direction, \\|F\\|, place | within the stated 95 %: direction, \\|F\\|, \
             place | refused |\n|--:|--:|--:|--:|--:|---|---|--:|\n",
        );
        text.extend(rows.iter().map(Tilted::line));
        print!("{text}");
        page::write("tangential.md", include_str!("tangential.md"), &text)
    }

    fn tilted(
        &self,
        unit: &TestedUnit,
        model: &Model<'_>,
        ratio: f64,
        force_mn: u32,
    ) -> Result<Tilted> {
        let force_n = f64::from(force_mn) * 1e-3;
        let numbers = 0..self.presses;
        let loads = numbers.map(|number| Ok(tilted_press(number, force_n, ratio, REACH_MM)?));
        let held = Held::of(unit, model, force_mn, loads)?;
        Ok(Tilted { ratio, held })
    }
}

impl Tilted {
    fn line(&self) -> String {
        let Tilted { ratio, held } = self;
        format!(
            "| {ratio} | {} mN | {} | {} |\n",
            held.row.force_mn,
            held.cells(),
            held.refused()
        )
    }
}
