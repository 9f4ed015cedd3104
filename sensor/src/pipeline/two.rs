//! Tells two contacts in a frame that one does not explain.
//!
//! This takes many times as long as a force: programs ask for it where they have the time. A frame
//! of two contacts stays [`Status::UNEXPLAINED`] for who does not ask.

use super::{Measurement, Sensor};
use crate::force::TwoContacts;
use crate::markers::tables::Table;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Returns the two needles that explain a measurement of this sensor which is
    /// [`Status::UNEXPLAINED`]. Returns `None` if two do not explain it either; if a marker is
    /// lost; if [what presses](Self::set_contact_shape) is not known to be a needle; or if two
    /// contacts on this layout are not known. Known is the layout `8v`.
    #[inline(never)]
    pub fn two_contacts(&self, measurement: &Measurement) -> Option<TwoContacts> {
        let is_asked =
            measurement.status.contains(Status::UNEXPLAINED) && measurement.lost.count() == 0;
        let features = measurement.features.filter(|_| is_asked)?;
        let model = self.model.as_ref()?;
        let resting = self.prepared.as_ref()?.resting.as_ref()?;
        // Where the markers are at one common time.
        let pairs = features.centroids.iter().zip(measurement.markers?);
        let markers = MarkerList::of(pairs.map(|((x, y), seen)| Marker {
            x: *x,
            y: *y,
            area: seen.area,
        }));
        let noise = self.noise.of_frame(Px(0));
        resting.two_contacts(model.forward.as_ref()?, &model.range, &markers, noise)
    }
}
