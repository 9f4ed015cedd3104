//! Computes the chip's answer to a row of a data set.

use anyhow::Result;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::force::{self, Force, FrameNoise, Resting};
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;

use crate::data::dataset::Observation;
use crate::data::rest::features_from_q16;

/// A model on the chip, with a rest position.
pub struct Chip<'m> {
    areas_px: [u32; 4],
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
        let tare = features_from_q16(&rest.features_q16)?;
        let rest = Rest {
            features: tare,
            areas: rest.areas_px.into(),
        };
        Ok(Self {
            areas_px: rest.areas.array(),
            resting: Resting::of_model(&model, &rest),
            model,
            tare,
            network: Network::new(),
        })
    }

    /// The markers' areas at rest, px.
    pub fn areas_px(&self) -> [u32; 4] {
        self.areas_px
    }

    /// The chip's force for an observation, and its status bits.
    ///
    /// # Errors
    /// When the features do not fit the chip's numbers.
    pub fn force(&mut self, seen: &Observation) -> Result<(Force, Status)> {
        let features = features_from_q16(&seen.features_q16)?;
        let output = self.network.run(&self.model, &features, &self.tare);
        let forward = self.model.forward.as_ref().zip(self.resting.as_ref());
        let Some((forward, resting)) = forward else {
            return Ok(force::of_outputs(&self.model, &output));
        };
        let pairs = features.centroids.iter().zip(seen.areas_px);
        let markers = pairs.map(|((x, y), area)| Marker { x: *x, y: *y, area });
        let markers: Vec<Marker> = markers.collect();
        let noise = FrameNoise::AS_MODELLED;
        let estimate = resting.estimate(forward, &markers, noise, &output);
        Ok(resting.force_and_status(forward, &self.model.range, noise, &estimate))
    }
}
