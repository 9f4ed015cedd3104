//! Whether stated uncertainties hold: in every tenth of |F| and of the distance from the middle, on
//! the nominal unit and on units drawn at random after ten loads.

use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Options;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Answer, Bound, Errors, Off, REACH_MM, TestedUnit, noise_of, press_of_any};
use crate::units::own_weights;

/// The least |F|, N: what counts as a contact.
const LEAST_N: f64 = 0.002;
/// Parts that presses are sorted into.
const PARTS: usize = 10;
/// Presses of the nominal unit that one sensor sees.
const CHUNK: u32 = 500;
/// The part of the errors that shall lie within 95 % bounds, per cent.
const HONEST: [f64; 2] = [94.0, 98.0];

/// Ask in every tenth of |F| and of the distance from the middle how many errors lie within their
/// stated 95 % bounds.
#[derive(Args)]
pub struct Coverage {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Presses of the nominal unit.
    #[arg(long, default_value_t = 10_000)]
    presses: u32,
    /// Units drawn, each after ten loads.
    #[arg(long, default_value_t = 24)]
    units: u64,
    /// Presses of each of them.
    #[arg(long, default_value_t = 400)]
    unit_presses: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// A press that has a force.
#[derive(Clone, Copy)]
struct Known {
    /// |F|, mN.
    force_mn: f64,
    /// How far from the film's middle, mm.
    far_mm: f64,
    off: Off,
    bound: Bound,
}

/// What many presses gave.
#[derive(Default)]
struct Presses {
    known: Vec<Known>,
    refused: u32,
    /// A marker leaves the picture, or the simulated film does not hold the press.
    hidden: u32,
}

/// The presses of one part.
#[derive(Serialize)]
struct Part {
    from: f64,
    to: f64,
    /// Of the direction, |F| and the place, per cent.
    within: [f64; 3],
    /// Root mean squares: degrees, mN, µm.
    rms: [f64; 3],
    /// How many times the Cramér–Rao bound these are.
    bounds: [f64; 3],
}

/// Units with their tenths.
#[derive(Serialize)]
struct Tenths {
    units: String,
    presses: usize,
    refused: u32,
    hidden: u32,
    by_force_mn: Vec<Part>,
    by_distance_mm: Vec<Part>,
}

impl Coverage {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a unit cannot be pressed.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let nominal = self.nominal(&weights)?;
        let (drawn, failed) = self.drawn(&weights)?;
        let all = [
            nominal.tenths("The nominal unit".to_owned()),
            drawn.tenths(format!(
                "{} units drawn at random, after ten loads",
                self.units - failed.len() as u64
            )),
        ];
        if self.json {
            println!("{}", serde_json::to_string(&all)?);
            return Ok(());
        }
        let mut text = String::new();
        for tenths in &all {
            text += &tenths.table()?;
        }
        for error in failed {
            writeln!(text, "\nNot calibrated: {error:#}.")?;
        }
        print!("{text}");
        page::write("coverage.md", include_str!("coverage.md"), &text)
    }

    fn nominal(&self, weights: &Weights) -> Result<Presses> {
        let bytes = export(weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let unit = TestedUnit::new(&model.conditions, Options::default(), 0.5, 1)?;
        let chunks = (0..self.presses.div_ceil(CHUNK)).into_par_iter();
        let all = chunks.map(|chunk| {
            let to = (CHUNK * (chunk + 1)).min(self.presses);
            pressed(&unit, &model, weights.range.force_n, CHUNK * chunk..to)
        });
        let all: Vec<Presses> = all.collect::<Result<_>>()?;
        Ok(all.into_iter().fold(Presses::default(), Presses::and))
    }

    /// The presses of units that could be calibrated, and why others could not.
    fn drawn(&self, weights: &Weights) -> Result<(Presses, Vec<anyhow::Error>)> {
        let bytes = export(weights)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let units = (0..self.units).into_par_iter();
        let each: Vec<Result<Presses>> = units
            .map(|number| self.calibrated(weights, &model, number))
            .collect();
        let (mut all, mut failed) = (Presses::default(), Vec::new());
        for unit in each {
            match unit {
                Ok(presses) => all = all.and(presses),
                Err(error) => failed.push(error),
            }
        }
        Ok((all, failed))
    }

    fn calibrated(&self, weights: &Weights, model: &Model<'_>, number: u64) -> Result<Presses> {
        let unit = TestedUnit::drawn(&model.conditions, number)?;
        let mut tared = unit.tare(model)?;
        let own = own_weights(weights, &unit, &mut tared, number)
            .with_context(|| format!("unit {number}"))?;
        let bytes = export(&own)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let from = 1000 * number as u32;
        let numbers = from..from + self.unit_presses;
        pressed(&unit, &model, weights.range.force_n, numbers)
    }
}

/// What a model says of a unit's presses of up to a force, N.
fn pressed(
    unit: &TestedUnit,
    model: &Model<'_>,
    most_n: f64,
    numbers: Range<u32>,
) -> Result<Presses> {
    let mut tared = unit.tare(model)?;
    let (mut answers, mut all) = (Vec::new(), Presses::default());
    for number in numbers {
        let load = press_of_any(number, [LEAST_N, most_n], REACH_MM)?;
        if unit.shows_all(&load)? {
            answers.push(tared.answer(unit, load, number.into())?);
        } else {
            all.hidden += 1;
        }
    }
    let noise = noise_of(&answers);
    for Answer { load, force, .. } in &answers {
        let Some(force) = force else {
            all.refused += 1;
            continue;
        };
        let [x, y] = load.offset_mm();
        all.known.push(Known {
            force_mn: 1e3 * load.magnitude_n(),
            far_mm: x.hypot(y),
            off: Off::of(force, load)?,
            bound: Bound::of(unit, load, &noise)?,
        });
    }
    Ok(all)
}

impl Presses {
    fn and(mut self, other: Presses) -> Presses {
        self.known.extend(other.known);
        self.refused += other.refused;
        self.hidden += other.hidden;
        self
    }

