//! Uncertainties that hold: widened until the errors on a data set lie within what they say.

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_film::reduced::NOMINAL_RADIUS_MM;
use hivtac_sensing::forward::SIZES;
use hivtac_sensing::model::Model;

use super::{FilmModel, Noise};
use crate::quantize::export;
use crate::weights::Weights;
use hivtac_data::dataset::Dataset;
use hivtac_data::loads::norm;
use hivtac_evaluation::answer::Chip;
use hivtac_evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use hivtac_evaluation::errors::angle_deg;

/// The part of the errors that the 95 % bounds hold on the rows that they are made from, a little
/// more than they promise: by the noise alone, and with what is beside it at a size, which holds
/// for all places.
const COVERED: f64 = 0.96;
const COVERED_BESIDE: f64 = 0.97;
/// The last of the sizes at which it is told what is beside the noise.
const LAST: f64 = (SIZES - 1) as f64;

/// What a row's uncertainties would have to be at the least for its errors to lie within their
/// bounds.
struct Needed {
    /// The size of the force that was found, in parts of the largest.
    size: f64,
    /// Of direction and place: times what they are.
    times: [f64; 2],
    /// Of the force across itself, N, of |F|, as sizes, and of the place, mm: beside what they are.
    beside: [f64; 3],
}

impl Weights {
    /// These weights with the nominal film run forwards beside the network, in so many Gauss–Newton
    /// steps, 0–3. The noise of markers is that of a data set of presses anywhere, widened until 96
    /// of 100 errors of direction and place lie within their bounds; where that is not enough,
    /// other uncertainties are beside it, by size.
    ///
    /// # Errors
    /// When the network tells no place, or the data set has too few presses of known places.
    pub fn with_film(mut self, steps: u8, dataset: &Dataset) -> Result<Weights> {
        let noise = Noise::of(dataset, NOMINAL_RADIUS_MM)?;
        let film = FilmModel::nominal(steps, &noise);
        self.film = Some(film.clone());
        let rows = needed(&self, dataset)?;
        let [direction, place] =
            [0, 1].map(|k| quantile(COVERED, rows.iter().map(|row| (row.times[k], 1.0))));
        let wider = direction.max(place).max(1.0);
        let mut film = FilmModel {
            noise_px: film.noise_px.map(|part| part * wider),
            ..film
        };
        self.film = Some(film.clone());
        let rows = needed(&self, dataset)?;
        for (knot, beside) in film.beside_noise.iter_mut().enumerate() {
            let near = |row: &Needed| (1.0 - (row.size * LAST - knot as f64).abs()).max(0.0);
            *beside = [0, 1, 2].map(|k| {
                quantile(
                    COVERED_BESIDE,
                    rows.iter().map(|row| (row.beside[k], near(row))),
                )
            });
        }
        self.film = Some(film);
        Ok(self)
    }
}

fn needed(weights: &Weights, dataset: &Dataset) -> Result<Vec<Needed>> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
    let forward = model.forward.context("the network tells no place")?;
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
        let per_size_n = f64::from(forward.stiffness.per_size_n(size));
        // Each with its stated standard uncertainty.
        let direction = (
            angle.to_radians() / DIRECTION_BOUND,
            (f64::from(force.direction_sigma.0) * 1e-3).to_radians(),
        );
        let across = (magnitude_n * direction.0, magnitude_n * direction.1);
        let size_off = (
            (magnitude_n - norm(sample.force_n)).abs() / MAGNITUDE_BOUND / per_size_n,
            f64::from(force.magnitude_sigma.0) * 1e-6 / per_size_n,
        );
        let place = (far_mm / PLACE_BOUND, f64::from(place.sigma.0) * 1e-3);
        let beside =
            |(needed, stated): (f64, f64)| (needed * needed - stated * stated).max(0.0).sqrt();
        all.push(Needed {
            size: f64::from(size / forward.limits.size),
            times: [direction, place].map(|(needed, stated)| needed / stated),
            beside: [across, size_off, place].map(beside),
        });
    }
    ensure!(
        !all.is_empty(),
        "the data set has no press that is measured"
    );
    Ok(all)
}

/// What a part of the values, each with its weight, are at most; nothing of none.
fn quantile(part: f64, values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut values: Vec<(f64, f64)> = values.filter(|(_, weight)| *weight > 0.0).collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut left = part * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let reached = values.iter().find(|(_, weight)| {
        left -= weight;
        left < 0.0
    });
    reached.map_or(0.0, |(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_weights_is_below_the_quantile() {
        let values = || [(3.0, 2.0), (1.0, 1.0), (9.0, 0.0), (2.0, 1.0)].into_iter();
        for (part, expected) in [(0.0, 1.0), (0.3, 2.0), (0.5, 3.0), (0.99, 3.0)] {
            assert_eq!(quantile(part, values()), expected, "{part}");
        }
        assert_eq!(quantile(0.9, std::iter::empty()), 0.0);
    }
}
