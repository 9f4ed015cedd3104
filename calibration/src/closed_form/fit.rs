//! The curves of a closed form from known loads.

use anyhow::{Result, ensure};

use super::least_squares::solve;
use super::{ClosedForm, Motion, directions};
use crate::errors::norm;
use crate::network::INPUTS;

/// How many coefficients are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// For a handful of loads: few coefficients, chosen by leaving out one load after the other.
    Few,
    /// For thousands of rows: chosen on a tenth of them.
    Many,
}

/// A row: where the markers are, and the force (N).
#[derive(Clone, Copy, Debug)]
struct Known {
    motion: Motion,
    force_n: [f64; 3],
}

/// Forces below this weigh as much as this one, N: relative errors count, down to where noise rules.
const FLOOR_N: f64 = 0.02;

/// Numbers of coefficients of g, h and k.
type Sizes = [usize; 3];

/// Fits the curves to rows of features (px, tared) and forces (N); `rest` is where all of them rest.
///
/// # Errors
/// When the rows are too few or too alike to determine the curves.
pub fn fit(
    rest: &[f64; INPUTS],
    rows: &[([f64; INPUTS], [f64; 3])],
    effort: Effort,
) -> Result<ClosedForm> {
    let directions = directions(rest)?;
    let known = rows.iter().filter(|(_, force)| *force != [0.0; 3]);
    let known: Vec<Known> = known
        .map(|(features, force)| Known {
            motion: Motion::of(&directions, features, rest),
            force_n: *force,
        })
        .collect();
    let radius_px = known
        .iter()
        .map(|row| row.motion.radius)
        .fold(0.0, f64::max);
    ensure!(radius_px > 0.0, "no load moves the markers apart");
    let lateral_n = known
        .iter()
        .map(|row| row.force_n[0].abs().max(row.force_n[1].abs()))
        .fold(0.0, f64::max);
    ensure!(
        lateral_n > 0.0,
        "no load is tilted: the lateral curve needs some that are"
    );
    let blank = ClosedForm {
        directions,
        radius_px,
        g: Vec::new(),
        h: Vec::new(),
        k: Vec::new(),
    };

    let tried: Vec<Sizes> = match effort {
        Effort::Few => (1..=6)
            .flat_map(|g| (1..=4).map(move |h| [g, h, 0]))
            .collect(),
        Effort::Many => (3..=9)
            .flat_map(|g| (1..=5).map(move |h| [g, h, 2]))
            .collect(),
    };
    let scored = tried
        .iter()
        .filter_map(|sizes| Some((left_out_error(&blank, &known, *sizes, effort)?, *sizes)));
    let best = scored.min_by(|a, b| a.0.total_cmp(&b.0));
    // When nothing can be left out, the smallest curves say why.
    let sizes = best.map_or(tried[0], |(_, sizes)| sizes);
    curves(&blank, &known, sizes)
}

/// For each row the curves that are made from the others, of the sizes of `form`.
///
/// # Errors
/// When the others do not determine the curves.
pub fn left_out(
    rest: &[f64; INPUTS],
    rows: &[([f64; INPUTS], [f64; 3])],
    form: &ClosedForm,
) -> Result<Vec<ClosedForm>> {
    let known: Vec<Known> = rows
        .iter()
        .map(|(features, force)| Known {
            motion: Motion::of(&form.directions, features, rest),
            force_n: *force,
        })
        .collect();
    let sizes = [form.g.len(), form.h.len(), form.k.len()];
    let without = |out: usize| -> Vec<Known> {
        known
            .iter()
            .enumerate()
            .filter(|(i, _)| *i != out)
            .map(|(_, row)| *row)
            .collect()
    };
    (0..known.len())
        .map(|out| curves(form, &without(out), sizes))
        .collect()
}

/// Mean of the weighted squared errors of rows that the curves were not made from; `None` when there are too few rows.
fn left_out_error(
    blank: &ClosedForm,
    known: &[Known],
    sizes: Sizes,
    effort: Effort,
) -> Option<f64> {
    let parts = match effort {
        Effort::Few => known.len(),
        Effort::Many => 10,
    };
    let tried = match effort {
        Effort::Few => parts,
        Effort::Many => 1,
    };
    let mut sum = 0.0;
    for part in 0..tried {
        let of_part = |(i, _): &(usize, &Known)| i % parts == part;
        let (out, used): (Vec<_>, Vec<_>) = known.iter().enumerate().partition(of_part);
        let used: Vec<Known> = used.into_iter().map(|(_, row)| *row).collect();
        let form = curves(blank, &used, sizes).ok()?;
        sum += out
            .iter()
            .map(|(_, row)| weight(row) * square_error(&form, row))
            .sum::<f64>();
    }
    sum.is_finite().then_some(sum)
}

fn square_error(form: &ClosedForm, row: &Known) -> f64 {
    let found = form.force_of(row.motion);
    found
        .iter()
        .zip(row.force_n)
        .map(|(a, b)| (a - b) * (a - b))
        .sum()
}

fn weight(row: &Known) -> f64 {
    let size = norm(row.force_n).max(FLOOR_N);
    1.0 / (size * size)
}

/// Curves with these numbers of coefficients.
fn curves(blank: &ClosedForm, known: &[Known], [g, h, k]: Sizes) -> Result<ClosedForm> {
    // By multiplication alone: the same bits on every machine.
    let powers = |part: f64, count: usize| {
        std::iter::successors(Some(1.0), move |p| Some(p * part)).take(count)
    };
    let part = |row: &Known| (row.motion.radius / blank.radius_px).max(0.0);
    let normal: Vec<_> = known
        .iter()
        .map(|row| {
            let [x, y] = row.motion.shift;
            let square = x * x + y * y;
            let a = powers(part(row), g).map(|p| p * part(row));
            let a = a.chain(powers(part(row), k).map(|p| p * square));
            (a.collect(), -row.force_n[2], weight(row))
        })
        .collect();
    let lateral: Vec<_> = known
        .iter()
        .flat_map(|row| {
            let one = move |axis: usize| {
                let a = powers(part(row), h).map(|p| p * row.motion.shift[axis]);
                (a.collect(), row.force_n[axis], weight(row))
            };
            [one(0), one(1)]
        })
        .collect();
    ensure!(
        known.len() >= g + k,
        "{} loads are too few for the curves",
        known.len()
    );
    let mut of_g = solve(&normal)?;
    let of_k = of_g.split_off(g);
    Ok(ClosedForm {
        g: of_g,
        h: solve(&lateral)?,
        k: of_k,
        ..blank.clone()
    })
}
