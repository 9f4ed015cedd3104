//! Presses by objects that are no needles, by the full solver, and what the sensing makes of them.

mod objects;
mod presses;
mod reading;
mod row;

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_shell::{Design, Film};

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::seeded;

pub use objects::{KINDS, Kind};
pub use presses::{Plan, Press, presses};
use reading::Reader;
use row::Row;

/// Press the film with discs, faces, pads, cylinders and balls, and see what the sensor makes of
/// it.
#[derive(Args)]
pub struct Contacts {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses of each kind.
    #[arg(long, default_value_t = 30)]
    presses: u32,
    /// Seed of all draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Frames of each press: as many draws of noise.
    #[arg(long, default_value_t = 20)]
    frames: u32,
    /// Fineness of the film's mesh.
    #[arg(long, default_value_t = 1.0)]
    fineness: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Print the presses with their truth as one JSON object, and read none.
    #[arg(long)]
    truth: bool,
}

impl Contacts {
    /// Runs the study.
    ///
    /// # Errors
    /// If a file cannot be read, or the film finds no rest.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let camera = weights.conditions.camera()?;
        let film = Film::new(&Design {
            fineness: self.fineness,
            ..Design::default()
        })?;
        let plan = Plan {
            of_each: self.presses,
            seed: self.seed,
        };
        let presses = presses(&film, &camera, plan)?;
        if self.truth {
            return page::print_rows(&presses);
        }
        let mut reader = Reader::new(model, &weights, seeded(self.seed))?;
        let rows = KINDS
            .into_iter()
            .map(|kind| self.row(&mut reader, kind, &presses));
        let rows = rows.collect::<Result<Vec<Row>>>()?;
        if self.json {
            return page::print_rows(&rows);
        }
        print!("{}", row::table(&rows));
        Ok(())
    }

    fn row(&self, reader: &mut Reader<'_>, kind: Kind, presses: &[Press]) -> Result<Row> {
        let mut row = Row::new(kind.name());
        for press in presses.iter().filter(|press| press.kind == kind) {
            row.begin_press();
            for _ in 0..self.frames {
                row.add(reader.read(press)?.as_ref(), press)?;
            }
        }
        Ok(row)
    }
}
