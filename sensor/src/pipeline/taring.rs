//! Feeds measured frames to a tare.

use super::{Look, Measurement, Sensor};
use crate::force::rest::Rest;
use crate::force::{Resting, is_force};
use crate::markers::tables::Table;
use crate::tare::{Refusal, TareBuilder};
use hivtac_terms::status::Status;
use hivtac_terms::units::MicroNewtons;

/// A press of at least this that explains a change of the rest position is a touch: 0.3 mN.
const TOUCHED: MicroNewtons = MicroNewtons(300);
/// The same for a unit without any other knowledge: its gluing may look like a smaller press.
/// Seen in 1,500 untouched units: at most 2.8 mN.
const TOUCHED_OF_UNIT: MicroNewtons = MicroNewtons(4_000);
/// The same if gravity pulled differently then. The effect of that is known to a few tenths: 1 mN.
const TOUCHED_AND_TURNED: MicroNewtons = MicroNewtons(1_000);

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Adds the last finished frame, whose result is `measurement`, to a tare. A frame without
    /// markers is skipped. Once enough good frames were added, returns the rest position, which is
    /// not yet [set](Sensor::set_tare), or why it is refused; otherwise `None`.
    pub fn tare_with(
        &self,
        tare: &mut TareBuilder,
        measurement: &Measurement,
    ) -> Option<Result<Rest, Refusal>> {
        // The blobs of a second look are not a rest position's.
        if matches!(self.look, Look::Again) {
            return None;
        }
        let markers = measurement.markers.as_ref()?;
        let features = measurement.features.as_ref()?;
        let may_rest = self.may_rest()?;
        let geometry = &self.settings.geometry;
        // Relative to the model's rest position every unit looks touched.
        let is_touched = self.tare.is_some() && measurement.status.contains(Status::CONTACT);
        if is_touched && !tare.is_forced() {
            let touch = measurement.force.map(|force| force.magnitude);
            return tare.add_touched(touch.unwrap_or_default()).map(Err);
        }
        // The images of a pressed film differ from those of a flat one; the press is the reason to
        // report.
        let is_pressed = !Rest::of_markers(markers).fits(geometry);
        if !is_pressed && !may_rest {
            return tare.add_implausible().map(Err);
        }
        let outcome = tare.add(markers, features, geometry)?;
        let touch = |rest: &Rest| self.touch(rest).filter(|_| !tare.is_forced());
        Some(outcome.and_then(|rest| match touch(&rest) {
            None => Ok(rest),
            Some(touch) => Err(Refusal::Touched(touch)),
        }))
    }

    /// Returns whether the last finished frame shows whole markers of a film at rest; `None` if it
    /// shows no markers.
    fn may_rest(&self) -> Option<bool> {
        let prepared = self.prepared.as_ref()?;
        match prepared.other_layout() {
            Some(rest) => Some(self.place_markers().ok()?.may_rest(&rest.markers())),
            None => Some(self.find_markers().ok()?.may_rest(&self.settings)),
        }
    }

    /// Returns the press that explains how the markers moved since the previous rest position, or
    /// since this unit's calibration. Without either it is compared with the model's, where gluing
    /// must not explain it. Returns `None` if there was no touch.
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
