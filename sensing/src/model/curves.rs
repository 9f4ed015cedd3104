//! The closed form in the model file.

use super::{ModelError, reader::Reader};
use crate::closed_form::{ClosedForm, LARGEST_KNOT, MAX_KNOTS, MAX_STEP_BITS, ONE};
#[cfg(any(test, feature = "encode"))]
use alloc::vec::Vec;

const KNOT_LENGTH: usize = 12;

pub(super) fn closed_form<'a>(reader: &mut Reader<'a>) -> Result<ClosedForm<'a>, ModelError> {
    let step_bits = reader.u8_in("distance of knots", MAX_STEP_BITS, "0 to 22")?;
    reader.zero("reserved byte")?;
    let count = reader.u16_in("number of knots", 2, MAX_KNOTS as u16, "2 to 257")?;
    let mut directions = [[0; 2]; 4];
    for component in directions.as_flattened_mut() {
        let offset = reader.offset;
        *component = reader.u32()? as i32;
        if !(-ONE..=ONE).contains(component) {
            return Err(ModelError::Field {
                name: "direction",
                offset,
                allowed: "-32768 to 32768",
            });
        }
    }
    let start = reader.offset;
    let (knots, _) = reader.take(usize::from(count) * KNOT_LENGTH)?.as_chunks();
    let form = ClosedForm {
        directions,
        step_bits,
        knots,
    };
    check_knots(&form, start)?;
    Ok(form)
}

/// Every value in range, and g nowhere falling: more radius never means less force.
fn check_knots(form: &ClosedForm<'_>, start: usize) -> Result<(), ModelError> {
    let mut before = 0;
    for index in 0..form.knots.len() {
        let knot = form.knot(index);
        let wrong = |name, allowed| ModelError::Field {
            name,
            offset: start + index * KNOT_LENGTH,
            allowed,
        };
        if knot.iter().any(|v| v.unsigned_abs() > LARGEST_KNOT as u32) {
            return Err(wrong("knot", "-1073741823 to 1073741823"));
        }
        if knot[0] < before {
            return Err(wrong("knot of g", "from 0, nowhere falling"));
        }
        before = knot[0];
    }
    Ok(())
}

/// A closed form, to be written; the fields mean what [`ClosedForm`]'s do.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClosedFormSpec {
    /// (x, y) of u₀…u₃, −2¹⁵ to 2¹⁵.
    pub directions: [[i32; 2]; 4],
    /// The distance of knots is 2 to the power of this, in 2⁻¹⁶ px; 0–22.
    pub step_bits: u8,
    /// g (µN), h (1/256 µN per px) and k (1/256 µN per px²) at each knot, 2–257 of them.
    pub knots: Vec<[i32; 3]>,
}

#[cfg(any(test, feature = "encode"))]
impl ClosedFormSpec {
    /// What a reader sees of a closed form.
    pub fn of(form: &ClosedForm<'_>) -> ClosedFormSpec {
        ClosedFormSpec {
            directions: form.directions,
            step_bits: form.step_bits,
            knots: (0..form.knots.len())
                .map(|index| form.knot(index))
                .collect(),
        }
    }

    pub(super) fn push(&self, bytes: &mut Vec<u8>) {
        bytes.extend([self.step_bits, 0]);
        // More knots than 16 bits count are more than the reader accepts.
        let count = u16::try_from(self.knots.len()).unwrap_or(u16::MAX);
        bytes.extend(count.to_le_bytes());
        for value in self.directions.as_flattened() {
            bytes.extend(value.to_le_bytes());
        }
        for value in self.knots.as_flattened() {
            bytes.extend(value.to_le_bytes());
        }
    }
}
