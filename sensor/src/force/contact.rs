//! Decides whether something touches the film.

use hivtac_terms::units::{MicroNewtons, UnsignedMicroNewtons};

/// The smallest |F| that counts as a contact, however certain it is.
pub const LEAST_CONTACT: MicroNewtons = MicroNewtons(2_000);
/// A contact's |F| is at least this many times its standard uncertainty.
pub const CONTACT_SIGMAS: u32 = 3;

/// Returns whether |F| is large and certain enough for a contact. `by_noise` is the standard
/// uncertainty of |F| by noise alone: the strength of a unit's film is a constant error, equal in
/// all frames.
pub fn is_contact(magnitude: MicroNewtons, by_noise: UnsignedMicroNewtons) -> bool {
    is_force(magnitude, by_noise, LEAST_CONTACT)
}

/// As [`is_contact`], with a smallest |F| of the caller's choice.
#[inline]
pub fn is_force(
    magnitude: MicroNewtons,
    by_noise: UnsignedMicroNewtons,
    least: MicroNewtons,
) -> bool {
    let certain = magnitude.0.unsigned_abs() / CONTACT_SIGMAS >= by_noise.0;
    magnitude >= least && certain
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touches(magnitude: i32, sigma: u32) -> bool {
        is_contact(MicroNewtons(magnitude), UnsignedMicroNewtons(sigma))
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