    fn tenths(self, units: String) -> Tenths {
        Tenths {
            units,
            presses: self.known.len(),
            refused: self.refused,
            hidden: self.hidden,
            by_force_mn: parts(&self.known, |known| known.force_mn),
            by_distance_mm: parts(&self.known, |known| known.far_mm),
        }
    }
}

/// Presses in tenths by a number of theirs.
fn parts(known: &[Known], by: impl Fn(&Known) -> f64) -> Vec<Part> {
    let mut sorted = known.to_vec();
    sorted.sort_by(|a, b| by(a).total_cmp(&by(b)));
    let each = sorted.len().div_ceil(PARTS).max(1);
    sorted
        .chunks(each)
        .map(|part| Part::of(part, &by))
        .collect()
}

impl Part {
    /// Of presses that are sorted by this; at least one.
    fn of(presses: &[Known], by: impl Fn(&Known) -> f64) -> Part {
        let (mut errors, mut bound) = (Errors::default(), Bound::default());
        for known in presses {
            errors.take(&known.off);
            bound = bound.plus(&known.bound);
        }
        let rms = errors.rms();
        let count = f64::from(errors.count);
        let possible = [
            (bound.direction / count).sqrt().to_degrees(),
            1e3 * (bound.force / count).sqrt(),
            1e3 * (bound.place / count).sqrt(),
        ];
        Part {
            from: by(&presses[0]),
            to: by(&presses[presses.len() - 1]),
            within: errors.covered(),
            rms,
            bounds: std::array::from_fn(|k| rms[k] / possible[k]),
        }
    }

    fn is_honest(&self) -> bool {
        let honest = |within: &f64| (HONEST[0]..=HONEST[1]).contains(within);
        self.within.iter().all(honest)
    }

    fn line(&self, digits: usize) -> String {
        let [direction, force, place] = self.within;
        let [angle, size, far] = self.rms;
        let [by_angle, by_size, by_far] = self.bounds;
        format!(
            "| {:.digits$}–{:.digits$} | {direction:.1}, {force:.1}, {place:.1} % | {angle:.2}° | \
             {size:.3} mN | {far:.1} µm | {by_angle:.2}, {by_size:.2}, {by_far:.2} |\n",
            self.from, self.to,
        )
    }
}

impl Tenths {
    fn table(&self) -> Result<String> {
        let Tenths {
            units,
            presses,
            refused,
            hidden,
            ..
        } = self;
        let mut text = format!(
            "\n## {units}\n\n{presses} presses with a force, {refused} without, {hidden} more with \
             a marker out of the picture or beyond the\nsimulated film.\n"
        );
        for (name, parts, digits) in [
            ("\\|F\\|, mN", &self.by_force_mn, 0),
            ("from the middle, mm", &self.by_distance_mm, 2),
        ] {
            let honest = parts.iter().filter(|part| part.is_honest()).count();
            write!(
                text,
                "\n| {name} | within the stated 95 %: direction, \\|F\\|, place | direction, rms | \
                 \\|F\\|, rms | place, rms | times the bound |\n|---|---|--:|--:|--:|---|\n{}\n\
                 All three within {} to {} % in {honest} of {} parts.\n",
                parts
                    .iter()
                    .map(|part| part.line(digits))
                    .collect::<String>(),
                HONEST[0],
                HONEST[1],
                parts.len(),
            )?;
        }
        Ok(text)
    }
}
