//! How good a unit's own model is: fitted without some of its loads, and judged on these.

use anyhow::Result;
use rayon::prelude::*;

use super::Known;
use crate::quantize::export;
use crate::weights::Weights;
use hivtac_data::dataset::{Dataset, Row};
use hivtac_evaluation::{Evaluation, Judged};

/// Parts into which the loads are divided; each is left out once.
const PARTS: usize = 5;

impl Weights {
    /// The forces that models of a unit give for the frames of loads which they were not fitted to:
    /// each load is left out of one of five fits. `known` as in [`Self::for_unit`]. Nothing when
    /// there are fewer than five loads.
    ///
    /// # Errors
    /// As [`Self::for_unit`].
    pub fn judged_on_others(&self, dataset: &Dataset, known: Known<'_>) -> Result<Vec<Judged>> {
        let numbers = numbered(dataset);
        let loads = numbers.iter().flatten().max().map_or(0, |last| last + 1);
        if loads < PARTS {
            return Ok(Vec::new());
        }
        let judge = |part: usize| {
            let of_part = |number: &usize| number % PARTS == part;
            let fitted = with(dataset, &numbers, |number| !of_part(number));
            let left_out = with(dataset, &numbers, of_part);
            let (weights, _) = self.clone().for_unit(&fitted, known)?;
            let evaluation = Evaluation::of(&export(&weights)?, &left_out)?;
            Ok(evaluation.judged)
        };
        let judged: Result<Vec<_>> = (0..PARTS).into_par_iter().map(judge).collect();
        Ok(judged?.concat())
    }
}

/// Rows of presses anywhere that are left out together: a press is not known by its neighbours.
const TOGETHER: usize = 200;

/// The number of each row's load, from 0; nothing without a force. Of presses anywhere, stretches
/// take the loads' place.
fn numbered(dataset: &Dataset) -> Vec<Option<usize>> {
    let mut loads: Vec<&Row> = Vec::new();
    let mut numbers = Vec::new();
    let mut anywhere = 0;
    for row in &dataset.rows {
        if row.force_n == [0.0; 3] {
            numbers.push(None);
            continue;
        }
        if dataset.is_free(row) {
            numbers.push(Some(anywhere / TOGETHER));
            anywhere += 1;
            continue;
        }
        let same = |load: &&Row| (load.force_n, load.tip_mm) == (row.force_n, row.tip_mm);
        let number = loads.iter().position(same).unwrap_or(loads.len());
        if number == loads.len() {
            loads.push(row);
        }
        numbers.push(Some(number));
    }
    numbers
}

/// The rows without a force, and those of some loads.
fn with(
    dataset: &Dataset,
    numbers: &[Option<usize>],
    is_wanted: impl Fn(&usize) -> bool,
) -> Dataset {
    let rows = dataset.rows.iter().zip(numbers);
    let wanted = rows.filter(|(_, number)| number.as_ref().is_none_or(&is_wanted));
    Dataset {
        about: dataset.about.clone(),
        rows: wanted.map(|(row, _)| row.clone()).collect(),
    }
}
