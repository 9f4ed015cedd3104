//! Whether something touches the film.

use super::Force;
use hivtac_terms::units::MicroNewtons;

/// The least |F| that counts as a contact, however certain it is.
pub const LEAST_CONTACT: MicroNewtons = MicroNewtons(2_000);
/// A contact's |F| is at least this many times its standard uncertainty.
pub const CONTACT_SIGMAS: u32 = 3;

/// Whether |F| is large and certain enough that something touches the film.
pub fn is_contact(force: &Force) -> bool {
    let certain = force.magnitude.0.unsigned_abs() / CONTACT_SIGMAS >= force.magnitude_sigma.0;
    force.magnitude >= LEAST_CONTACT && certain
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::units::{MilliDegrees, UnsignedMicroNewtons, UnsignedMilliDegrees};

    fn touches(magnitude: i32, sigma: u32) -> bool {
        let force = Force {
            alpha: MilliDegrees(0),
            beta: MilliDegrees(0),
            magnitude: MicroNewtons(magnitude),
            cartesian: [0, 0, -magnitude].map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(0),
            magnitude_sigma: UnsignedMicroNewtons(sigma),
            place: None,
        };
        is_contact(&force)
    }

    #[test]
    fn two_millinewtons_are_a_contact_when_they_are_certain() {
        assert!(touches(2_000, 0));
        assert!(!touches(1_999, 0));
        assert!(touches(2_000, 666));
        assert!(!touches(2_000, 667));
    }

    #[test]
    fn three_uncertainties_are_needed_up_to_the_largest_numbers() {
        assert!(touches(9_000, 3_000));
        assert!(!touches(8_999, 3_000));
        assert!(touches(i32::MAX, i32::MAX as u32 / 3));
        assert!(!touches(i32::MAX, i32::MAX as u32 / 3 + 1));
        assert!(!touches(0, 0));
    }
}
