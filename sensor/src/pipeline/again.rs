//! Looking again: a frame that is refused may be disturbed by no more than specks or little light,
//! and show its markers all the same.
//!
//! A frame of which all rows can be had once more is then looked at by a mask that follows the
//! light and has its specks taken out
//! ([`ScanSettings::cleaned`](crate::markers::scanner::ScanSettings)). The same rules judge what it
//! shows, and the contact must explain all eight coordinates of markers that are known less well:
//! without a film run forwards there is no second look. What is not plain then stays refused, for
//! the reason that it had at first.
//!
//! A false marker has another chance to pass by that, and larger uncertainties explain more. So
//! what the second look shows counts only where it shows, too, that specks or little light disturb
//! the frame, or where frames are [noisy](NoiseLevel); a thing on the film, a reflection or several
//! touches alone do not.
//!
//! [NoiseLevel]: crate::force::NoiseLevel

use super::{Measurement, Sensor};
use crate::markers::scanner::{Scan, ScanSettings};
use crate::markers::tables::Table;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// Reasons for which a frame is looked at again.
const AGAIN: Status = Status(
    Status::MARKERS_MISSING.0
        | Status::MARKERS_AMBIGUOUS.0
        | Status::BLOB_OVERFLOW.0
        | Status::MARKERS_IMPLAUSIBLE.0
        | Status::IMAGE_SATURATED.0
        | Status::IMAGE_DARK.0
        | Status::UNEXPLAINED.0,
);
/// Reasons for which no look helps.
const NEVER: Status = Status(Status::NO_FORCE.0 & !AGAIN.0);
/// A frame has specks when so many pixels are taken out of its mask, one in this many, at 320×240
/// 32 (seen: 62 or more with 0.1 % of salt, 11 at most without, off the edges of markers).
const SPECKS_PART: u32 = 2_400;
/// More specks than one in this many draw markers aside (seen: 0.33 px at 5 % of salt, 0.24 px at
/// 3 %).
const MOST_SPECKS_PART: u32 = 40;
/// So do holes in markers, more than one in this many of the mask's pixels: the light is too little
/// for colours (seen: 0.013 of them at 0.2 of the light, 0.049 and more at 0.15).
const HOLES_PART: u32 = 64;
/// A frame is dim when fewer pixels pass the threshold than so many of four of the cleaned mask's
/// (seen: half at 0.28 of the light, more than all in good light).
const DIM_FOURTHS: u32 = 3;
/// Frames are noisy when their noise is so many times as large as modelled.
const NOISY: f32 = 2.0;
/// Standard uncertainty of a coordinate of a marker of the cleaned mask beside that of noise:
/// 0.08 px (seen: 0.05 px at a fifth of the light).
pub(super) const BLUR: Px = Px(5_243);

/// Which look at a frame is under way, or was the last.
#[derive(Clone, Debug)]
pub(super) enum Look {
    /// The usual one, after which none is wanted.
    First,
    /// The usual one; it gave this, and another may give more.
    Wanted(Measurement),
    /// By the cleaned mask.
    Again,
}

/// Another look under way, with what the first one gave: [`Sensor::finish_again`] ends it.
#[derive(Debug)]
#[must_use]
pub struct Again {
    measurement: Measurement,
    /// Pixels that passed the threshold.
    set_pixels: u32,
}

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Begins another look at the frame that was finished last, if it may give a force: push all
    /// rows of the frame again, and [finish](Self::finish_again) it.
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

    /// Whether what the first look gave calls for another.
    pub(super) fn wants_again(&self, measurement: &Measurement) -> bool {
        let status = measurement.status;
        let resting = self.prepared.as_ref().map(|prepared| &prepared.resting);
        status.intersects(AGAIN) && !status.intersects(NEVER) && matches!(resting, Some(Some(_)))
    }

    /// Ends another look: gives what it gave when that is a force, or else what the first one did.
    #[inline(never)]
    pub fn finish_again(&mut self, again: Again) -> Measurement {
        let found = self.end_scan().and_then(|()| self.find_markers());
        let mut second = self.measurement(found);
        // Where markers are tells the next frame how they move, even without a force.
        if second.markers.is_some() {
            self.motion.ended(second.markers.as_ref());
        }
        if second.force.is_none() || !self.is_disturbed(&again) {
            return again.measurement;
        }
        second.status |= Status::FRAME_DISTURBED;
        second
    }

    /// Whether specks that can be taken out, little light or noise are why the first look gave
    /// nothing.
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
        let is_noisy = self.noise.of_frame(Px(0)).times >= NOISY;
        (has_specks || (is_dim || is_noisy) && !status.contains(Status::UNEXPLAINED))
            && specks <= pixels / MOST_SPECKS_PART
            && holes <= set_pixels / HOLES_PART
    }
}
