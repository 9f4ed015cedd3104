//! The sensing's answer to presses of the full film, without frames.

use anyhow::{Result, anyhow};
use hivtac_calibration::data::dataset::Observation;
use hivtac_calibration::evaluation::answer::Chip;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;
use rand_chacha::ChaCha8Rng;

use super::presses::Press;
use crate::press::normal;

/// Noise of each coordinate of a centroid, px: what the simulated camera's frames have at 320×240.
const NOISE_PX: f64 = 0.011;

/// The sensor without its camera: it is given centroids with noise in place of frames.
pub struct Reader<'m> {
    chip: Chip<'m>,
    weights: &'m Weights,
    random: ChaCha8Rng,
}

impl<'m> Reader<'m> {
    /// Returns a reader with a model and the weights from which it was exported.
    ///
    /// # Errors
    /// If the rest position does not fit the chip's numbers.
    pub fn new(model: Model<'m>, weights: &'m Weights, random: ChaCha8Rng) -> Result<Reader<'m>> {
        Ok(Reader {
            chip: Chip::new(model, &weights.rest)?,
            weights,
            random,
        })
    }

    /// Returns the force of a press, in one draw of noise; `None` if the sensor refuses it.
    ///
    /// # Errors
    /// If the centroids do not fit the chip's numbers.
    pub fn read(&mut self, press: &Press) -> Result<Option<Force>> {
        let seen = self.observation(&press.moved_px)?;
        let (force, status) = self.chip.force(&seen)?;
        Ok((!status.intersects(Status::NO_FORCE)).then_some(force))
    }

    /// Returns what a frame shows if the markers' images move like this, px.
    fn observation(&mut self, moved_px: &[[f64; 2]; 4]) -> Result<Observation> {
        let rest = &self.weights.rest;
        let film = self.weights.film.as_ref();
        let film = film.ok_or_else(|| anyhow!("the model has no film"))?;
        let rest_px = rest.features_px();
        let mut marker = |k: usize| {
            let [x, y] = [0, 1].map(|i| {
                let still = rest_px[2 * k + i] - film.rest_px[k][i];
                let px = still + moved_px[k][i] + NOISE_PX * normal(&mut self.random);
                Px((f64::from(Px::ONE.0) * px).round() as i32)
            });
            let area = rest.areas_px[k];
            Marker { x, y, area }
        };
        let markers: [Marker; 4] = std::array::from_fn(&mut marker);
        Ok(Observation {
            features_q16: Features::of_markers(&markers).to_array(),
            areas_px: rest.areas_px,
        })
    }
}
