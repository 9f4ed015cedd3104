//! Counts how much of its time the core executes instructions. It sleeps in the rest: the program's
//! executor waits for events.

use std::num::NonZeroU64;

/// Time from which on it counts, ns: the camera is set up by then.
const SET_UP_NS: u64 = 500_000_000;

/// The times and the core's instructions at the first and the last look.
#[derive(Debug)]
pub struct Awake {
    instructions_per_second: NonZeroU64,
    first: Option<(u64, u64)>,
    last: (u64, u64),
}

impl Awake {
    /// Counts for a core of this speed.
    pub fn new(instructions_per_second: NonZeroU64) -> Self {
        Self {
            instructions_per_second,
            first: None,
            last: (0, 0),
        }
    }

    /// Call often, with the time, ns, and the instructions that the core has executed.
    pub fn look(&mut self, now_ns: u64, instructions: u64) {
        self.last = (now_ns, instructions);
        if now_ns >= SET_UP_NS {
            self.first.get_or_insert(self.last);
        }
    }

    /// Returns the share of the time from the set-up to the last look, 0 to 1.
    pub fn share(&self) -> Option<f64> {
        let (from_ns, before) = self.first.filter(|(from_ns, _)| *from_ns < self.last.0)?;
        let seconds = (self.last.0 - from_ns) as f64 / 1e9;
        let executed = (self.last.1 - before) as f64;
        Some(executed / self.instructions_per_second.get() as f64 / seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_set_up_does_not_count() {
        let mut awake = Awake::new(NonZeroU64::new(1_000).unwrap());
        awake.look(400_000_000, 400);
        assert_eq!(awake.share(), None);
        awake.look(500_000_000, 500);
        assert_eq!(awake.share(), None);
        awake.look(1_500_000_000, 750);
        assert_eq!(awake.share(), Some(0.25));
    }
}
