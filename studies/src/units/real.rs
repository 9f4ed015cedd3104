//! Units whose films are as people mount them: errors of each film, and whether they are as stated.

use std::fmt::Write;

use anyhow::{Context, Result, anyhow};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensing::model::Model;
use rayon::prelude::*;
use serde::Serialize;

use super::bench::Bench;
use crate::page;
use crate::press::{REACH_MM, Tally, Tared, TestedUnit, press_of_any};

/// Forces that are pressed, N.
const FORCES_N: [f64; 2] = [0.05, 0.2];

/// A film with a tare alone, and after each bench's loads; why it could not be calibrated
/// otherwise.
struct Tested {
    tared: Tally,
    calibrated: Vec<Result<Tally>>,
}

/// What all films say after one kind of calibration.
#[derive(Serialize)]
struct Row {
    calibration: String,
    films: usize,
    without_model: usize,
    /// Medians over films of root mean squares.
    direction_deg: f64,
    magnitude_mn: f64,
    place_um: f64,
    /// Per cent of frames.
    with_force: f64,
    /// Per cent of forces: beyond three stated standard uncertainties in any part, and within the
    /// stated 95 % of direction, |F| and place.
    beyond: f64,
    within: [f64; 3],
}

/// Units with films as people mount them.
pub struct RealFilms<'a> {
    /// A network that tells places, with its film.
    pub weights: &'a Weights,
    /// The same as a model.
    pub model: &'a Model<'a>,
    /// Presses of each film.
    pub presses: u32,
}

impl RealFilms<'_> {
    /// Draws so many, calibrates them, and prints one JSON object or writes the page.
    ///
    /// # Errors
    /// When a file cannot be written, or a film finds no equilibrium.
    pub fn run(&self, units: u64, json: bool) -> Result<()> {
        let numbers = (0..units).into_par_iter();
        let tested = numbers.map(|number| {
            let tested = self.test(number);
            tested.with_context(|| format!("film {number}"))
        });
        let tested: Vec<Tested> = tested.collect::<Result<_>>()?;
        let mut rows = vec![row("tare alone", &tested, |film| Some(&film.tared))];
        for (k, (_, name)) in Bench::ALL.iter().enumerate() {
            rows.push(row(name, &tested, |film| film.calibrated[k].as_ref().ok()));
        }
        if json {
            return page::print_rows(&rows);
        }
        let mut text = table(&rows)?;
        for (number, film) in tested.iter().enumerate() {
            for (error, (_, name)) in film.calibrated.iter().zip(Bench::ALL) {
                if let Err(error) = error {
                    writeln!(text, "\nFilm {number} after {name}: {error:#}.")?;
                }
            }
        }
        print!("{text}");
        page::write("real-films.md", include_str!("real.md"), &text)
    }

    fn test(&self, number: u64) -> Result<Tested> {
        let conditions = &self.model.conditions;
        let unit = TestedUnit::with_real_film(conditions, number)?;
        let mut tared = unit.tare(self.model)?;
        let of_tare = answers(&unit, &mut tared, number, self.presses)?;
        let calibrated = Bench::ALL.iter().map(|(bench, _)| {
            let own = export(&bench.calibrate(self.weights, &unit, &mut tared, number)?)?;
            let own = Model::parse(&own).map_err(|error| anyhow!("{error}"))?;
            answers(&unit, &mut unit.tare(&own)?, number, self.presses)
        });
        Ok(Tested {
            tared: of_tare,
            calibrated: calibrated.collect(),
        })
    }
}

fn table(rows: &[Row]) -> Result<String> {
    let mut text = String::from(
        "| calibration | direction, rms, median of films | \\|F\\| | place | frames with a force | \
         beyond 3 stated σ | within the stated 95 %: direction, \\|F\\|, place | films without a \
         model |\n|---|--:|--:|--:|--:|--:|---|--:|\n",
    );
    for row in rows {
        let [direction, force, place] = row.within;
        writeln!(
            text,
            "| {} | {:.2}° | {:.2} mN | {:.0} µm | {:.1} % | {:.1} % | {direction:.1}, {force:.1}, \
             {place:.1} % | {} of {} |",
            row.calibration,
            row.direction_deg,
            row.magnitude_mn,
            row.place_um,
            row.with_force,
            row.beyond,
            row.without_model,
            row.films,
        )?;
    }
    Ok(text)
}

fn answers(unit: &TestedUnit, tared: &mut Tared<'_>, number: u64, presses: u32) -> Result<Tally> {
    let mut tally = Tally::default();
    for k in 0..presses {
        let load = press_of_any(k + 1000 * number as u32, FORCES_N, REACH_MM)?;
        if unit.shows_all(&load)? {
            let answer = tared.answer(unit, load, k.into())?;
            tally.add(answer.force.as_ref(), &load)?;
        }
    }
    Ok(tally)
}

fn row<'a>(name: &str, films: &'a [Tested], of: impl Fn(&'a Tested) -> Option<&'a Tally>) -> Row {
    let tallies: Vec<&Tally> = films.iter().filter_map(of).collect();
    let median = |k: usize| {
        let mut values: Vec<f64> = tallies.iter().map(|tally| tally.errors.rms()[k]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let mut all = Tally::default();
    tallies.iter().for_each(|tally| all.merge(tally));
    let forces = f64::from(all.errors.count);
    Row {
        calibration: name.to_owned(),
        films: films.len(),
        without_model: films.len() - tallies.len(),
        direction_deg: median(0),
        magnitude_mn: median(1),
        place_um: median(2),
        with_force: 100.0 * forces / (forces + f64::from(all.errors.refused)),
        beyond: 100.0 * f64::from(all.beyond) / forces,
        within: all.errors.covered(),
    }
}
