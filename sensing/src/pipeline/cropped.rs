//! Frames of which the camera interface passes only a rectangle: the one that holds the markers' windows.

use super::{Measurement, Sensor, ahead::Ahead};
use crate::{
    markers::Found,
    status::Status,
    tables::Table,
    windows::{Blobs, Rectangle, Tracks, is_whole, settings_within},
};

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Starts a frame of which only `window` comes ([`Tracks::rectangle`]); then its rows are pushed, and
    /// [`finish_cropped`](Self::finish_cropped) ends it.
    pub fn begin_cropped(&mut self, window: Rectangle) {
        let settings = settings_within(self.settings.scan(), &window);
        // A window of no size makes the frame incomplete.
        let _ = self.scanner.begin_at((window.x0, window.y0), settings);
        self.ahead = Ahead::Off;
    }

    /// Ends a frame that was begun with the same `window`.
    ///
    /// The result is that of the whole frame when each marker lies within the window with a column and a row to spare
    /// and nothing outside looks like one. Otherwise, or when a marker's area has jumped, there is no force
    /// ([`Status::FRAME_INCOMPLETE`], or what was wrong with the markers), and `tracks` wants a whole frame next.
    pub fn finish_cropped(&mut self, tracks: &mut Tracks, window: Rectangle) -> Measurement {
        let found = self.find_cropped(&window);
        let found = found.and_then(|found| match tracks.fit(&found.markers) {
            true => Ok(found),
            false => Err(Status::FRAME_INCOMPLETE),
        });
        let measurement = self.measurement(found);
        self.motion.ended(measurement.markers.as_ref());
        match self.to_follow(&measurement) {
            Some(markers) => tracks.tracked(markers),
            None => tracks.lost(),
        }
        measurement
    }

    fn find_cropped(&mut self, window: &Rectangle) -> Result<Found, Status> {
        let settings = self.settings.scan();
        let scan = self.scanner.finish(&self.pixels);
        if scan.status != Status::OK {
            return Err(scan.status);
        }
        let mut blobs = Blobs::new();
        for blob in scan.blobs {
            // What is cut lies outside of the markers' windows at least in part.
            if blob.area >= settings.min_area && is_whole(blob, window, &settings) {
                blobs.push(*blob).map_err(|_| Status::MARKERS_AMBIGUOUS)?;
            }
        }
        let prepared = self.prepared.as_ref();
        prepared.ok_or(Status::IMAGE_DARK)?.finder.find(&blobs)
    }
}
