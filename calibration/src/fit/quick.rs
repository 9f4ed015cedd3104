//! A closed form from a handful of known loads, and how good it is.

use std::fmt;

use anyhow::{Result, ensure};

use super::no_network;
use crate::closed_form::{self, ClosedForm, Effort};
use crate::dataset::{Dataset, Sample};
use crate::errors::{angle_deg, mean, norm};
use crate::network::INPUTS;
use crate::uncertainty::{MAGNITUDE_BOUND, Miss};
use crate::weights::{Range, Training, Uncertainty, Weights};

/// The fewest loads.
const FEWEST: usize = 4;

/// A closed form from a few loads.
#[derive(Clone, Debug)]
pub struct Quick {
    /// Ready to be saved or exported.
    pub weights: Weights,
    /// Each load, with what a closed form from the others says of it.
    pub loads: Vec<Checked>,
}

/// A load that was left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checked {
    /// The force, N.
    pub force_n: [f64; 3],
    /// Frames of it.
    pub frames: usize,
    /// What the others say of its frames' mean features, N.
    pub found_n: [f64; 3],
}

/// A load: its force, and its features averaged over its frames.
struct Load {
    force_n: [f64; 3],
    frames: usize,
    features: [f64; INPUTS],
}

/// Fits a closed form to the loads of a data set, its sessions tared; rows of the same force are one load.
///
/// # Errors
/// When there are fewer than four loads, no frames at rest, or the loads are too alike.
pub fn quick(dataset: &Dataset) -> Result<Quick> {
    let dataset = dataset.clone().tared()?;
    let (rest, loads) = (dataset.rest()?, loads(&dataset));
    ensure!(
        loads.len() >= FEWEST,
        "{} loads are too few: {FEWEST} at least",
        loads.len()
    );
    let rows: Vec<_> = loads
        .iter()
        .map(|load| (load.features, load.force_n))
        .collect();
    let form = closed_form::fit(&rest.features_px(), &rows, Effort::Few)?;
    let others = closed_form::left_out(&rest.features_px(), &rows, &form)?;
    let pressed: Vec<Sample<'_>> = dataset.samples().collect();
    let found =
        |form: &ClosedForm, features: &[f64; INPUTS]| form.force_n(features, &rest.features_px());
    let misses: Vec<Vec<Miss>> = loads
        .iter()
        .zip(&others)
        .map(|(load, form)| {
            let of_load = pressed.iter().filter(|row| row.force_n == load.force_n);
            of_load
                .map(|row| Miss::of(found(form, &row.seen.features_px()), row.force_n))
                .collect()
        })
        .collect();
    let checked = |(load, form): (&Load, &ClosedForm)| Checked {
        force_n: load.force_n,
        frames: load.frames,
        found_n: found(form, &load.features),
    };
    let loads: Vec<Checked> = loads.iter().zip(&others).map(checked).collect();
    let weights = Weights {
        format: Weights::format(),
        conditions: dataset.about.conditions.clone(),
        rest,
        range: range(&loads),
        uncertainty: uncertainty(&misses),
        training: Training {
            scene: dataset.about.scene.clone(),
            data_seed: dataset.about.seed,
            rows: pressed.len(),
            ..Training::default()
        },
        closed_form: Some(form),
        network: no_network(&pressed)?,
    };
    Ok(Quick { weights, loads })
}

fn loads(dataset: &Dataset) -> Vec<Load> {
    let mut loads: Vec<Load> = Vec::new();
    for (seen, force_n) in dataset.accepted().filter(|(_, force)| *force != [0.0; 3]) {
        let features = seen.features_px();
        match loads.iter_mut().find(|load| load.force_n == force_n) {
            Some(load) => {
                load.frames += 1;
                load.features
                    .iter_mut()
                    .zip(features)
                    .for_each(|(sum, f)| *sum += f);
            }
            None => loads.push(Load {
                force_n,
                frames: 1,
                features,
            }),
        }
    }
    for load in &mut loads {
        load.features = load.features.map(|sum| sum / load.frames as f64);
    }
    loads
}

/// The usual range, but no larger a force than was shown.
fn range(loads: &[Checked]) -> Range {
    let largest = loads
        .iter()
        .map(|load| norm(load.force_n))
        .fold(0.0, f64::max);
    let usual = Range::default();
    Range {
        force_n: usual.force_n.min(largest),
        ..usual
    }
}

/// Root mean squares of what single frames of loads that were left out were off by, each load counting the same; larger by
/// as much as so few loads may be luckier than the rest (Student's t at 97.5 %, loads less one degrees of freedom, over the
/// normal distribution's).
fn uncertainty(misses: &[Vec<Miss>]) -> Uncertainty {
    let root = |of: fn(&Miss) -> f64| {
        let of_load = |frames: &Vec<Miss>| mean(frames.iter().map(|miss| of(miss).powi(2)));
        mean(misses.iter().map(of_load)).sqrt() * few(misses.len())
    };
    Uncertainty::constant(root(|miss| miss.across_n), root(|miss| miss.along_n))
}

/// Student's t over the normal distribution's, both at 97.5 %, for a deviation from so many values: an expansion by the
/// degrees of freedom (Fisher and Cornish 1960), within 1 % from four values on.
fn few(values: usize) -> f64 {
    let (z, n) = (MAGNITUDE_BOUND, values.saturating_sub(1).max(1) as f64);
    let z2 = z * z;
    let first = (z2 + 1.0) / 4.0;
    let second = ((5.0 * z2 + 16.0) * z2 + 3.0) / 96.0;
    let third = (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / 384.0;
    1.0 + first / n + second / (n * n) + third / (n * n * n)
}

impl fmt::Display for Quick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "each load as the others predict it:")?;
        for load in &self.loads {
            let off_mn = 1e3 * (norm(load.found_n) - norm(load.force_n));
            let angle = angle_deg(load.found_n, load.force_n).unwrap_or(f64::NAN);
            let size_mn = 1e3 * norm(load.force_n);
            writeln!(
                f,
                "  {size_mn:6.1} mN, {} frames: |F| {off_mn:+.2} mN, direction {angle:.2}° off",
                load.frames
            )?;
        }
        let Uncertainty {
            across_n, along_n, ..
        } = &self.weights.uncertainty;
        write!(
            f,
            "expect forces within {:.2} mN across themselves and |F| within {:.2} mN (one standard deviation; loads between \
             these do better than the smallest and the largest, which were extrapolated here)",
            across_n[0] * 1e3,
            along_n[0] * 1e3
        )
    }
}

#[cfg(test)]
mod tests {
    use super::few;

    /// Tables of Student's distribution at 97.5 %: 3.182, 2.776, 2.262 and 1.984 for 3, 4, 9 and 99 degrees of freedom.
    #[test]
    fn few_values_count_as_students_distribution_says() {
        for (values, t) in [(4, 3.182), (5, 2.776), (10, 2.262), (100, 1.984)] {
            let expected = t / 1.959_964;
            assert!((few(values) / expected - 1.0).abs() < 0.01, "{values}");
        }
    }
}
