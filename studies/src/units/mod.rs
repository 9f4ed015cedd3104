//! Units as people build them: with a tare alone, and after they were calibrated.

mod bench;
mod real;
#[cfg(test)]
mod stretched;

use std::fmt::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensing::model::Model;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Errors, FORCES_MN, REACH_MM, Row, Tared, TestedUnit, press};
use bench::Bench;
use real::RealFilms;

/// What a calibrated unit shall be within: direction, degrees, |F|, mN, place, µm, root mean
/// squares.
const GOOD: [f64; 3] = [0.45, 1.0, 30.0];

/// Draw units as people build them; measure them with a tare alone, and after ten loads.
#[derive(Args)]
pub struct Units {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Units drawn.
    #[arg(long, default_value_t = 24)]
    units: u64,
    /// Presses of each force on each of them.
    #[arg(long, default_value_t = 100)]
    presses: u32,
    /// Whose films: of today's tables, or as people mount them.
    #[arg(long, value_enum, default_value_t = Films::Nominal)]
    films: Films,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// Whose films units have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Films {
    /// The simulated film's tables, a little stiffer, thicker, held elsewhere.
    Nominal,
    /// Solved by finite elements: stretched, cut otherwise, of other rubber.
    Real,
}

/// One unit's errors at each force.
type ByForce = [Errors; FORCES_MN.len()];

/// A unit with a tare alone, and after ten loads; why it could not be calibrated otherwise.
struct Tested {
    tared: ByForce,
    calibrated: Result<ByForce>,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    /// With a tare alone.
    tared: Vec<Row>,
    /// After ten loads.
    rows: Vec<Row>,
}

impl Units {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a unit cannot be pressed.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        if self.films == Films::Nominal {
            return self.of_todays_tables(&weights, &model);
        }
        let study = RealFilms {
            weights: &weights,
            model: &model,
            presses: self.presses,
        };
        study.run(self.units, self.json)
    }

    fn of_todays_tables(&self, weights: &Weights, model: &Model<'_>) -> Result<()> {
        let units = (0..self.units).into_par_iter();
        let tested = units.map(|number| self.test(weights, model, number));
        let tested: Vec<Tested> = tested.collect::<Result<_>>()?;
        let calibrated: Vec<ByForce> = tested
            .iter()
            .filter_map(|unit| unit.calibrated.as_ref().ok().copied())
            .collect();
        let tared: Vec<ByForce> = tested.iter().map(|unit| unit.tared).collect();
        if self.json {
            let rows = |units: &[ByForce]| {
                let forces = FORCES_MN.into_iter().enumerate();
                forces
                    .map(|(k, force_mn)| all(units, k).row(force_mn))
                    .collect()
            };
            let report = Report {
                tared: rows(&tared),
                rows: rows(&calibrated),
            };
            println!("{}", serde_json::to_string(&report)?);
            return Ok(());
        }
        let mut text = table("a tare alone", &tared)?;
        text += &table("ten loads", &calibrated)?;
        for unit in &tested {
            if let Err(error) = &unit.calibrated {
                writeln!(text, "\nNot calibrated: {error:#}.")?;
            }
        }
        print!("{text}");
        page::write("units.md", include_str!("units.md"), &text)
    }

    fn test(&self, weights: &Weights, model: &Model<'_>, number: u64) -> Result<Tested> {
        let unit = TestedUnit::drawn(&model.conditions, number)?;
        let mut tared = unit.tare(model)?;
        let of_tare = self.answers(&mut tared, &unit, number)?;
        let calibrated = self.calibrated(weights, &unit, &mut tared, number);
        Ok(Tested {
            tared: of_tare,
            calibrated: calibrated.with_context(|| format!("unit {number}")),
        })
    }

    fn calibrated(
        &self,
        weights: &Weights,
        unit: &TestedUnit,
        tared: &mut Tared<'_>,
        number: u64,
    ) -> Result<ByForce> {
        let own = export(&own_weights(weights, unit, tared, number)?)?;
        let model = Model::parse(&own).map_err(|error| anyhow!("{error}"))?;
        self.answers(&mut unit.tare(&model)?, unit, number)
    }

    fn answers(&self, tared: &mut Tared<'_>, unit: &TestedUnit, number: u64) -> Result<ByForce> {
        let mut all = ByForce::default();
        for (errors, force_mn) in all.iter_mut().zip(FORCES_MN) {
            for k in 0..self.presses {
                let load = press(
                    k + 1000 * number as u32,
                    f64::from(force_mn) * 1e-3,
                    REACH_MM,
                )?;
                if unit.shows_all(&load)? {
                    let answer = tared.answer(unit, load, k.into())?;
                    errors.add(answer.force.as_ref(), &load)?;
                }
            }
        }
        Ok(all)
    }
}

/// The weights for a unit after its ten loads; the number draws its gauge and its stage.
///
/// # Errors
/// When its markers are not found, or no unit explains its loads.
pub fn own_weights(
    weights: &Weights,
    unit: &TestedUnit,
    tared: &mut Tared<'_>,
    number: u64,
) -> Result<Weights> {
    Bench::Ten.calibrate(weights, unit, tared, number)
}

/// All units together at the force with this index.
fn all(units: &[ByForce], force: usize) -> Errors {
    let mut sum = Errors::default();
    units.iter().for_each(|unit| sum.merge(&unit[force]));
    sum
}

fn table(name: &str, units: &[ByForce]) -> Result<String> {
    let mut text = format!(
        "\n{} units with {name}:\n\n| force | direction, rms | \\|F\\|, rms | place, rms | within \
         the stated 95 %: direction, \\|F\\|, place | frames with a force | units within 0.45°, 1 \
         mN and 30 µm |\n|--:|--:|--:|--:|---|--:|--:|\n",
        units.len()
    );
    for (k, force_mn) in FORCES_MN.into_iter().enumerate() {
        let errors = all(units, k);
        let [direction, force, place] = errors.rms();
        let [by_direction, by_force, by_place] = errors.covered();
        let good = |unit: &&ByForce| {
            let rms = unit[k].rms();
            rms.iter().zip(GOOD).all(|(rms, good)| *rms <= good)
        };
        writeln!(
            text,
            "| {force_mn} mN | {direction:.2}° | {force:.2} mN | {place:.0} µm | \
             {by_direction:.1}, {by_force:.1}, {by_place:.1} % | {} of {} | {} |",
            errors.count,
            errors.count + errors.refused,
            units.iter().filter(good).count(),
        )?;
    }
    Ok(text)
}
