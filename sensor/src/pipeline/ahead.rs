//! Computes the force ahead, while the camera still sends the rows below the markers.
//!
//! Once as many blobs as markers are complete and no blob is open, their measurement is computed.
//! If no other blob follows until the frame ends, it is the frame's measurement, and only that
//! check is left after the last row. Otherwise it is computed anew. The measurement depends on the
//! blobs alone.

use super::{Measurement, Prepared, Sensor};
use crate::markers::tables::Table;

/// With more blobs in addition to the markers, nothing is computed ahead, which bounds the wasted
/// work.
const MOST_BESIDE: usize = 4;

/// The result of computing ahead.
#[expect(clippy::large_enum_variant, reason = "nothing is allocated")]
#[derive(Clone, Copy, Debug)]
pub(super) enum Ahead {
    /// Computing ahead is disabled.
    Off,
    /// No result yet.
    Nothing,
    /// The measurement of the frame's first `blobs` blobs.
    Worked {
        blobs: usize,
        measurement: Measurement,
    },
}

impl Ahead {
    /// Returns the measurement if the frame has exactly `count` blobs, otherwise `None`.
    pub fn measurement(&self, count: usize) -> Option<Measurement> {
        match self {
            Ahead::Worked { blobs, measurement } if *blobs == count => Some(*measurement),
            _ => None,
        }
    }

    /// Whether `count` complete blobs are worth computing, of a film with this many markers.
    #[inline(always)]
    fn wants(&self, count: usize, markers: usize) -> bool {
        let in_vain = match self {
            Ahead::Off => true,
            Ahead::Nothing => false,
            Ahead::Worked { blobs, .. } => *blobs == count,
        };
        (markers..=markers + MOST_BESIDE).contains(&count) && !in_vain
    }
}

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Call after each row or band.
    #[inline(always)]
    pub(super) fn look_ahead(&mut self) {
        if self.scanner.is_settled() {
            let markers = self.prepared.as_ref().map_or(0, Prepared::markers);
            if self.ahead.wants(self.scanner.blobs().len(), markers) {
                self.work_ahead();
            }
        }
    }

    #[inline(never)]
    fn work_ahead(&mut self) {
        let blobs = self.scanner.blobs().len();
        let measurement = self.measure_blobs();
        self.ahead = Ahead::Worked { blobs, measurement };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::Drift;
    use crate::picture::{Pattern, Picture, RED, tared};
    use hivtac_terms::geometry::{Geometry, Preset};
    use proptest::prelude::*;

    const GEOMETRY: Geometry = Geometry::preset(Preset::Ov7725, 160, 120);

    /// Pushes all rows at once: only the whole frame can have been computed ahead.
    fn fed_at_once(sensor: &mut Sensor<'_>, picture: &Picture) -> Measurement {
        sensor.begin_frame();
        sensor.push_rows(&picture.pixels);
        sensor.ahead = Ahead::Off;
        sensor.finish_frame()
    }

    #[test]
    fn nothing_is_left_to_work_out_after_the_last_band() {
        let mut sensor = tared(GEOMETRY);
        let picture = Pattern::at_rest(GEOMETRY).draw();
        let expected = fed_at_once(&mut sensor, &picture);
        let width = usize::from(GEOMETRY.width);
        let (bands, last) = picture.pixels.split_at(116 * width);
        sensor.begin_frame();
        sensor.push_rows(bands);
        let ahead = sensor.ahead.measurement(4);
        assert_eq!(ahead, Some(expected), "the markers lie above");
        sensor.push_rows(last);
        assert_eq!(sensor.finish_frame(), expected);
    }

    #[test]
    fn a_frame_that_is_cut_short_or_set_otherwise_has_no_force_from_before() {
        let mut sensor = tared(GEOMETRY);
        let picture = Pattern::at_rest(GEOMETRY).draw();
        let expected = fed_at_once(&mut sensor, &picture);
        let width = usize::from(GEOMETRY.width);
        sensor.begin_frame();
        sensor.push_rows(&picture.pixels[..116 * width]);
        let cut = sensor.finish_frame();
        assert_eq!(cut.markers, None, "{:?}", cut.status);
        sensor.begin_frame();
        sensor.push_rows(&picture.pixels);
        sensor.set_tare(None, Drift::NONE);
        let untared = sensor.finish_frame();
        assert_ne!(untared.status, expected.status);
        assert_eq!(untared.markers, expected.markers);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Discs anywhere, including ones that end in the last rows or come after the markers.
        #[test]
        fn every_frame_is_measured_as_if_it_had_come_at_once(
            discs in prop::collection::vec((0.0..160.0f64, 0.0..120.0f64, 1.0..14.0f64), 0..5),
            band in 1..9usize,
        ) {
            let mut sensor = tared(GEOMETRY);
            let mut picture = Pattern::at_rest(GEOMETRY).draw();
            for (x, y, diameter) in discs {
                picture.disc(RED, (x, y), diameter);
            }
            let expected = fed_at_once(&mut sensor, &picture);
            sensor.begin_frame();
            for rows in picture.pixels.chunks(band * usize::from(GEOMETRY.width)) {
                sensor.push_rows(rows);
            }
            prop_assert_eq!(sensor.finish_frame(), expected);
        }
    }
}
