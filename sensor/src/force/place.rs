//! Checks whether a place is within a model's range.

use super::{PLACE_MARGIN, Place};
use hivtac_terms::units::Micrometres;

/// Whether a coordinate exceeds `limit` by more than [`PLACE_MARGIN`].
pub(super) fn is_beyond(place: &Place, limit: Micrometres) -> bool {
    let largest = limit.0.saturating_add(PLACE_MARGIN.0);
    [place.x, place.y]
        .iter()
        .any(|part| part.0.unsigned_abs() > largest)
}
