//! The frame that was measured, as one of those that make a rest position.

use super::{Look, Measurement, Sensor};
use crate::force::rest::Rest;
use crate::force::{Resting, is_force};
use crate::markers::tables::Table;
use crate::tare::{Refusal, TareBuilder};
use hivtac_terms::status::Status;
use hivtac_terms::units::MicroNewtons;

/// A change of the rest position that a press of this much explains is a touch: 0.3 mN.
const TOUCHED: MicroNewtons = MicroNewtons(300);
/// The same of a unit of which nothing else is known: its markers may be glued as if by less. Seen
/// of an untouched one in none of 1,500: 2.8 mN at most.
const TOUCHED_OF_UNIT: MicroNewtons = MicroNewtons(4_000);
/// The same when gravity pulled otherwise then, which is known to some tenths of that: 1 mN.
const TOUCHED_AND_TURNED: MicroNewtons = MicroNewtons(1_000);

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
        if matches!(self.look, Look::Again) {
            return None;
        }
        let markers = measurement.markers.as_ref()?;
        let features = measurement.features.as_ref()?;
        let found = self.find_markers().ok()?;
        let geometry = &self.settings.geometry;
        // Against the model's rest position every unit is touched.
        let is_touched = self.tare.is_some() && measurement.status.contains(Status::CONTACT);
        if is_touched && !tare.insists() {
            let touch = measurement.force.map(|force| force.magnitude);
            return tare.add_touched(touch.unwrap_or_default()).map(Err);
        }
        // The images of a pressed film are not those of a flat one; that it is pressed matters.
        let is_pressed = !Rest::of_markers(&found.markers).fits(geometry);
        if !is_pressed && !found.may_rest(&self.settings) {
            return tare.add_implausible().map(Err);
        }
        let outcome = tare.add(markers, features, geometry)?;
        let touch = |rest: &Rest| self.touch(rest).filter(|_| !tare.insists());
        Some(outcome.and_then(|rest| match touch(&rest) {
            None => Ok(rest),
            Some(touch) => Err(Refusal::Touched(touch)),
        }))
    }

    /// The press that explains how the markers moved since the rest position from before, or since
    /// the calibration of this unit; without either, beside the model's, where no gluing does.
    fn touch(&self, rest: &Rest) -> Option<MicroNewtons> {
        let model = self.fitting_model()?;
        let (of_model, turned) = (self.rest_of_model()?, self.turned());
        let own = (!model.is_simulated()).then_some(&of_model);
        let (touch, is_touch) = match self.tare().or(own) {
            Some(before) => {
                let (magnitude, by_noise) = Resting::touch(model, before, turned, rest)?;
                let least = turned.map_or(TOUCHED, |_| TOUCHED_AND_TURNED);
                (magnitude, is_force(magnitude, by_noise, least))
            }
            None => {
                let (magnitude, _) = Resting::touch_of_unit(model, &of_model, turned, rest)?;
                (magnitude, magnitude >= TOUCHED_OF_UNIT)
            }
        };
        is_touch.then_some(touch)
    }
}
