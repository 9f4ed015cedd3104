//! How near the sensor comes to what four markers can tell, wherever the tip presses.

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Options;

use crate::page;
use crate::press::{FORCES_MN, Held, REACH_MM, TestedUnit, press};

/// The weights file of the sensor that tells places.
pub const WEIGHTS: &str = "calibration/models/default.weights";

/// Press anywhere within ±4 mm on the simulated sensor and hold the errors against the Cramér–Rao
/// bound.
#[derive(Args)]
pub struct Anywhere {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses of each force.
    #[arg(long, default_value_t = 1000)]
    presses: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

impl Anywhere {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a press cannot be made.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        if self.json {
            return page::print_rows(&self.held(&weights, None)?);
        }
        let mut text = String::from(
            "| steps | force | direction, rms | \\|F\\|, rms | place, rms | times the bound: \
             direction, \\|F\\|, place | within the stated 95 %: direction, \\|F\\|, place | \
             refused |\n|--:|--:|--:|--:|--:|---|---|--:|\n",
        );
        for steps in 0..=hivtac_sensor::force::forward::MOST_STEPS {
            for held in self.held(&weights, Some(steps))? {
                writeln!(
                    text,
                    "| {steps} | {} mN | {} | {} |",
                    held.row.force_mn,
                    held.cells(),
                    held.refused()
                )?;
            }
        }
        print!("{text}");
        page::write("anywhere.md", include_str!("anywhere.md"), &text)
    }

    /// Errors and bounds at each force with so many steps, or as many as the file says.
    fn held(&self, weights: &Weights, steps: Option<u8>) -> Result<Vec<Held>> {
        let mut weights = weights.clone();
        if let (Some(film), Some(steps)) = (&mut weights.film, steps) {
            film.steps = steps;
        }
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let unit = TestedUnit::new(&model.conditions, Options::default(), 0.5, 1)?;
        let forces = FORCES_MN.into_iter();
        let held = forces.map(|force_mn| {
            let force_n = f64::from(force_mn) * 1e-3;
            let numbers = 0..self.presses;
            let loads = numbers.map(|number| Ok(press(number, force_n, REACH_MM)?));
            Held::of(&unit, &model, force_mn, loads)
        });
        held.collect()
    }
}
