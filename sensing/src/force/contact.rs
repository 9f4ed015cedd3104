//! Whether something touches the film.

use super::Force;
use crate::units::MicroNewtons;

/// The least |F| that counts as a contact, however certain it is.
pub const LEAST_CONTACT: MicroNewtons = MicroNewtons(2_000);
/// A contact's |F| is at least this many times its standard uncertainty.
pub const CONTACT_SIGMAS: i32 = 3;

impl Force {
    /// Whether |F| is large and certain enough that something touches the film.
    pub fn is_contact(&self) -> bool {
        let certain = self.magnitude.0 / CONTACT_SIGMAS >= self.magnitude_sigma.0;
        self.magnitude >= LEAST_CONTACT && certain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::MilliDegrees;

    fn is_contact(magnitude: i32, sigma: i32) -> bool {
        let force = Force {
            alpha: MilliDegrees(0),
            beta: MilliDegrees(0),
            magnitude: MicroNewtons(magnitude),
            cartesian: [0, 0, -magnitude].map(MicroNewtons),
            direction_sigma: MilliDegrees(0),
            magnitude_sigma: MicroNewtons(sigma),
            place: None,
        };
        force.is_contact()
    }

    #[test]
    fn two_millinewtons_are_a_contact_when_they_are_certain() {
        assert!(is_contact(2_000, 0));
        assert!(!is_contact(1_999, 0));
        assert!(is_contact(2_000, 666));
        assert!(!is_contact(2_000, 667));
    }

    #[test]
    fn three_uncertainties_are_needed_up_to_the_largest_numbers() {
        assert!(is_contact(9_000, 3_000));
        assert!(!is_contact(8_999, 3_000));
        assert!(is_contact(i32::MAX, i32::MAX / 3));
        assert!(!is_contact(i32::MAX, i32::MAX / 3 + 1));
        assert!(!is_contact(0, 0));
    }
}
