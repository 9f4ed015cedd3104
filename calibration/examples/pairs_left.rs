//! Measures the errors of the sensor's model on unseen pairs, for the network's file: `cargo run
//! --release -p hivtac-calibration --example pairs_left -- unseen.csv sensor/data/pairs-8v.bin`.
//! The pairs are those of `pairs -- unseen.csv 600 unseen`. The errors are those of the network, of
//! the tables and of a coarser mesh.

use std::fs;

use anyhow::{Context, Result, ensure};
use hivtac_calibration::forward::{Matrix, Moved, cholesky, sum_of_squares};
use hivtac_sensor::force::forward::pair::{Both, Interaction, PairPrediction};
use hivtac_sensor::force::forward::{Forward, Markers, Pose};
use hivtac_sensor::force::model::Model;

/// Coordinates of the dots' images.
const COORDINATES: usize = 16;
/// Numbers at the end of the file: a lower factor of the covariance, row by row.
const FACTOR: usize = COORDINATES * (COORDINATES + 1) / 2;
/// Focal length of the camera at 320x240, px.
const FOCAL_PX: f64 = 175.0;
const MODEL: &[u8] = include_bytes!("../models/8v/default.hvtm");

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let pairs = arguments.next().context("name a file of pairs")?;
    let path = arguments.next().context("name the network's file")?;
    let mut bytes = fs::read(&path)?;
    let model = Model::parse(MODEL)
        .ok()
        .context("the model is not readable")?;
    let forward = model.forward.context("the model has no tables")?;
    let interaction = Interaction::new(&bytes).context("the network is not readable")?;
    let (mut lefts, mut squares) = (Vec::new(), 0.0);
    for line in fs::read_to_string(pairs)?.lines() {
        let numbers: Result<Vec<f64>, _> = line.split(',').map(str::parse).collect();
        let (left, variance) = left(&numbers?, &forward, &interaction)?;
        squares += left.iter().map(|part| part * part).sum::<f64>();
        lefts.push(Moved::of(left.map(|part| part / variance.sqrt())));
    }
    let count = lefts.len() as f64;
    ensure!(count > 0.0, "there are no pairs");
    let rms_px = FOCAL_PX * (squares / count / COORDINATES as f64).sqrt();
    println!("{count} pairs: {rms_px:.4} px");
    let sum = sum_of_squares(&lefts);
    let mean: Matrix = sum
        .iter()
        .map(|row| row.iter().map(|part| part / count).collect())
        .collect();
    let factor = cholesky(mean);
    let lower = factor.iter().enumerate().flat_map(|(i, row)| &row[..=i]);
    let end = bytes.len() - 4 * FACTOR;
    bytes.truncate(end);
    bytes.extend(lower.flat_map(|part| (*part as f32).to_le_bytes()));
    Ok(fs::write(path, bytes)?)
}

/// The model's error of a pair's motion, focal lengths, and the growth of its variance.
fn left(
    numbers: &[f64],
    forward: &Forward<'_>,
    interaction: &Interaction<'_>,
) -> Result<([f64; COORDINATES], f64)> {
    let part = |from: usize, count: usize| {
        let parts = numbers.get(from..from + count);
        parts.context("a line is too short")
    };
    let poses = [0, 1].map(|k| -> Result<Pose> {
        let force_n: [f64; 3] = part(3 * k, 3)?.try_into()?;
        let place_mm: [f64; 2] = part(6 + 2 * k, 2)?.try_into()?;
        Ok(Pose::of_force(
            force_n.map(|own| own as f32),
            place_mm.map(|own| own as f32),
            &forward.stiffness,
            &forward.limits,
        ))
    });
    let [first, second] = poses;
    let both = Both::new([first?, second?], forward);
    let mut predicted = PairPrediction::default();
    predicted.put(&both, forward, interaction, &Markers::defaults(8));
    let mut left: [f64; COORDINATES] = part(10, COORDINATES)?.try_into()?;
    for (left, predicted) in left.iter_mut().zip(predicted.moved.iter()) {
        *left -= f64::from(*predicted);
    }
    Ok((left, f64::from(both.left())))
}
