//! The frame that was measured, as one of those that make a rest position.

use super::{Look, Measurement, Sensor};
use crate::tare::{Refusal, TareBuilder};
use hivtac_force::force::{Resting, is_force};
use hivtac_force::rest::Rest;
use hivtac_markers::tables::Table;
use hivtac_terms::status::Status;
use hivtac_terms::units::MicroNewtons;

/// A change of the rest position that a press of this much explains is a touch: 0.3 mN.
const TOUCHED: MicroNewtons = MicroNewtons(300);

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Gives a tare the frame that was finished last, of which `measurement` is. A frame without
    /// markers is passed over. Gives the rest position, which is not yet
    /// [set](Sensor::set_tare), once there were enough good frames, or why there is none.
    pub fn tare_with(
        &self,
        tare: &mut TareBuilder,
        measurement: &Measurement,
    ) -> Option<Result<Rest, Refusal>> {
        // The blobs of another look are no rest position's.
        if matches!(self.look, Look::Again(..)) {
            return None;
        }
        let markers = measurement.markers.as_ref()?;
        let features = measurement.features.as_ref()?;
        let found = self.find_markers().ok()?;
        let geometry = &self.settings.geometry;
        // Against the model's rest position every unit is touched.
        let is_touched = self.tare.is_some() && measurement.status.contains(Status::CONTACT);
        if is_touched && !tare.insists() {
            return tare.add_touched().map(Err);
        }
        // The images of a pressed film are not those of a flat one; that it is pressed matters.
        let is_pressed = !Rest::of_markers(&found.markers).fits(geometry);
        if !is_pressed && !found.may_rest(&self.settings) {
            return tare.add_implausible().map(Err);
        }
        let outcome = tare.add(markers, features, geometry)?;
        Some(
            outcome.and_then(|rest| match tare.insists() || !self.looks_touched(&rest) {
                true => Ok(rest),
                false => Err(Refusal::Touched),
            }),
        )
    }

    /// Whether a press explains how the markers moved since the rest position from before, or since
    /// the calibration of this unit.
    fn looks_touched(&self, rest: &Rest) -> bool {
        let Some(model) = self.fitting_model() else {
            return false;
        };
        let own = (!model.is_simulated()).then_some(&model.rest);
        let before = self.tare().or(own);
        let touch = before.and_then(|before| Resting::touch(model, before, rest));
        touch.is_some_and(|(magnitude, by_noise)| is_force(magnitude, by_noise, TOUCHED))
    }
}
