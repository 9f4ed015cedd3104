//! The frame that was measured, as one of those that make a rest position.

use super::{Measurement, Sensor};
use crate::tare::{Refusal, TareBuilder};
use hivtac_force::rest::Rest;
use hivtac_markers::tables::Table;

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Gives a tare the frame that was finished last, of which `measurement` is. A frame without
    /// markers is passed over. Gives the rest position, which is not yet
    /// [set](Sensor::set_tare), once there were enough good frames, or why there is none.
    #[inline(never)]
    pub fn tare_with(
        &self,
        tare: &mut TareBuilder,
        measurement: &Measurement,
    ) -> Option<Result<Rest, Refusal>> {
        if self.again.is_looking() {
            // The blobs are no longer those of the first look.
            return None;
        }
        let markers = measurement.markers.as_ref()?;
        let features = measurement.features.as_ref()?;
        let found = self.find_markers().ok()?;
        let geometry = &self.settings.geometry;
        // The images of a pressed film are not those of a flat one; that it is pressed matters.
        let is_pressed = !Rest::of_markers(&found.markers).fits(geometry);
        if is_pressed || found.may_rest(&self.settings) {
            tare.add(markers, features, geometry)
        } else {
            tare.add_implausible().map(Err)
        }
    }
}
