//! Looks a second time at a refused frame: specks or little light may be its only fault.
//!
//! If all rows of the frame are available once more, they are scanned with a mask that follows the
//! light and has its specks removed
//! ([`ScanSettings::cleaned`](crate::markers::scanner::ScanSettings)). The same rules judge the
//! result, and the contact must explain all coordinates of the markers, which are less certain. So
//! there is a second look only with a forward model. If the second look fails, the frame stays
//! refused for its first reason.
//!
//! A second look gives a false marker a second chance to pass, and larger uncertainties explain
//! more. So its result counts only if it also shows that specks or little light disturb the frame,
//! or if frames are [noisy](NoiseLevel). An object on the film, a reflection or several touches
//! alone are not enough.
//!
//! [NoiseLevel]: crate::force::NoiseLevel

use super::{Measurement, Sensor};
use crate::markers::scanner::{Scan, ScanSettings};
use crate::markers::tables::Table;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// Reasons for a second look.
const AGAIN: Status = Status(
    Status::MARKERS_MISSING.0
        | Status::MARKERS_AMBIGUOUS.0
        | Status::BLOB_OVERFLOW.0
        | Status::MARKERS_IMPLAUSIBLE.0
        | Status::IMAGE_SATURATED.0
        | Status::IMAGE_DARK.0
        | Status::MARKER_LOST.0
        | BADLY.0,
);
/// One contact does not explain the markers, or badly.
const BADLY: Status = Status(Status::UNEXPLAINED.0 | Status::LOOSELY_EXPLAINED.0);
/// Reasons for which no second look helps.
const NEVER: Status = Status(Status::NO_FORCE.0 & !AGAIN.0);
/// A frame has specks if at least one pixel in this many is removed from its mask: 32 at 320×240.
/// Seen: 62 or more with 0.1 % of salt; without salt at most 11, from the edges of markers.
const SPECKS_PART: u32 = 2_400;
/// More specks than one pixel in this many shift markers. Seen: 0.33 px at 5 % of salt, 0.24 px at
/// 3 %.
const MOST_SPECKS_PART: u32 = 40;
/// With more holes in markers than one in this many of the mask's pixels, the light is too weak for
/// colours. Seen: 0.013 of the pixels at 0.2 of the light, 0.049 and more at 0.15.
const HOLES_PART: u32 = 64;
/// A frame is dim if fewer pixels pass the threshold than this many fourths of the cleaned mask's
/// pixels. Seen: half at 0.28 of the light, more than all in good light.
const DIM_FOURTHS: u32 = 3;
/// Frames are noisy if their noise is at least this many times the modelled noise.
const NOISY: f32 = 2.0;
/// Standard uncertainty of a coordinate of a marker in the cleaned mask, in addition to noise: 0.08
/// px (largest seen: 0.05 px at a fifth of the light).
pub(super) const BLUR: Px = Px(5_243);

/// Which look at a frame is active, or was the last.
#[expect(clippy::large_enum_variant, reason = "nothing is allocated")]
#[derive(Clone, Debug)]
pub(super) enum Look {
    /// The first look; no second one is wanted.
    First,
    /// The first look gave this measurement, and a second one may give more.
    Wanted(Measurement),
    /// The second look, with the cleaned mask.
    Again,
}

/// A second look that is active, with the result of the first one: [`Sensor::finish_again`] ends
/// it.
#[derive(Debug)]
#[must_use]
pub struct Again {
    measurement: Measurement,
    /// Number of pixels that passed the threshold in the first look.
    set_pixels: u32,
}

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Begins a second look at the last finished frame. Push all rows of the frame again, then call
    /// [`finish_again`](Self::finish_again). Returns `None` if a second look cannot give a force.
    #[inline(never)]
    pub fn look_again(&mut self) -> Option<Again> {
        let Look::Wanted(measurement) = self.look else {
            return None;
        };
        let again = Again {
            measurement,
            set_pixels: self.scanner.finish(&self.pixels).set_pixels,
        };
        self.look = Look::Again;
        let settings = ScanSettings {
            cleaned: true,
            ..self.settings.scan()
        };
        self.scanner.begin(settings).ok().map(|()| again)
    }

    /// Returns whether the first look calls for a second one.
    pub(super) fn wants_again(&self, measurement: &Measurement) -> bool {
        let status = measurement.status;
        let resting = self.prepared.as_ref().map(|prepared| &prepared.resting);
        // The force goes on without a marker as long as others check it.
        let goes_on = self.has_other_layout() && measurement.force.is_some();
        let before = self.prepared.as_ref().map(|prepared| &prepared.before);
        let is_like_before = status.contains(Status::UNEXPLAINED)
            && self.has_other_layout()
            && before.is_some_and(|before| !before.may_be_disturbed());
        status.intersects(AGAIN)
            && !status.intersects(NEVER)
            && matches!(resting, Some(Some(_)))
            && !goes_on
            && !is_like_before
    }

    /// Ends a second look. Returns its measurement if that has a force, otherwise the first one.
    #[inline(never)]
    pub fn finish_again(&mut self, again: Again) -> Measurement {
        // To measure once more takes as long as the rest of the frame.
        let is_known = self.has_other_layout() && again.measurement.markers.is_some();
        let is_disturbed = is_known && self.is_disturbed(&again);
        if let Some(prepared) = self.prepared.as_mut() {
            prepared.before.is_disturbed = is_disturbed;
        }
        if is_known && !is_disturbed {
            return again.measurement;
        }
        let mut second = match self.end_scan() {
            Ok(()) => self.measure_blobs(),
            Err(reason) => self.measurement(Err(reason)),
        };
        let counts = second.force.is_some() && self.is_disturbed(&again);
        // The markers' positions show their motion to the next frame, even without a force. If that
        // has seen them at the first look, it does not depend on whether there was time for this.
        if second.markers.is_some() && (counts || again.measurement.markers.is_none()) {
            let seen = second.markers.as_ref();
            self.motion.ended(seen.map(|seen| (seen, second.lost)));
        }
        if !counts {
            return again.measurement;
        }
        second.status |= Status::FRAME_DISTURBED;
        second
    }

    /// Whether removable specks, little light or noise are why the first look gave no force.
    fn is_disturbed(&mut self, first: &Again) -> bool {
        let Geometry { width, height, .. } = self.settings.geometry;
        let pixels = u32::from(width) * u32::from(height);
        let Scan {
            set_pixels,
            specks,
            holes,
            ..
        } = self.scanner.finish(&self.pixels);
        let status = first.measurement.status;
        let has_specks = specks >= pixels / SPECKS_PART;
        let is_dim = 4 * first.set_pixels < DIM_FOURTHS * set_pixels
            && !status.contains(Status::BLOB_OVERFLOW);
        let is_noisy = self.noise.variance_of_frames() >= NOISY * NOISY;
        (has_specks || (is_dim || is_noisy) && !status.intersects(BADLY))
            && specks <= pixels / MOST_SPECKS_PART
            && holes <= set_pixels / HOLES_PART
    }
}
