//! Measures a frame in which one marker is not seen: covered, in glare, out of the picture, or
//! peeled off.
//!
//! Three markers have six coordinates, a contact has five unknowns. One redundant coordinate is
//! left, which hardly shows a displaced second marker. So such a force has [`Status::MARKER_LOST`].
//! Its measurement has neither markers nor features, so tare, re-zeroing and noise level do not use
//! it.
//!
//! It needs a forward model, and a rest position of this unit, which identifies the three. A frame
//! that three markers do not explain stays refused for its first reason, as does a contact near the
//! lost marker: the others hardly see it.

use super::{Measurement, Sensor, at_the_middle};
use crate::markers::lost::Lost;
use crate::markers::tables::Table;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::MarkerList;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// Reasons for which a marker is left out.
const REASONS: Status = Status(Status::MARKERS_MISSING.0 | Status::MARKERS_IMPLAUSIBLE.0);

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Replaces the measurement of the last finished frame if three of its markers give a force.
    pub(super) fn complete(&mut self, measurement: &mut Measurement) {
        if measurement.status.intersects(REASONS)
            && !self.has_other_layout()
            && let Some(completed) = self.measure_three(measurement.status)
        {
            *measurement = completed;
        }
    }

    /// Returns the measurement by three markers of the last finished frame, which was refused with
    /// `status`; `None` if they give no force. Not inlined, so that it stays out of the near
    /// memory.
    #[inline(never)]
    fn measure_three(&mut self, status: Status) -> Option<Measurement> {
        let mut status = Status(status.0 & !REASONS.0);
        if status.intersects(Status::NO_FORCE) {
            return None;
        }
        let rest = self.tare.as_ref()?.rest().markers().array();
        let model = self.model.as_ref()?;
        let forward = model.forward.as_ref()?;
        let prepared = self.prepared.as_ref()?;
        let (resting, trust) = prepared.resting.as_ref().zip(prepared.trust.as_ref())?;
        let three = prepared
            .finder
            .find_three(self.scanner.blobs(), &rest, trust)?;
        let (seen, lost) = (&three.markers, three.lost);
        let (seen, lost_one) = (MarkerList::from(*seen), Lost::only(lost));
        let rows = self.settings.geometry.height;
        self.noise.set_beside(three.shift_px2());
        let moved = at_the_middle(&self.motion, &mut self.noise, &seen, lost_one, rows);
        let mut markers = moved.unwrap_or(seen);
        let noise = self.noise.of_frame(Px(0));
        let (estimate, at) = resting.estimate_of_three(forward, &markers, lost, noise);
        let marker = markers.get_mut(lost)?;
        (marker.x, marker.y) = at;
        status |= prepared.finder.judge_three(&three, trust, &markers.array());
        let (force, found) = resting.force_and_status(forward, &model.range, noise, &estimate);
        status |= found | Status::MARKER_LOST;
        let is_touched = found.contains(Status::CONTACT);
        let is_known = !is_touched || forward.is_far_from(lost, &estimate);
        let is_explained = is_known && estimate.is_explained_by_three(is_touched);
        if !is_explained || status.intersects(Status::NO_FORCE) {
            return None;
        }
        self.motion.ended(Some((&seen, lost_one)));
        Some(Measurement {
            status,
            markers: None,
            lost: Lost::NONE,
            features: None,
            force: Some(force),
            contacts: ContactList::default(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::markers::rules::Three;
    use crate::picture::{Pattern, Picture, RED, tared};
    use hivtac_terms::geometry::{Geometry, Preset};

    const GEOMETRY: Geometry = Geometry::preset(Preset::Ov7725, 320, 240);

    /// A pressed film's markers but those in `gone`.
    fn picture(gone: &[usize]) -> (Pattern, Picture) {
        let pattern = Pattern {
            shift: (6.0, -4.0),
            scale: 1.2,
            ..Pattern::at_rest(GEOMETRY)
        };
        let mut picture = Picture::new(&GEOMETRY);
        let seen = (0..4).filter(|identity| !gone.contains(identity));
        seen.for_each(|identity| pattern.draw_marker(&mut picture, identity));
        (pattern, picture)
    }

    fn found(picture: &Picture) -> Option<Three> {
        let mut sensor = tared(GEOMETRY);
        let seen = picture.feed(&mut sensor);
        assert!(seen.status.intersects(REASONS), "{:?}", seen.status);
        let rest = sensor.tare.as_ref().unwrap().rest().markers().array();
        let prepared = sensor.prepared.as_ref().unwrap();
        let trust = prepared.trust.as_ref().unwrap();
        let blobs = sensor.scanner.blobs();
        prepared.finder.find_three(blobs, &rest, trust)
    }

    #[test]
    fn three_markers_are_known_by_where_they_rest() {
        for lost in 0..4 {
            let (pattern, picture) = picture(&[lost]);
            let three = found(&picture).unwrap();
            assert_eq!(three.lost, lost);
            for identity in (0..4).filter(|identity| *identity != lost) {
                let (x, y) = pattern.center_of(identity);
                let marker = three.markers[identity];
                let off = (marker.x.to_f64() - x).hypot(marker.y.to_f64() - y);
                assert!(off < 0.5, "{identity}: {off}");
            }
        }
    }

    /// Nor three discs, if two are nearest to the same rest place.
    #[test]
    fn two_markers_are_too_few() {
        let (pattern, mut picture) = picture(&[0, 1]);
        assert_eq!(found(&picture), None);
        let (x, y) = pattern.center_of(2);
        picture.disc(RED, (x - 40.0, y), 14.0);
        assert_eq!(found(&picture), None);
    }

    /// Of four markers, the one with something grown on its side.
    #[test]
    fn the_only_faulty_marker_of_four_is_left_out() {
        for faulty in 0..4 {
            let (pattern, mut picture) = picture(&[]);
            let (x, y) = pattern.center_of(faulty);
            picture.disc(RED, (x + 5.0, y), 13.0);
            assert_eq!(found(&picture).map(|three| three.lost), Some(faulty));
            let (x, y) = pattern.center_of((faulty + 1) % 4);
            picture.disc(RED, (x + 5.0, y), 13.0);
            assert_eq!(found(&picture), None, "two are faulty");
        }
    }
}
