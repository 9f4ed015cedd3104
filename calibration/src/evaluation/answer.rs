//! Computes the chip's answer to a row of a data set.

use anyhow::Result;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::Start;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network;
use hivtac_sensor::force::{self, Force, FrameNoise, Resting};
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::markers::rules::Placed;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_twin::film::Dots;

use crate::data::dataset::Observation;
use crate::data::rest::features_from_q16;

/// A model on the chip, with a rest position.
pub struct Chip<'m> {
    areas_px: Dots<u32>,
    model: Model<'m>,
    tare: Features,
    resting: Option<Resting>,
    network: Network,
}

impl<'m> Chip<'m> {
    /// With the rest position of a data set.
    ///
    /// # Errors
    /// When its features do not fit the chip's numbers.
    pub fn new(model: Model<'m>, rest: &crate::data::rest::Rest) -> Result<Self> {
        let rest = rest.to_sensor()?;
        let tare = rest.features;
        Ok(Self {
            areas_px: rest.areas,
            resting: Resting::of_model(&model, &rest),
            model,
            tare,
            network: Network::new(),
        })
    }

    /// The markers' areas at rest, px.
    pub fn areas_px(&self) -> Dots<u32> {
        self.areas_px
    }

    /// The chip's force for an observation, and its status bits.
    ///
    /// # Errors
    /// When the features do not fit the chip's numbers.
    pub fn force(&mut self, seen: &Observation) -> Result<(Force, Status)> {
        let features = features_from_q16(&seen.features_q16)?;
        let forward = self.model.forward.as_ref().zip(self.resting.as_ref());
        let Some((forward, resting)) = forward else {
            let output = self.network.run(&self.model, &features, &self.tare);
            return Ok(force::of_outputs(&self.model, &output));
        };
        let pairs = features.centroids.iter().zip(seen.areas_px);
        let markers = pairs.map(|((x, y), area)| Marker { x: *x, y: *y, area });
        let markers: Vec<Marker> = markers.collect();
        let noise = FrameNoise::AS_MODELLED;
        let estimate = match self.model.layers().is_empty() {
            true => {
                let start = Start::Anywhere;
                let placed = (&Placed::of(&markers), Lost::NONE);
                resting.estimate_without(forward, placed, noise, (start, true))
            }
            false => {
                let output = self.network.run(&self.model, &features, &self.tare);
                resting.estimate(forward, &markers, noise, &output)
            }
        };
        Ok(resting.force_and_status(forward, &self.model.range, noise, &estimate))
    }
}
