//! Errors of many presses, held against what is possible.

use std::collections::BTreeMap;

use anyhow::Result;
use hivtac_sensor::force::model::Model;
use hivtac_twin::Load;
use serde::Serialize;

use super::{Answer, Bound, Errors, Noise, Row, TestedUnit};

/// Errors of presses on a unit, and how many times the Cramér–Rao bound they are.
#[derive(Serialize)]
pub struct Held {
    /// Root mean squares.
    #[serde(flatten)]
    pub row: Row,
    /// Of the direction.
    pub direction_bounds: f64,
    /// Of |F|.
    pub magnitude_bounds: f64,
    /// Of the place.
    pub place_bounds: f64,
    /// The errors.
    #[serde(skip)]
    pub errors: Errors,
    /// Why there was no force, by status.
    #[serde(skip)]
    pub reasons: BTreeMap<&'static str, u32>,
    /// Presses that move a marker out of the picture, or are beyond the simulated film: they are
    /// left out.
    #[serde(skip)]
    pub hidden: u32,
}

impl Held {
    /// What a model says of presses of one |F|, mN, on a unit.
    ///
    /// # Errors
    /// When the unit finds no tare, or the film cannot take a press.
    pub fn of(
        unit: &TestedUnit,
        model: &Model<'_>,
        force_mn: u32,
        loads: impl Iterator<Item = Result<Load>>,
    ) -> Result<Held> {
        let mut tared = unit.tare(model)?;
        let (mut answers, mut hidden) = (Vec::new(), 0);
        for (number, load) in (0..).zip(loads) {
            let load = load?;
            if unit.shows_all(&load)? {
                answers.push(tared.answer(unit, load, number)?);
            } else {
                hidden += 1;
            }
        }
        let noise = noise_of(&answers);
        let (mut errors, mut bound) = (Errors::default(), Bound::default());
        let mut reasons = BTreeMap::new();
        for answer in &answers {
            errors.add(answer.force.as_ref(), &answer.load)?;
            if answer.force.is_some() {
                bound = bound.plus(&Bound::of(unit, &answer.load, &noise)?);
            }
            for reason in answer.refusals() {
                *reasons.entry(reason).or_insert(0) += 1;
            }
        }
        let count = f64::from(errors.count);
        let row = errors.row(force_mn);
        let times = |found: f64, square: f64, unit: f64| found / ((square / count).sqrt() * unit);
        Ok(Held {
            direction_bounds: times(row.direction_deg.to_radians(), bound.direction, 1.0),
            magnitude_bounds: times(row.magnitude_mn, bound.force, 1e3),
            place_bounds: times(row.place_um, bound.place, 1e3),
            row,
            errors,
            reasons,
            hidden,
        })
    }

    /// Cells of a table: root mean squares, how many times the bound they are, and how many errors
    /// are within their stated bounds.
    pub fn cells(&self) -> String {
        let Row {
            direction_deg,
            magnitude_mn,
            place_um,
            ..
        } = self.row;
        let [direction, force, place] = self.errors.covered();
        format!(
            "{direction_deg:.3}° | {magnitude_mn:.3} mN | {place_um:.1} µm | {:.2}, {:.2}, {:.2} | \
             {direction:.1}, {force:.1}, {place:.1} %",
            self.direction_bounds, self.magnitude_bounds, self.place_bounds,
        )
    }

    /// A cell: how many presses have no force, why, and how many are left out.
    pub fn refused(&self) -> String {
        let Errors { count, refused, .. } = self.errors;
        let reasons = self.reasons.iter();
        let reasons: String = reasons
            .map(|(reason, count)| format!(", {count} `{reason}`"))
            .collect();
        format!(
            "{refused} of {}{reasons}; {} more with a marker out of the picture",
            refused + count,
            self.hidden
        )
    }
}

/// How centroids scatter around where the markers truly are, in these very frames.
pub fn noise_of(answers: &[Answer]) -> Noise {
    let off: Vec<[f64; 8]> = (answers.iter())
        .filter_map(|answer| answer.off_px?.as_flattened().try_into().ok())
        .collect();
    let count = off.len() as f64;
    let mean: [f64; 8] = std::array::from_fn(|i| off.iter().map(|off| off[i]).sum::<f64>() / count);
    let covariance = |i: usize, j: usize| {
        let products = off
            .iter()
            .map(|off| (off[i] - mean[i]) * (off[j] - mean[j]));
        products.sum::<f64>() / count
    };
    std::array::from_fn(|i| std::array::from_fn(|j| covariance(i, j)))
}
