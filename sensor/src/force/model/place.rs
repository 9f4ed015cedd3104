//! Reads and writes the model file's section on places: their range and uncertainty.

use super::{ModelError, Uncertainty, reader::Reader, uncertainty::LARGEST_PLACE_UNCERTAINTY};
#[cfg(any(test, feature = "encode"))]
use alloc::vec::Vec;
use hivtac_terms::units::Micrometres;

/// The largest range of places, µm: a metre.
const LARGEST_PLACE: u32 = 1_000_000;

/// Reads the range of places, and stores their uncertainties in the knots.
pub(super) fn place(
    reader: &mut Reader<'_>,
    uncertainty: &mut Uncertainty,
) -> Result<Micrometres, ModelError> {
    let range = length(reader, "largest place", 1..=LARGEST_PLACE, "1 to 1000000")?;
    for knot in &mut uncertainty.knots {
        let allowed = 0..=LARGEST_PLACE_UNCERTAINTY.0;
        knot.place = length(reader, "uncertainty of the place", allowed, "0 to 1000000")?;
    }
    Ok(range)
}

fn length(
    reader: &mut Reader<'_>,
    name: &'static str,
    range: core::ops::RangeInclusive<u32>,
    allowed: &'static str,
) -> Result<Micrometres, ModelError> {
    let offset = reader.offset;
    let value = reader.u32()?;
    let wrong = ModelError::Field {
        name,
        offset,
        allowed,
    };
    if range.contains(&value) {
        Ok(Micrometres(value))
    } else {
        Err(wrong)
    }
}

#[cfg(any(test, feature = "encode"))]
pub(super) fn push(bytes: &mut Vec<u8>, range: Micrometres, uncertainty: &Uncertainty) {
    bytes.extend(range.0.to_le_bytes());
    for knot in &uncertainty.knots {
        bytes.extend(knot.place.0.to_le_bytes());
    }
}
