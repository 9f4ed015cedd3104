//! Looking again: a frame that is refused may be disturbed by no more than specks or little light,
//! and show its markers all the same.
//!
//! A frame of which all rows can be had once more is then looked at by a mask that follows the
//! light and has its specks taken out
//! ([`ScanSettings::cleaned`](hivtac_markers::scanner::ScanSettings)). The same rules judge what it
//! shows, and the contact must explain all eight coordinates of markers that are known less well:
//! without a film run forwards there is no second look. What is not plain then stays refused, for
//! the reason that it had at first.
//!
//! What the first look shows four plausible markers of, which no contact explains, is not looked at
//! again: with larger uncertainties a false marker would be explained.

use super::{Measurement, Sensor};
use hivtac_markers::scanner::ScanSettings;
use hivtac_markers::tables::Table;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// Reasons for which a frame is looked at again.
const AGAIN: Status = Status(
    Status::MARKERS_MISSING.0
        | Status::MARKERS_AMBIGUOUS.0
        | Status::BLOB_OVERFLOW.0
        | Status::MARKERS_IMPLAUSIBLE.0
        | Status::IMAGE_SATURATED.0
        | Status::IMAGE_DARK.0,
);
/// Reasons for which no look helps.
const NEVER: Status = Status(Status::NO_FORCE.0 & !AGAIN.0);
/// Standard uncertainty of a coordinate of a marker of the cleaned mask beside that of noise:
/// 0.05 px (seen: 0.047 px at a fifth of the light).
pub(super) const BLUR: Px = Px(3_277);

/// Which look at a frame is under way, or was the last.
#[derive(Clone, Debug)]
pub(super) enum Look {
    /// The usual one, after which none is wanted.
    First,
    /// The usual one; it gave this, and another may give more.
    Wanted(Measurement),
    /// By the cleaned mask; the first one gave this.
    Again(Measurement),
}

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Whether another look at the frame that was finished last may give a force, and begins it:
    /// push all rows of the frame again, and [finish](Self::finish_frame) it.
    #[inline(never)]
    pub fn look_again(&mut self) -> bool {
        let Look::Wanted(first) = self.look else {
            return false;
        };
        self.look = Look::Again(first);
        let settings = ScanSettings {
            cleaned: true,
            ..self.settings.scan()
        };
        self.scanner.begin(settings).is_ok()
    }

    /// Whether what the first look gave calls for another.
    pub(super) fn wants_again(&self, measurement: &Measurement) -> bool {
        let status = measurement.status;
        let resting = self.prepared.as_ref().map(|prepared| &prepared.resting);
        status.intersects(AGAIN) && !status.intersects(NEVER) && matches!(resting, Some(Some(_)))
    }

    /// Ends another look: gives what it gave when that is a force, or else what the `first` did.
    #[inline(never)]
    pub(super) fn finish_look(&mut self, first: &Measurement) -> Measurement {
        let found = self.end_scan().and_then(|()| self.find_markers());
        let mut second = self.measurement(found);
        // Where markers are tells the next frame how they move, even without a force.
        if second.markers.is_some() {
            self.motion.ended(second.markers.as_ref());
        }
        if second.force.is_none() {
            return *first;
        }
        second.status |= Status::FRAME_DISTURBED;
        second
    }
}
