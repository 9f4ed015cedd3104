//! Whether a place is one that a model knows.

use super::{PLACE_MARGIN, Place};
use hivtac_terms::units::Micrometres;

/// Whether a coordinate lies farther from the middle than `limit` and [`PLACE_MARGIN`].
pub(super) fn is_beyond(place: &Place, limit: Micrometres) -> bool {
    let largest = limit.0.saturating_add(PLACE_MARGIN.0);
    [place.x, place.y]
        .iter()
        .any(|part| part.0.unsigned_abs() > largest)
}
