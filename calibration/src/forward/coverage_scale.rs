//! Widens stated uncertainties until the errors on a data set lie within their bounds.

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_sensor::force::model::Model;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;

use super::{FilmModel, Noise};
use crate::data::dataset::Dataset;
use crate::data::loads::norm;
use crate::evaluation::answer::Chip;
use crate::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use crate::evaluation::errors::angle_deg;
use crate::quantize::export;
use crate::weights::Weights;

/// The part of errors that the 95 % bounds must contain on the rows that they are made from: a
/// little more than they promise.
const COVERED: f64 = 0.96;
/// Candidates for the tables' error of a marker under the largest force, px; and the part of the
/// largest size from which on forces reveal it.
const BESIDE_PX: [f64; 8] = [0.0, 0.001, 0.002, 0.003, 0.004, 0.006, 0.008, 0.012];
const LARGE: f64 = 0.6;

/// Factors on a row's uncertainties with which its errors would just lie within their bounds.
struct LeastScale {
    /// Size of the force that was found, in parts of the largest.
    size: f64,
    /// Of direction, |F| and place.
    scale: [f64; 3],
}

impl Weights {
    /// These weights with the nominal forward model after the network, in `steps` Gauss–Newton
    /// steps, 0–3. The noise of markers is that of a data set of presses anywhere, widened until 96
    /// of 100 errors of direction and place lie within their bounds. Where large forces need more,
    /// the tables get an error of their own in the markers' motion. The weights' data on other
    /// units stay.
    ///
    /// # Errors
    /// When the network gives no place, or the data set has too few presses at known places.
    pub fn with_film(mut self, steps: u8, dataset: &Dataset) -> Result<Weights> {
        let noise = Noise::of(dataset, NOMINAL_RADIUS_MM)?;
        let mut film = FilmModel {
            others: self.film.and_then(|film| film.others),
            ..FilmModel::nominal(steps, &noise)
        };
        self.film = Some(film.clone());
        let rows = least_scales(&self, dataset)?;
        let covering =
            |rows: &[LeastScale], k: usize| quantile(COVERED, rows.iter().map(|row| row.scale[k]));
        let wider = covering(&rows, 0).max(covering(&rows, 2)).max(1.0);
        film.noise_px = film.noise_px.map(|part| part * wider);
        for beside_px in BESIDE_PX {
            film.beside_px = beside_px;
            self.film = Some(film.clone());
            let mut rows = least_scales(&self, dataset)?;
            rows.retain(|row| row.size >= LARGE);
            if (0..3).all(|k| covering(&rows, k) <= 1.0) {
                break;
            }
        }
        Ok(self)
    }
}

fn least_scales(weights: &Weights, dataset: &Dataset) -> Result<Vec<LeastScale>> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
    let forward = model.forward.context("the network gives no place")?;
    let mut chip = Chip::new(model, &dataset.rest()?)?;
    let mut all = Vec::new();
    for sample in dataset.samples() {
        let (force, _) = chip.force(sample.seen)?;
        let found = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
        let (Some(angle), Some(place), Some(tip_mm)) =
            (angle_deg(found, sample.force_n), force.place, sample.tip_mm)
        else {
            continue;
        };
        let off_mm = [place.x, place.y].map(|part| f64::from(part.0) * 1e-3);
        let far_mm = (off_mm[0] - tip_mm[0]).hypot(off_mm[1] - tip_mm[1]);
        let magnitude_n = norm(found);
        let size = forward
            .stiffness
            .size_of(magnitude_n as f32, forward.limits.size);
        // Each error over its stated standard uncertainty.
        let direction = angle / DIRECTION_BOUND / (f64::from(force.direction_sigma.0) * 1e-3);
        let off_n = (magnitude_n - norm(sample.force_n)).abs();
        let magnitude = off_n / MAGNITUDE_BOUND / (f64::from(force.magnitude_sigma.0) * 1e-6);
        let place = far_mm / PLACE_BOUND / (f64::from(place.sigma.0) * 1e-3);
        all.push(LeastScale {
            size: f64::from(size / forward.limits.size),
            scale: [direction, magnitude, place],
        });
    }
    ensure!(
        !all.is_empty(),
        "the data set has no press that is measured"
    );
    Ok(all)
}

/// The value that this part of the values do not exceed; 0 without values.
fn quantile(part: f64, values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let number = (part * values.len() as f64) as usize;
    values.get(number).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_values_is_below_the_quantile() {
        for (part, expected) in [(0.0, 1.0), (0.3, 2.0), (0.5, 3.0), (0.99, 9.0)] {
            let values = [3.0, 1.0, 9.0, 2.0].into_iter();
            assert_eq!(quantile(part, values), expected, "{part}");
        }
        assert_eq!(quantile(0.9, std::iter::empty()), 0.0);
    }
}
