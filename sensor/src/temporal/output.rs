//! Decides whether the output pin is high.

use super::FORGOTTEN_US;
use crate::force::Force;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::Output;

#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    is_high: bool,
    /// Time of the newest force, µs.
    newest_us: u64,
}

impl Level {
    /// Low, as before the first frame.
    pub const LOW: Level = Level {
        is_high: false,
        newest_us: 0,
    };

    /// Takes a frame's own force, `None` without one, and its status with contact and slip. Returns
    /// whether the pin is high.
    pub fn follow(
        &mut self,
        output: Output,
        time_us: u64,
        force: Option<&Force>,
        status: Status,
    ) -> bool {
        let Some(force) = force else {
            self.is_high &= time_us.saturating_sub(self.newest_us) <= FORGOTTEN_US;
            return self.is_high;
        };
        self.newest_us = time_us;
        self.is_high = match output {
            Output::Off => false,
            Output::Contact => status.contains(Status::CONTACT),
            Output::Slip => status.contains(Status::SLIP),
            Output::Force { limit } => {
                let below = if self.is_high { limit.0 / 10 } else { 0 };
                force.magnitude.0.unsigned_abs() >= limit.0.saturating_sub(below)
            }
        };
        self.is_high
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::tests::pressed;
    use hivtac_terms::units::UnsignedMicroNewtons;

    /// The levels for frames 6 ms apart, each a force, µN, or none, and a status.
    fn levels(output: Output, frames: &[(Option<i32>, Status)]) -> std::vec::Vec<bool> {
        let mut level = Level::LOW;
        let mut time_us = 0;
        let levels = frames.iter().map(|&(magnitude, status)| {
            time_us += 6_000;
            let force = magnitude.map(|magnitude| pressed(magnitude, 100));
            level.follow(output, time_us, force.as_ref(), status)
        });
        levels.collect()
    }

    #[test]
    fn a_force_limit_has_a_tenth_of_hysteresis() {
        let limit = UnsignedMicroNewtons(100_000);
        let forces = [99_999, 100_000, 90_000, 89_999, 99_999, 100_000];
        let frames = forces.map(|force| (Some(force), Status::OK));
        let expected = [false, true, true, false, false, true];
        assert_eq!(levels(Output::Force { limit }, &frames), expected);
    }

    #[test]
    fn contact_and_slip_are_those_of_the_status() {
        let frames = [Status::OK, Status::CONTACT, Status::SLIP, Status::OK];
        let frames = frames.map(|status| (Some(50_000), status));
        assert_eq!(levels(Output::Off, &frames), [false; 4]);
        let expected = [false, true, false, false];
        assert_eq!(levels(Output::Contact, &frames), expected);
        assert_eq!(levels(Output::Slip, &frames), [false, false, true, false]);
    }

    #[test]
    fn frames_without_a_force_hold_it_for_a_tenth_of_a_second() {
        let mut frames = std::vec![(None, Status::OK), (Some(50_000), Status::CONTACT)];
        frames.extend([(None, Status::OK); 20]);
        let levels = levels(Output::Contact, &frames);
        let high = levels.iter().filter(|level| **level).count();
        assert_eq!((levels[0], high), (false, 1 + 100 / 6));
    }
}
