//! The sensing's answers to presses by objects other than needles, solved by finite elements.

mod objects;
mod reading;
mod row;

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::Measurement;
use hivtac_shell::{Design, Film};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_twin::film::Layout;
use rayon::prelude::*;

use crate::anywhere::WEIGHTS;
use crate::page;

use objects::{KINDS, Kind, Press, presses};
use reading::Reader;
use row::Row;

/// Press the film with discs, faces, pads, cylinders and balls, and measure the sensor's errors.
#[derive(Args)]
pub struct Contacts {
    /// A weights file with its film: of a network with places, or of another layout of dots, whose
    /// results are printed and no page.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses of each kind.
    #[arg(long, default_value_t = 30)]
    presses: u32,
    /// Seed of all draws.
    #[arg(long, default_value_t = 2)]
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
    /// Press only near dots, where they bend most.
    #[arg(long)]
    near_dots: bool,
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
        let film = Film::new(&Design {
            fineness: self.fineness,
            ..Design::default()
        })?;
        let presses = presses(&film, self.presses, self.seed, self.near_dots);
        let layout = weights.conditions.layout()?;
        let rows = self.rows(&model, &film, layout, &presses)?;
        if self.json {
            return page::print_rows(&rows);
        }
        let table = row::table(&rows);
        print!("{table}");
        if self.near_dots || layout != Layout::default() {
            return Ok(());
        }
        page::write("contacts.md", &table)
    }

    /// The rows of all settings.
    fn rows(
        &self,
        model: &Model<'_>,
        film: &Film,
        layout: Layout,
        presses: &[Press],
    ) -> Result<Vec<Row>> {
        let reader = Reader::new(model, film, layout, (self.frames, self.seed))?;
        let numbered = presses.par_iter().enumerate();
        let read = numbered.map(|(number, press)| {
            let shapes = Setting::ALL.map(|setting| setting.shape(press));
            reader.read((number, press), shapes)
        });
        let answers = read.collect::<Result<Vec<_>>>()?;
        let mut rows = Vec::new();
        for (k, setting) in Setting::ALL.into_iter().enumerate() {
            let answers = answers.iter().map(|answers| answers[k].as_slice());
            rows.extend(rows_of(setting, presses.iter().zip(answers))?);
        }
        Ok(rows)
    }
}

/// The rows of all kinds under a setting, then one of all of them but the longest. `answers` are
/// the presses with the measurements of their frames. A press has no measurements if the setting
/// does not apply to it.
fn rows_of<'a>(
    setting: Setting,
    answers: impl Iterator<Item = (&'a Press, &'a [Measurement])> + Clone,
) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let mut all = Row::new("all but cylinders of 12 mm".into(), setting.name());
    for kind in KINDS {
        let mut row = Row::new(kind.name(), setting.name());
        for (press, answers) in answers.clone() {
            if press.kind == kind && !answers.is_empty() {
                row.add(press, answers)?;
            }
        }
        if !row.is_empty() {
            if kind != Kind::Cylinder(12.0) && kind.arm_mm() == 0.0 {
                all.extend(&row);
            }
            rows.push(row);
        }
    }
    rows.push(all);
    Ok(rows)
}

/// The sensor's setting of the contact's shape.
#[derive(Clone, Copy)]
enum Setting {
    /// Nothing.
    Unknown,
    /// The shape, of presses that have one.
    Set,
    /// That it is a needle, whatever it is.
    Needle,
}

impl Setting {
    const ALL: [Setting; 3] = [Setting::Unknown, Setting::Set, Setting::Needle];

    fn name(self) -> &'static str {
        match self {
            Setting::Unknown => "unknown",
            Setting::Set => "its own",
            Setting::Needle => "needle",
        }
    }

    fn shape(self, press: &Press) -> Option<ContactShape> {
        match self {
            Setting::Unknown => Some(ContactShape::Unknown),
            Setting::Set => press.shape,
            Setting::Needle => Some(ContactShape::Needle),
        }
    }
}
