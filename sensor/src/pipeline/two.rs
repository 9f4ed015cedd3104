//! Resolves two contacts in a frame that one does not explain.
//!
//! Finding them takes many times as long as a force. A device does it in parts, over some frames,
//! and then follows them with one step a frame.

use super::again::Look;
use super::{Measurement, Prepared, Sensor};
pub use crate::force::forward::pair::Work;
use crate::force::model::Model;
use crate::force::{Means, NoiseLevel, Pairs, TwoContacts};
use crate::markers::tables::Table;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Returns the two needles that explain a measurement of this sensor which is
    /// [`Status::UNEXPLAINED`]. Returns `None` if two do not explain it either, a marker is lost,
    /// the [contact](Self::set_contact_shape) is not known to be a needle, or the layout is not
    /// `8v`.
    pub fn two_contacts(&self, measurement: &Measurement) -> Option<TwoContacts> {
        let seen = Seen {
            model: self.model.as_ref()?,
            prepared: self.prepared.as_ref()?,
            noise: &self.noise,
        };
        seen.two_contacts(measurement, &mut { Pairs::NONE }, Work::ALL)
    }

    /// Call after each frame, before [`look_again`](Self::look_again). Makes the measurement that
    /// of [two contacts](Self::two_contacts), if two explain it; then there is no second look. They
    /// are followed from those of the frame before. Until they are found, for 29 to 77 steps, the
    /// measurement stays as it is.
    pub fn follow_two_contacts(&mut self, measurement: &mut Measurement, work: Work) {
        if !is_asked(measurement) {
            self.pairs.miss();
            return;
        }
        let Some((model, prepared)) = self.model.as_ref().zip(self.prepared.as_ref()) else {
            return;
        };
        let seen = Seen {
            model,
            prepared,
            noise: &self.noise,
        };
        if let Some(two) = seen.two_contacts(measurement, &mut self.pairs, work) {
            measurement.tell(&two);
            self.look = Look::First;
        }
    }
}

/// The settings for a measurement.
struct Seen<'a, 'm> {
    model: &'a Model<'m>,
    prepared: &'a Prepared,
    noise: &'a NoiseLevel,
}

impl Seen<'_, '_> {
    #[inline(never)]
    fn two_contacts(
        &self,
        measurement: &Measurement,
        pairs: &mut Pairs,
        work: Work,
    ) -> Option<TwoContacts> {
        let features = measurement.features.filter(|_| is_asked(measurement))?;
        let (model, prepared) = (self.model, self.prepared);
        let resting = prepared.resting.as_ref()?;
        // Where the markers are at one common time.
        let seen = features.centroids.iter().zip(measurement.markers?);
        let markers = MarkerList::of(seen.map(|((x, y), seen)| Marker {
            x: *x,
            y: *y,
            area: seen.area,
        }));
        let noise = self.noise.of_frame(Px(0));
        let is_free = pairs.are_followed() || !prepared.before.tried_more();
        let means = Means {
            work: match is_free || work == Work::ALL {
                true => work,
                false => Work(0),
            },
            one: prepared.before.refused(),
        };
        let by = (pairs, means);
        resting.follow_two_contacts(model.forward.as_ref()?, &model.range, &markers, noise, by)
    }
}

/// Whether two contacts may explain a measurement: one does not, and no marker is lost.
fn is_asked(measurement: &Measurement) -> bool {
    measurement.status.contains(Status::UNEXPLAINED) && measurement.lost.count() == 0
}

impl Measurement {
    /// Makes this the measurement of two contacts.
    pub fn tell(&mut self, two: &TwoContacts) {
        let of_one = Status::UNEXPLAINED
            | Status::DIRECTION_UNRELIABLE
            | Status::DIRECTION_OUT_OF_RANGE
            | Status::MAGNITUDE_OUT_OF_RANGE
            | Status::PLACE_OUT_OF_RANGE
            | Status::CONTACT;
        self.status = Status(self.status.0 & !of_one.0) | two.status | Status::TWO_CONTACTS;
        self.force = Some(two.sum);
        self.contacts = two
            .each
            .map_or_else(ContactList::default, ContactList::from);
    }
}
