//! Follows the sensor from one frame to the next: contact, slip and filter, and where the untouched
//! film rests.

use super::{Measurement, Sensor};
use crate::force::rest::Rest;
use crate::markers::tables::Table;
use crate::rezero::{RestChange, Tare};
use crate::temporal::{Followed, Moment};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::{TemporalError, TemporalSettings};
use hivtac_terms::units::{MilliPx, Px};

/// Frames with these bits do not show where the film rests. The markers need not be explained; but
/// those of the cleaned mask are not a rest position's.
const NOT_AT_REST: Status = Status(
    Status::NO_FORCE.0 & !Status::UNEXPLAINED.0 | Status::FRAME_DISTURBED.0 | Status::CONTACT.0,
);

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Follows the last finished frame, whose result is `measurement`, from those before it. If a
    /// second of the untouched film shows where it rests, that applies from the next frame on.
    pub fn follow(&mut self, at: Moment, measurement: &Measurement) -> Followed {
        let mut followed = self.temporal.follow(at, measurement);
        let Some(tare) = &mut self.tare else {
            return followed;
        };
        let may_rest = !followed.status.intersects(NOT_AT_REST);
        let features = measurement.features.as_ref().filter(|_| may_rest);
        followed.status |= tare.status();
        let rezero = self.temporal.settings().rezero.as_ref();
        let change = tare.follow(rezero, at.time_us, features);
        followed.tells_rest = change != RestChange::Nothing;
        match change {
            RestChange::Nothing => {}
            RestChange::Drift => self.apply_drift(),
            RestChange::Moved => self.prepare(),
        }
        followed
    }

    /// The settings by which forces are followed.
    pub fn temporal(&self) -> &TemporalSettings {
        self.temporal.settings()
    }

    /// Sets these, between two frames; contact, slip and filter restart.
    ///
    /// # Errors
    /// A setting out of its range; then nothing is changed.
    pub fn set_temporal(&mut self, settings: TemporalSettings) -> Result<(), TemporalError> {
        self.temporal.set(settings)?;
        if let Some(tare) = &mut self.tare {
            tare.begin_anew();
        }
        Ok(())
    }

    /// The rest position as it was taken, without re-zeroing.
    pub fn taken(&self) -> Option<&Rest> {
        self.tare.as_ref().map(Tare::taken)
    }

    /// The largest distance of a marker's coordinate from the rest position when the untouched film
    /// was last seen; `None` if it has not been seen.
    pub fn rest_seen(&self) -> Option<MilliPx> {
        self.tare.as_ref().and_then(Tare::seen)
    }

    /// The distance by which re-zeroing has moved the coordinate that it moved most.
    pub fn rezeroed(&self) -> Px {
        self.tare.as_ref().map_or(Px(0), Tare::farthest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::Drift;
    use crate::picture::sensor;
    use crate::temporal::tests::{frame, pressed, rest};
    use hivtac_terms::geometry::{Geometry, Preset};
    use hivtac_terms::temporal::Rezero;
    use hivtac_terms::units::Milliseconds;
    use std::boxed::Box;

    const GEOMETRY: Geometry = Geometry::preset(Preset::Ov7725, 320, 240);
    /// A tenth of a pixel.
    const TENTH: Px = Px(6_554);

    fn tared() -> Box<Sensor<'static>> {
        let mut sensor = sensor(GEOMETRY, None);
        sensor.set_tare(Some(rest(Px(0))), Drift::NONE);
        sensor
    }

    /// The moment of a frame at 156 frames a second.
    fn moment(frame: u32) -> Moment {
        let time_us = u64::from(frame) * 6_405;
        Moment { frame, time_us }
    }

    /// Frames that no force explains, of an untouched film that rests 0.1 px off the rest position.
    fn shows_drift(sensor: &mut Sensor<'_>) {
        let mut unexplained = frame(None, TENTH);
        unexplained.status |= Status::UNEXPLAINED;
        let reported =
            (0..200).map(|number| sensor.follow(moment(number), &unexplained).tells_rest);
        assert_eq!(reported.filter(|reported| *reported).count(), 1);
    }

    #[test]
    fn re_zeroing_can_be_off_and_is_reported_when_it_moved() {
        let at_rest = frame(Some(pressed(500, 100)), Px(3_000));
        let rezeroing = Rezero {
            after: Milliseconds(1_000),
            ..Rezero::default()
        };
        for rezero in [None, Some(rezeroing)] {
            let mut sensor = tared();
            let settings = TemporalSettings {
                rezero,
                ..TemporalSettings::default()
            };
            sensor.set_temporal(settings).unwrap();
            let last = (0..700).map(|number| sensor.follow(moment(number), &at_rest).status);
            let last = last.last().unwrap();
            assert_eq!(last.contains(Status::REZEROED), rezero.is_some());
            assert_eq!(sensor.taken(), Some(&rest(Px(0))), "as it was taken");
            assert_eq!(sensor.tare() != sensor.taken(), rezero.is_some());
            sensor.set_tare(Some(rest(Px(0))), Drift::NONE);
            let status = sensor.follow(moment(700), &at_rest).status;
            assert!(!status.contains(Status::REZEROED));
        }
    }

    /// No force explains the untouched frames, but they show the drift. Neither a press nor a new
    /// model discards it; a tare does.
    #[test]
    fn a_rest_that_moved_is_reported_until_the_next_tare() {
        let mut sensor = tared();
        assert_eq!(sensor.rest_seen(), None);
        shows_drift(&mut sensor);
        assert_eq!(sensor.rest_seen(), Some(MilliPx(100)));
        let pressed = frame(Some(pressed(100_000, 1_000)), Px::from_int(20));
        let moved = Status::REST_MOVED | Status::CONTACT;
        let followed = sensor.follow(moment(200), &pressed);
        assert!(followed.status.contains(moved));
        let drift = *sensor.tare.unwrap().drift();
        assert!((drift.farthest_px() - 0.1).abs() < 1e-3, "{drift:?}");
        let settings = *sensor.settings();
        sensor.reconfigure(settings, None).unwrap();
        assert_eq!(*sensor.tare.unwrap().drift(), drift);
        let followed = sensor.follow(moment(201), &pressed);
        assert!(followed.status.contains(moved));
        sensor.set_tare(Some(rest(TENTH)), Drift::NONE);
        let followed = sensor.follow(moment(202), &pressed);
        assert!(!followed.status.contains(Status::REST_MOVED));
    }

    /// The uncertainty of a kept rest position ends once the film was seen.
    #[test]
    fn what_was_seen_takes_the_place_of_what_nobody_saw() {
        let mut sensor = tared();
        sensor.set_tare(Some(rest(Px(0))), Drift::UNSEEN);
        shows_drift(&mut sensor);
        let drift = *sensor.tare.unwrap().drift();
        assert_eq!(drift.unseen, Drift::NONE.unseen);
        assert!((drift.farthest_px() - 0.1).abs() < 1e-3, "{drift:?}");
    }

    /// Markers that are found differently rest elsewhere, and a newly configured device has no rest
    /// position.
    #[test]
    fn a_rest_position_holds_for_frames_that_are_seen_as_before() {
        let mut sensor = tared();
        let mut settings = *sensor.settings();
        settings.dilations += 1;
        sensor.reconfigure(settings, None).unwrap();
        assert_eq!(sensor.tare(), None);
        sensor.set_tare(Some(rest(Px(0))), Drift::NONE);
        sensor.configure(settings, None).unwrap();
        assert_eq!(sensor.tare(), None);
        let followed = sensor.follow(moment(0), &frame(None, TENTH));
        assert!(!followed.tells_rest);
    }
}
