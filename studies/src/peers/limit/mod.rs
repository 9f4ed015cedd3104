//! The physical limit: how well a force could be read from these centroids at all.
//!
//! Centroids scatter about the truth by the frames' noise and by how the markers happen to lie on
//! the pixel grid. With the covariance Σ of that scatter and the Jacobian J of the true centroids
//! by the force, no unbiased reading of single frames has a covariance below (JᵀΣ⁻¹J)⁻¹
//! (Cramér–Rao, for normal noise).

mod bound;
pub mod matrix;

use anyhow::{Context, Result};
use hivtac_calibration::data::dataset::{MarkerDetector, Sensing};
use hivtac_calibration::data::loads::norm;
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_twin::{Contact, Load, Scene};
use rayon::prelude::*;
use serde::Serialize;

use super::frames::Frames;
use super::models::Answers;
use bound::{Bound, COORDINATES, Noise, bound, centroids, jacobian};
use matrix::{dot, least_squares};

/// Parts of the frames, by |F|.
const PARTS: usize = 10;
/// Loads of each part that are rendered again, and how often.
const REPEATED_LOADS: usize = 6;
const REPEATS: usize = 8;

/// A tenth of the frames, by |F|.
#[derive(Clone, Debug, Serialize)]
pub struct Tenth {
    /// Smallest and largest |F|, mN.
    pub force_mn: [f64; 2],
    /// Scatter of a centroid's coordinate about the truth, px, root mean square.
    pub scatter_px: f64,
    /// The part of it that other noise on the same load makes.
    pub repeat_px: f64,
    /// Least root mean square error of the direction, degrees, and of |F|, mN, with that scatter.
    pub bound: [f64; 2],
    /// The same if only noise scattered.
    pub noise_bound: [f64; 2],
    /// What each model has, by name.
    pub found: Vec<(&'static str, [f64; 2])>,
}

/// One test frame: its label, the true centroids and how they follow the force, and how far the
/// sensing was off.
struct TestSample {
    row: usize,
    force_n: [f64; 3],
    jacobian: [[f64; COORDINATES]; 3],
    off_px: [f64; COORDINATES],
}

/// The limit and the models beside it, by tenths of the frames from weak to strong.
///
/// # Errors
/// When a load cannot be rendered.
pub fn tenths(
    frames: &Frames,
    rows: &[usize],
    models: &[(&'static str, Answers)],
) -> Result<Vec<Tenth>> {
    let recipe = &frames.test_recipe;
    let scene = recipe.scene(0)?;
    let sample = |&row: &usize| sample(&scene, recipe.contact, frames, row);
    let mut samples: Vec<TestSample> = rows.par_iter().map(sample).collect::<Result<_>>()?;
    samples.sort_by(|a, b| norm(a.force_n).total_cmp(&norm(b.force_n)));
    let count = samples.len();
    let part = |i: usize| &samples[i * count / PARTS..(i + 1) * count / PARTS];
    let parts = (0..PARTS)
        .map(part)
        .filter(|part| part.len() > COORDINATES * 4);
    parts
        .map(|part| tenth(&scene, frames, part, models))
        .collect()
}

fn sample(scene: &Scene, contact: Contact, frames: &Frames, row: usize) -> Result<TestSample> {
    let seen = &frames.ours.test.rows[row];
    let force_n = seen.force_n;
    let truth = centroids(scene, contact, force_n)?;
    let found = seen
        .seen
        .as_ref()
        .map_err(|why| anyhow::anyhow!("{why}"))?
        .features_px();
    Ok(TestSample {
        row,
        force_n,
        jacobian: jacobian(scene, contact, force_n)?,
        off_px: std::array::from_fn(|i| found[i] - truth[i]),
    })
}

fn tenth(
    scene: &Scene,
    frames: &Frames,
    samples: &[TestSample],
    models: &[(&'static str, Answers)],
) -> Result<Tenth> {
    let scatter = scatter(samples)?;
    let repeats = repeats(scene, frames, samples)?;
    let found = |(name, answers): &(&'static str, Answers)| (*name, errors(samples, answers));
    Ok(Tenth {
        force_mn: [samples.first(), samples.last()]
            .map(|l| l.map_or(0.0, |l| 1e3 * norm(l.force_n))),
        scatter_px: rms(&scatter),
        repeat_px: rms(&repeats),
        bound: least(samples, &scatter)?,
        noise_bound: least(samples, &repeats)?,
        found: models.iter().map(found).collect(),
    })
}

/// Covariance of what is off, less what follows the force: a model learns that.
fn scatter(samples: &[TestSample]) -> Result<Noise> {
    let a = |sample: &TestSample| {
        let size = norm(sample.force_n);
        let [x, y, _] = sample.force_n;
        [
            1.0,
            10.0 * size,
            30.0 * x,
            30.0 * y,
            300.0 * size * x,
            300.0 * size * y,
        ]
    };
    let mut left = vec![[0.0; COORDINATES]; samples.len()];
    let mut known = 0;
    for i in 0..COORDINATES {
        let rows: Vec<_> = samples.iter().map(|l| (a(l), l.off_px[i])).collect();
        let x = least_squares(&rows)?;
        known = x.len();
        for (left, (a, off)) in left.iter_mut().zip(&rows) {
            left[i] = off - dot(a, &x);
        }
    }
    Ok(covariance(&left, samples.len() - known))
}

fn covariance(rows: &[[f64; COORDINATES]], freedom: usize) -> Noise {
    let sum = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
    std::array::from_fn(|i| std::array::from_fn(|j| sum(i, j) / freedom as f64))
}

/// Covariance over repeats of the same loads with other noise.
fn repeats(scene: &Scene, frames: &Frames, samples: &[TestSample]) -> Result<Noise> {
    let recipe = &frames.test_recipe;
    let step = (samples.len() / REPEATED_LOADS).max(1);
    let one = |sample: &TestSample| -> Result<Vec<[f64; COORDINATES]>> {
        let mut detector = Sensing::unmodelled(recipe)?;
        let load = Load::from_vector(sample.force_n)?.with_contact(recipe.contact)?;
        let mut seen = Vec::new();
        for repeat in 0..REPEATS {
            // No row of the data set has this noise.
            let number = (recipe.rows() + sample.row * REPEATS + repeat) as u64;
            if let Ok(found) = detector.detect(&scene.render_load(&load, number)?)? {
                let px = found.features_px();
                seen.push(std::array::from_fn(|i| px[i]));
            }
        }
        let mean: [f64; COORDINATES] = std::array::from_fn(|i| {
            seen.iter().map(|s: &[f64; COORDINATES]| s[i]).sum::<f64>() / seen.len() as f64
        });
        Ok(seen
            .iter()
            .map(|s| std::array::from_fn(|i| s[i] - mean[i]))
            .collect())
    };
    let chosen: Vec<&TestSample> = samples.iter().step_by(step).take(REPEATED_LOADS).collect();
    let off = chosen
        .par_iter()
        .map(|sample| one(sample))
        .collect::<Result<Vec<_>>>()?;
    let freedom = off.iter().map(|seen| seen.len().saturating_sub(1)).sum();
    Ok(covariance(&off.concat(), freedom))
}

/// Root mean squares of the bounds: direction in degrees, |F| in mN.
fn least(samples: &[TestSample], noise: &Noise) -> Result<[f64; 2]> {
    let one = |sample: &TestSample| bound(noise, &sample.jacobian, sample.force_n);
    let bounds: Vec<Bound> = samples
        .iter()
        .map(one)
        .collect::<Result<_>>()
        .context("the limit")?;
    let mean =
        |of: fn(&Bound) -> f64| (bounds.iter().map(of).sum::<f64>() / bounds.len() as f64).sqrt();
    Ok([mean(|b| b.direction).to_degrees(), 1e3 * mean(|b| b.force)])
}

/// A model's root mean square errors on the same frames.
fn errors(samples: &[TestSample], answers: &Answers) -> [f64; 2] {
    let known: Vec<_> = samples
        .iter()
        .filter_map(|sample| answers[sample.row])
        .collect();
    let mean = |of: &dyn Fn([[f64; 3]; 2]) -> f64| {
        (known.iter().map(|&pair| of(pair).powi(2)).sum::<f64>() / known.len() as f64).sqrt()
    };
    [
        mean(&|[truth, found]| angle_deg(found, truth).unwrap_or(90.0)),
        1e3 * mean(&|[truth, found]| norm(found) - norm(truth)),
    ]
}

/// Of a coordinate.
fn rms(noise: &Noise) -> f64 {
    ((0..COORDINATES).map(|i| noise[i][i]).sum::<f64>() / COORDINATES as f64).sqrt()
}
