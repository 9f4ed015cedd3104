//! Frames that lie in memory as a whole: coarse scan, then windows; or windows that follow the markers.

use super::{Measurement, Sensor};
use crate::{
    markers::{Found, Marker},
    status::Status,
    tables::Table,
    windows::{Blobs, Frame, Tracks, coarse_blobs},
};

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Measures a frame: all rows from the top, one after the other. Every n-th row is looked at, then windows
    /// around what it shows, and in doubt everything.
    ///
    /// The result is that of the full scan ([`push_rows`](Self::push_rows)) when each marker is at least n + 2 rows high
    /// (n = 4 at 800 × 600 and at 320 × 240) and no speck of less height touches one; and when this finds no markers.
    pub fn measure_frame(&mut self, frame: &[u16]) -> Measurement {
        match self.find_coarsely(frame) {
            Some(found) => {
                let measurement = self.measurement(Ok(found));
                self.motion.ended(measurement.markers.as_ref());
                measurement
            }
            None => self.measure_all(frame),
        }
    }

    /// Measures a frame likewise, but looks first where the markers were in the frame before.
    ///
    /// The result is that of the full scan when each marker lies within its window and nothing outside looks like one.
    pub fn measure_tracked(&mut self, tracks: &mut Tracks, frame: &[u16]) -> Measurement {
        if let Some(found) = self.find_tracked(tracks, frame) {
            let measurement = self.measurement(Ok(found));
            if let Some(markers) = self.to_follow(&measurement) {
                tracks.tracked(markers);
                self.motion.ended(Some(markers));
                return measurement;
            }
        }
        let measurement = self.measure_frame(frame);
        tracks.measured_whole(measurement.markers.as_ref());
        measurement
    }

    /// The markers of a frame that may be followed into the next: found and, with a model, good for a force.
    pub(super) fn to_follow<'r>(&self, measured: &'r Measurement) -> Option<&'r [Marker; 4]> {
        let doubtful = self.model.is_some() && measured.status.intersects(Status::NO_FORCE);
        measured.markers.as_ref().filter(|_| !doubtful)
    }

    /// The table, for what tests count in it.
    #[cfg(test)]
    pub(crate) fn table(&self) -> &T {
        self.pixels.table()
    }

    fn measure_all(&mut self, frame: &[u16]) -> Measurement {
        self.begin_frame();
        self.push_rows(frame);
        self.finish_frame()
    }

    fn find_coarsely(&mut self, frame: &[u16]) -> Option<Found> {
        let frame = Frame::new(&self.pixels, frame, self.settings.scan())?;
        let step = self.prepared.as_ref()?.coarse_step;
        let mut blobs = Blobs::new();
        coarse_blobs(&mut self.scanner, &frame, step, &mut blobs)?;
        self.markers_among(&blobs)
    }

    fn find_tracked(&mut self, tracks: &Tracks, frame: &[u16]) -> Option<Found> {
        let frame = Frame::new(&self.pixels, frame, self.settings.scan())?;
        let mut blobs = Blobs::new();
        tracks.blobs(&mut self.scanner, &frame, &mut blobs)?;
        let found = self.markers_among(&blobs)?;
        tracks.fit(&found.markers).then_some(found)
    }

    fn markers_among(&self, blobs: &Blobs) -> Option<Found> {
        self.prepared.as_ref()?.finder.find(blobs).ok()
    }
}
