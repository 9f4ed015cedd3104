//! The effects of a busy bus under [`Kind::BusBusy`]: transfers wait, and an interrupt line falls
//! late after the write that clears it.
//!
//! The bus accepts a write and delivers it later. A handler that has returned by then finds its
//! line still up, and is entered again without a cause. A read of the same device waits for the
//! write; the line has fallen when the read returns.

use rigless::device::{DeviceContext, Level};
use rigless::time::{EventId, VirtualNanos};

use crate::faults::{Faults, Kind};

/// The longest delay of a write, ns: longer than a handler takes from the write to its end.
pub const LONGEST_WRITE_NS: u64 = 2_000;

/// Random numbers that a seed decides.
#[derive(Clone, Debug)]
pub struct Chance(u64);

impl Chance {
    /// Returns the numbers of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns the next number, below `bound`.
    pub fn below(&mut self, bound: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(0x5851_F42D_4C95_7F2D)
            .wrapping_add(0x1405_7B7E_F767_814F);
        (self.0 >> 33) % bound
    }
}

/// The interrupt line of a device.
#[derive(Debug)]
pub struct InterruptLine {
    faults: Faults,
    chance: Chance,
    level: Level,
    falls: Option<EventId>,
}

impl InterruptLine {
    /// Returns a line at low level.
    pub fn new(faults: Faults, seed: u64) -> Self {
        Self {
            faults,
            chance: Chance::new(seed),
            level: Level::Low,
            falls: None,
        }
    }

    /// Sets the level that the device's registers ask for. On a busy bus, low is set later.
    pub fn drive(&mut self, wanted: Level, context: &mut DeviceContext<'_>) {
        let now = context.now().0;
        if wanted == Level::High {
            self.falls = None;
            self.put(wanted, context);
        } else if self.level == Level::High && self.falls.is_none() {
            if self.faults.on(Kind::BusBusy, now) {
                let later = now + self.chance.below(LONGEST_WRITE_NS);
                self.falls = Some(context.schedule(VirtualNanos(later)));
            } else {
                self.put(wanted, context);
            }
        }
    }

    /// Lets the line fall: the core has read from the device, and earlier writes have arrived.
    pub fn read_back(&mut self, context: &mut DeviceContext<'_>) {
        if self.falls.take().is_some() {
            self.put(Level::Low, context);
        }
    }

    /// Returns whether an event was the line's fall, and lets the line fall if it was.
    pub fn falls_at(&mut self, event: EventId, context: &mut DeviceContext<'_>) -> bool {
        let falls = self.falls.take_if(|falls| *falls == event).is_some();
        if falls {
            self.put(Level::Low, context);
        }
        falls
    }

    /// Resets the line with the part, which drops events and lines.
    pub fn reset(&mut self) {
        (self.level, self.falls) = (Level::Low, None);
    }

    fn put(&mut self, level: Level, context: &mut DeviceContext<'_>) {
        if level != self.level {
            self.level = level;
            context.interrupt(0, level);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_decides_its_numbers() {
        let numbers = |seed| {
            let mut chance = Chance::new(seed);
            std::array::from_fn::<u64, 64, _>(|_| chance.below(16))
        };
        assert_eq!(numbers(1), numbers(1));
        assert_ne!(numbers(1), numbers(2));
        assert!((0..16).all(|wanted| numbers(1).contains(&wanted)));
    }
}
