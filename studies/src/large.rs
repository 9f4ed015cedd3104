//! Frames of 800×600: a model made for them on the spot, beside the Cramér–Rao bound.

use std::fmt::Write;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::data::dataset::{Dataset, Loads, Recipe, generate};
use hivtac_calibration::data::range::Range;
use hivtac_calibration::fit::fit;
use hivtac_calibration::network::Meaning;
use hivtac_calibration::quantize::export;
use hivtac_calibration::train::Options as Training;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_twin::Options;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;
use rayon::prelude::*;

use crate::page;
use crate::press::{FORCES_MN, Held, REACH_MM, TestedUnit, press};

/// Columns and rows.
const SIZE: [u16; 2] = [800, 600];
/// Steps from the network's answer.
const STEPS: u8 = 1;

/// Make a model for frames of 800×600, press anywhere within ±4 mm, and hold the errors against the
/// Cramér–Rao bound.
#[derive(Args)]
pub struct Large {
    /// Frames that the network is trained on and noise is known from.
    #[arg(long, default_value_t = 6000)]
    pub frames: usize,
    /// Presses of each force.
    #[arg(long, default_value_t = 300)]
    pub presses: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    pub json: bool,
}

impl Large {
    /// Runs it.
    ///
    /// # Errors
    /// When frames cannot be rendered, training fails, or the page cannot be written.
    pub fn run(&self) -> Result<()> {
        let bytes = export(&self.weights()?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let unit = TestedUnit::new(&model.conditions, Options::default(), NOMINAL_RADIUS_MM, 1)?;
        let rows = FORCES_MN.into_par_iter().map(|force_mn| {
            let force_n = f64::from(force_mn) * 1e-3;
            let numbers = 0..self.presses;
            let loads = numbers.map(|number| Ok(press(number, force_n, REACH_MM)?));
            Held::of(&unit, &model, force_mn, loads)
        });
        let rows: Vec<Held> = rows.collect::<Result<_>>()?;
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| force | direction, rms | \\|F\\|, rms | place, rms | times the bound: direction, \
             \\|F\\|, place | within the stated 95 %: direction, \\|F\\|, place | refused \
             |\n|--:|--:|--:|--:|---|---|--:|\n",
        );
        for held in &rows {
            writeln!(
                text,
                "| {} mN | {} | {} |",
                held.row.force_mn,
                held.cells(),
                held.refused()
            )?;
        }
        print!("{text}");
        page::write("large.md", include_str!("large.md"), &text)
    }

    /// A small network with the nominal film, from as many frames as are asked for.
    ///
    /// # Errors
    /// When frames cannot be rendered, or training fails.
    pub fn weights(&self) -> Result<Weights> {
        let dataset = dataset(CentroidEstimator::RednessWeighted, self.frames, 1)?;
        let options = Training {
            hidden: vec![32, 32],
            meaning: Meaning::ForceAndPlace,
            epochs: 150,
            rounded_epochs: 100,
            direction_weight: None,
            ..Training::default()
        };
        let network = fit(&dataset, &options, |_| ())?.weights;
        network.with_film(STEPS, &dataset)
    }
}

/// So many presses anywhere, seen at 800×600.
///
/// # Errors
/// When they cannot be rendered.
pub fn dataset(centroid: CentroidEstimator, frames: usize, seed: u64) -> Result<Dataset> {
    let [width, height] = SIZE;
    let recipe = Recipe {
        width,
        height,
        centroid,
        loads: Loads::Random(frames),
        range: Range {
            force_n: 0.25,
            alpha_deg: 10.0,
            beta_deg: 10.0,
            place_mm: 1.05 * REACH_MM,
        },
        seed,
        ..Recipe::default()
    };
    generate(&recipe, || ())
}
