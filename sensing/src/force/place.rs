//! Where the tip touches the film.

use super::PLACE_MARGIN;
use crate::units::{Micrometres, SignedMicrometres};

/// The point of the film that the tip touches, by where it rests in the film frame: (0, 0) is the
/// film's middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// To the right in the image.
    pub x: SignedMicrometres,
    /// Down in the image.
    pub y: SignedMicrometres,
    /// Standard uncertainty of each coordinate: the root of half the trace of their 2×2 covariance.
    /// Where that is the same in all directions, 95 of 100 true places lie within 2.448 times this
    /// length of the one found.
    pub sigma: Micrometres,
}

impl Place {
    /// Whether a coordinate lies farther from the middle than `limit` and [`PLACE_MARGIN`].
    pub(super) fn is_beyond(&self, limit: Micrometres) -> bool {
        let largest = limit.0.saturating_add(PLACE_MARGIN.0);
        [self.x, self.y]
            .iter()
            .any(|part| part.0.unsigned_abs() > largest)
    }
}
