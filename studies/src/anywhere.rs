//! Compares the sensor's errors anywhere on the film with the Cramér–Rao bound of four markers.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::data::dataset::reasons as refusals;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Options;
use serde::Serialize;

use crate::page;
use crate::press::{Errors, FORCES_MN, Information, REACH_MM, TestedUnit, press};

/// The weights file of the default model, which gives places.
pub const WEIGHTS: &str = "calibration/models/default.weights";

/// Press anywhere within ±4 mm on the simulated sensor and hold the errors against the Cramér–Rao
/// bound.
#[derive(Args)]
pub struct Anywhere {
    /// A weights file of a network with places, with its film.
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
    /// Runs the study.
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
                writeln!(text, "| {steps} | {}", held.cells())?;
            }
        }
        print!("{text}");
        page::write("anywhere.md", &text)
    }

    /// Errors and bounds at each force with `steps` steps, or with the file's number for `None`.
    fn held(&self, weights: &Weights, steps: Option<u8>) -> Result<Vec<Held>> {
        let mut weights = weights.clone();
        if let (Some(film), Some(steps)) = (&mut weights.film, steps) {
            film.steps = steps;
        }
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let unit = TestedUnit::new(&model.conditions, Options::default(), 0.5, 1)?;
        let forces = FORCES_MN.into_iter();
        let held = forces.map(|force_mn| Held::of(&unit, &model, force_mn, self.presses));
        held.collect()
    }
}

/// Errors of presses on a unit, and their ratio to the Cramér–Rao bound.
#[derive(Serialize)]
struct Held {
    /// |F|, mN.
    force_mn: u32,
    /// Number of forces, and root mean squares of their errors: direction, degrees; |F|, mN; each
    /// coordinate of the place, µm.
    frames: u32,
    rms: [f64; 3],
    /// Ratios for direction, |F| and place.
    times_the_bound: [f64; 3],
    #[serde(skip)]
    errors: Errors,
    /// Counts of refused forces, by status.
    #[serde(skip)]
    reasons: BTreeMap<String, u32>,
    /// Number of presses that are left out: they move a marker out of the picture, or exceed the
    /// simulated film.
    #[serde(skip)]
    hidden: u32,
}

impl Held {
    /// The errors of a model for `presses` presses of one |F|, mN, on a unit.
    fn of(unit: &TestedUnit, model: &Model<'_>, force_mn: u32, presses: u32) -> Result<Held> {
        let mut tared = unit.tare(model)?;
        let mut answers = Vec::new();
        for number in 0..presses {
            let load = press(number, [f64::from(force_mn) * 1e-3; 2], REACH_MM)?;
            if unit.shows_all(&load)? {
                answers.push(tared.answer(unit, load, number.into())?);
            }
        }
        let information = Information::of(&answers)?;
        let (mut errors, mut bounds) = (Errors::default(), [0.0; 3]);
        let mut reasons = BTreeMap::new();
        for answer in &answers {
            errors.add(answer.force.as_ref(), &answer.load)?;
            if answer.force.is_some() {
                let bound = information.bound(unit, &answer.load)?;
                bounds = std::array::from_fn(|k| bounds[k] + bound[k]);
            }
            if answer.force.is_none() {
                *reasons.entry(refusals(answer.status)).or_insert(0) += 1;
            }
        }
        let rms = errors.rms();
        let bounds = bounds.map(|sum| (sum / f64::from(errors.count)).sqrt());
        Ok(Held {
            force_mn,
            frames: errors.count,
            rms,
            times_the_bound: [
                rms[0].to_radians() / bounds[0],
                rms[1] / (1e3 * bounds[1]),
                rms[2] / (1e3 * bounds[2]),
            ],
            errors,
            reasons,
            hidden: presses - answers.len() as u32,
        })
    }

    /// Cells of a table: root mean squares, their ratios to the bound, and the part of the errors
    /// within their stated bounds. Then the number of presses without a force, with the reasons,
    /// and of those left out.
    fn cells(&self) -> String {
        let force_mn = self.force_mn;
        let [direction_deg, magnitude_mn, place_um] = self.rms;
        let [direction, force, place] = self.errors.covered();
        let [a, b, c] = self.times_the_bound;
        let reasons = self.reasons.iter();
        let reasons: String = reasons
            .map(|(reason, count)| format!(", {count} `{reason}`"))
            .collect();
        format!(
            "{force_mn} mN | {direction_deg:.3}° | {magnitude_mn:.3} mN | {place_um:.1} µm | \
             {a:.2}, {b:.2}, {c:.2} | {direction:.1}, {force:.1}, {place:.1} % | \
             {} of {}{reasons}; {} more with a marker out of the picture |",
            self.errors.refused,
            self.errors.refused + self.errors.count,
            self.hidden
        )
    }
}
