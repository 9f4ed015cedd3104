//! Uncertainties that hold: widened until the errors on a data set lie within what they say.

use anyhow::{Result, anyhow, ensure};
use hivtac_film::reduced::NOMINAL_RADIUS_MM;
use hivtac_sensing::model::Model;

use super::{FilmModel, Noise};
use crate::answer::Chip;
use crate::dataset::Dataset;
use crate::errors::{angle_deg, norm};
use crate::quantize::export;
use crate::uncertainty::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use crate::weights::Weights;

/// The part of the errors that the 95 % bounds hold on the rows that they are made from: a little
/// more than they promise.
const COVERED: f64 = 0.96;

/// What a row's uncertainties would have to be at the least for its errors to lie within their
/// bounds.
struct Needed {
    /// Times what they are: of the direction.
    direction: f64,
    /// And of the place.
    place: f64,
    /// Of |F|, in parts of it, beside what the markers' noise makes.
    stiffness: f64,
}

impl Weights {
    /// These weights with the nominal film run forwards beside the network, in so many Gauss–Newton
    /// steps, 0–3. The noise of markers is that of a data set of presses anywhere, widened until 96
    /// of 100 errors on it lie within their bounds.
    ///
    /// # Errors
    /// When the network tells no place, or the data set has too few presses of known places.
    pub fn with_film(mut self, steps: u8, dataset: &Dataset) -> Result<Weights> {
        let noise = Noise::of(dataset, NOMINAL_RADIUS_MM)?;
        let film = FilmModel::nominal(steps, &noise);
        self.film = Some(film.clone());
        let rows = needed(&self, dataset)?;
        let direction = quantile(rows.iter().map(|row| row.direction));
        let wider = quantile(rows.iter().map(|row| row.place)).max(direction);
        let mut film = FilmModel {
            noise_px: film.noise_px.map(|part| part * wider.max(1.0)),
            ..film
        };
        self.film = Some(film.clone());
        film.own.stiffness = quantile(needed(&self, dataset)?.iter().map(|row| row.stiffness));
        self.film = Some(film);
        Ok(self)
    }
}

fn needed(weights: &Weights, dataset: &Dataset) -> Result<Vec<Needed>> {
    let bytes = export(weights)?;
    let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
    let mut chip = Chip::new(model, &dataset.rest()?)?;
    let mut all = Vec::new();
    for sample in dataset.samples() {
        let (force, _) = chip.force(sample.seen)?;
        let found = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
        let Some(angle) = angle_deg(found, sample.force_n) else {
            continue;
        };
        let direction = angle / (DIRECTION_BOUND * f64::from(force.direction_sigma.0) * 1e-3);
        let place = match (force.place, sample.tip_mm) {
            (Some(place), Some(tip_mm)) => {
                let off = [place.x, place.y].map(|part| f64::from(part.0) * 1e-3);
                let far = (off[0] - tip_mm[0]).hypot(off[1] - tip_mm[1]);
                far / (PLACE_BOUND * f64::from(place.sigma.0) * 1e-3)
            }
            _ => 0.0,
        };
        let size_n = norm(sample.force_n);
        let off_n = (norm(found) - size_n) / MAGNITUDE_BOUND;
        let known_n = f64::from(force.magnitude_sigma.0) * 1e-6;
        let missing = (off_n * off_n - known_n * known_n).max(0.0).sqrt();
        all.push(Needed {
            direction,
            place,
            stiffness: missing / size_n,
        });
    }
    ensure!(
        !all.is_empty(),
        "the data set has no press that is measured"
    );
    Ok(all)
}

/// What [`COVERED`] of the values are at most.
fn quantile(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at = (COVERED * values.len() as f64) as usize;
    values
        .get(at.min(values.len().saturating_sub(1)))
        .copied()
        .unwrap_or(0.0)
}
