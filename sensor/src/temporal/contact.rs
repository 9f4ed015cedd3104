//! Decides whether something touches the film, with hysteresis.
//!
//! A contact begins when |F| reaches the upper limit and is certain: at least three times its
//! standard uncertainty, or the frame's own status reports a contact. That status ignores how
//! uncertain a film's strength is. It ends below the lower limit, or below half of that certainty.

use super::{ContactLimits, FORGOTTEN_US};
use crate::force::CONTACT_SIGMAS;
use crate::pipeline::Measurement;
use hivtac_terms::status::Status;

#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    is_touched: bool,
    /// Time of the newest force, µs.
    newest_us: u64,
}

impl Contact {
    /// No contact.
    pub const NONE: Contact = Contact {
        is_touched: false,
        newest_us: 0,
    };

    /// Takes a frame and returns whether the film is touched; `None` if the frame has no force.
    pub fn follow(
        &mut self,
        limits: &ContactLimits,
        time_us: u64,
        measurement: &Measurement,
    ) -> Option<bool> {
        let force = measurement.force.as_ref()?;
        // If a unit's strength is uncertain, the frame's own status judges by noise alone.
        let is_certain = measurement.status.contains(Status::CONTACT);
        let was_touched = self.is_touched && time_us.saturating_sub(self.newest_us) <= FORGOTTEN_US;
        let magnitude = force.magnitude.0.unsigned_abs();
        let sigma = u64::from(force.magnitude_sigma.0) * u64::from(CONTACT_SIGMAS);
        self.is_touched = match was_touched {
            true => magnitude >= limits.ends.0 && (is_certain || 2 * u64::from(magnitude) >= sigma),
            false => magnitude >= limits.begins.0 && (is_certain || u64::from(magnitude) >= sigma),
        };
        self.newest_us = time_us;
        Some(self.is_touched)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::tests::{frame, pressed};
    use hivtac_terms::units::Px;

    /// Whether each of the forces, µN with standard uncertainty, a frame apart, is a contact.
    fn contacts(forces: &[(i32, u32)]) -> std::vec::Vec<bool> {
        let mut contact = Contact::NONE;
        let mut time_us = 0;
        let frames = forces.iter().map(|&(magnitude, sigma)| {
            time_us += 6_405;
            let force = pressed(magnitude, sigma);
            let seen = frame(Some(force), Px(0));
            contact.follow(&ContactLimits::default(), time_us, &seen)
        });
        frames.map(|reported| reported.unwrap()).collect()
    }

    #[test]
    fn it_begins_high_and_ends_low() {
        let forces = [1_999, 2_000, 1_999, 1_000, 999, 1_999, 2_000].map(|f| (f, 300));
        let expected = [false, true, true, true, false, false, true];
        assert_eq!(contacts(&forces), expected);
    }

    #[test]
    fn it_begins_with_three_uncertainties_and_ends_below_half_of_them() {
        let forces = [
            (8_999, 3_000),
            (9_000, 3_000),
            (4_500, 3_000),
            (4_499, 3_000),
        ];
        assert_eq!(contacts(&forces), [false, true, true, false]);
        let extremes = [(i32::MAX, u32::MAX), (i32::MIN, 1), (0, 0)];
        assert_eq!(contacts(&extremes), [false, true, false]);
    }

    /// A film's strength may be as uncertain as its force is large; the frame's status judges by
    /// noise alone.
    #[test]
    fn a_film_of_unknown_strength_is_touched() {
        let mut seen = frame(Some(pressed(20_000, 20_000)), Px(0));
        for (bit, expected) in [(Status::OK, false), (Status::CONTACT, true)] {
            seen.status |= bit;
            let mut contact = Contact::NONE;
            let reported = contact.follow(&ContactLimits::default(), 0, &seen);
            assert_eq!(reported, Some(expected));
        }
    }

    #[test]
    fn without_a_force_nobody_knows_and_after_a_while_nothing_is_remembered() {
        let limits = ContactLimits::default();
        let [first, none, between] = [Some(pressed(5_000, 1)), None, Some(pressed(1_500, 1))]
            .map(|force| frame(force, Px(0)));
        for (later_us, expected) in [(100_000, true), (100_001, false)] {
            let mut contact = Contact::NONE;
            assert_eq!(contact.follow(&limits, 0, &first), Some(true));
            assert_eq!(contact.follow(&limits, 50_000, &none), None);
            let reported = contact.follow(&limits, later_us, &between);
            assert_eq!(reported, Some(expected), "{later_us}");
        }
    }
}
