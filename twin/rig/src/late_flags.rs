//! Late interrupt lines of the emulator's own DMA controllers and time base on a busy bus
//! ([`Kind::BusBusy`]). Each stays up for a while after the write that clears its flag. A read of
//! the peripheral by the core ends this, because it waits for the write.
//!
//! A handler that returns meanwhile is entered again and finds no flag. Only a flag that the core
//! has read as set keeps its line up: a flag that was cleared unseen may never have raised it.

use rigless::device::Level;
use rigless::emulator::{Access, AccessKind};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::time::VirtualNanos;

use crate::busy_bus::{Chance, LONGEST_WRITE_NS};
use crate::faults::{Faults, Kind};

/// A register of flags, and the register that clears them.
struct Flags {
    peripheral: &'static str,
    base: u64,
    /// Offset of the flag register.
    status: u64,
    /// Offset of the clearing register.
    clear: u64,
    /// Whether zeros clear flags; otherwise ones do.
    by_zeros: bool,
    /// Flags that raise a line, and its position in the peripheral's table.
    lines: &'static [(u64, usize)],
}

/// Bytes of a peripheral's registers.
const BLOCK: u64 = 0x400;
/// TCIF and TEIF of streams 0 to 3, and of 4 to 7.
const LOWER: &[(u64, usize)] = &[(0x28, 0), (0x28 << 6, 1), (0x28 << 16, 2), (0x28 << 22, 3)];
const UPPER: &[(u64, usize)] = &[(0x28, 4), (0x28 << 6, 5), (0x28 << 16, 6), (0x28 << 22, 7)];

const fn streams(peripheral: &'static str, base: u64, upper: bool) -> Flags {
    Flags {
        peripheral,
        base,
        status: if upper { 4 } else { 0 },
        clear: if upper { 0xC } else { 8 },
        by_zeros: false,
        lines: if upper { UPPER } else { LOWER },
    }
}

const ALL: [Flags; 5] = [
    streams("DMA1", 0x4002_0000, false),
    streams("DMA1", 0x4002_0000, true),
    streams("DMA2", 0x4002_0400, false),
    streams("DMA2", 0x4002_0400, true),
    // The time base: update, compare, trigger.
    Flags {
        peripheral: "TIM2",
        base: 0x4000_0000,
        status: 0x10,
        clear: 0x10,
        by_zeros: true,
        lines: &[(0x5F, 0)],
    },
];

/// A line that is still up.
#[derive(Debug)]
struct Held {
    /// Index into [`ALL`].
    flags: usize,
    mask: u64,
    position: usize,
    falls_ns: u64,
}

/// The lines that are still up, and the flags that the core has seen.
#[derive(Debug)]
pub struct LateFlags {
    faults: Faults,
    chance: Chance,
    /// Flags that the core has read as set and has not cleared since.
    seen: [u64; ALL.len()],
    held: Vec<Held>,
}

impl LateFlags {
    /// Returns a state without held lines; `seed` decides the time for which lines are held.
    pub fn new(faults: Faults, seed: u64) -> Self {
        Self {
            faults,
            chance: Chance::new(seed),
            seen: [0; ALL.len()],
            held: Vec::new(),
        }
    }

    /// Handles an access by the core: a read or a write.
    pub fn accessed(&mut self, part: &mut Stm32h743, access: &Access, value: u64) {
        let offset = |flags: &Flags| {
            let within = flags.base..flags.base + BLOCK;
            within
                .contains(&access.address)
                .then(|| access.address - flags.base)
        };
        for (index, flags) in ALL.iter().enumerate() {
            match (offset(flags), access.kind) {
                (Some(offset), AccessKind::Write) if offset == flags.clear => {
                    let cleared = if flags.by_zeros { !value } else { value };
                    self.cleared(part, index, cleared, access.virtual_time);
                }
                (Some(offset), AccessKind::Read) => {
                    self.fall(part, access.virtual_time, |held| {
                        ALL[held.flags].peripheral == flags.peripheral
                    });
                    if offset == flags.status {
                        self.seen[index] = value;
                    }
                }
                _ => {}
            }
        }
    }

    /// Lets lines fall whose time has come.
    pub fn settle(&mut self, part: &mut Stm32h743, at: VirtualNanos) {
        self.fall(part, at, |held| at.0 >= held.falls_ns);
    }

    /// Resets the state with the part, which drops all lines.
    pub fn reset(&mut self) {
        self.held.clear();
        self.seen = [0; ALL.len()];
    }

    fn cleared(&mut self, part: &mut Stm32h743, index: usize, cleared: u64, at: VirtualNanos) {
        let (flags, seen) = (&ALL[index], self.seen[index] & cleared);
        self.seen[index] &= !cleared;
        if !self.faults.on(Kind::BusBusy, at.0) {
            return;
        }
        for &(mask, position) in flags.lines.iter().filter(|(mask, _)| seen & mask != 0) {
            put(part, at, flags.peripheral, position, Level::High);
            self.held.push(Held {
                flags: index,
                mask,
                position,
                falls_ns: at.0 + self.chance.below(LONGEST_WRITE_NS),
            });
        }
    }

    /// Lets lines fall, unless a new flag keeps them up.
    fn fall(&mut self, part: &mut Stm32h743, at: VirtualNanos, which: impl Fn(&Held) -> bool) {
        for held in self.held.extract_if(.., |held| which(held)) {
            let flags = &ALL[held.flags];
            let now = status(part, flags);
            if now & held.mask == 0 {
                put(part, at, flags.peripheral, held.position, Level::Low);
            }
        }
    }
}

fn put(part: &mut Stm32h743, at: VirtualNanos, name: &str, position: usize, level: Level) {
    if let Some(slot) = part.bus().slot_of(name) {
        let (_, mut context) = part.bus_mut().drive(at, slot);
        context.interrupt(position, level);
    }
}

fn status(part: &Stm32h743, flags: &Flags) -> u64 {
    use rigless::soc::stm32h743::generated::{dma1, tim2};
    let Some(registers) = part.bus().registers(flags.peripheral) else {
        return 0;
    };
    match (flags.peripheral, flags.status) {
        ("TIM2", _) => registers.get(tim2::Register::Sr) & registers.get(tim2::Register::Dier),
        (_, 0) => registers.get(dma1::Register::Lisr),
        _ => registers.get(dma1::Register::Hisr),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::device::InterruptChange;
    use rigless::mcu::Operate;
    use rigless::soc::Width;

    const STATUS: u64 = 0x4002_0000;
    const CLEAR: u64 = 0x4002_0008;
    /// TCIF of stream 0.
    const FINISHED: u64 = 1 << 5;

    fn access(kind: AccessKind, address: u64) -> Access {
        Access::new(kind, address, Width::W32, 0).at(0, VirtualNanos(1_000))
    }

    /// Returns a part whose core has seen the end of DMA1's stream 0, and clears that flag at 1 µs.
    fn cleared(faults: &[&str], seen: u64) -> (Stm32h743, LateFlags) {
        let mut part = Stm32h743::new().unwrap();
        let faults = Faults::new(faults.iter().map(|one| one.parse().unwrap()).collect());
        let mut late = LateFlags::new(faults, 1);
        for (kind, address, value) in [
            (AccessKind::Read, STATUS, seen),
            (AccessKind::Write, CLEAR, FINISHED),
        ] {
            late.accessed(&mut part, &access(kind, address), value);
        }
        (part, late)
    }

    /// Returns the levels of the stream's line, in order.
    fn levels(part: &mut Stm32h743) -> Vec<Level> {
        let changes = part.drain_interrupts().into_iter();
        let of_it = changes.filter(|InterruptChange { interrupt, .. }| *interrupt == 11);
        of_it.map(|change| change.level).collect()
    }

    #[test]
    fn a_line_stays_up_until_its_time_has_come() {
        let (mut part, mut late) = cleared(&["bus-busy"], FINISHED);
        assert_eq!(levels(&mut part), [Level::High]);
        late.settle(&mut part, VirtualNanos(1_000 + LONGEST_WRITE_NS));
        assert_eq!(levels(&mut part), [Level::Low]);
        late.settle(&mut part, VirtualNanos(1_000 + 2 * LONGEST_WRITE_NS));
        assert_eq!(levels(&mut part), []);
    }

    #[test]
    fn a_read_waits_for_the_write() {
        let (mut part, mut late) = cleared(&["bus-busy"], FINISHED);
        late.accessed(&mut part, &access(AccessKind::Read, STATUS), 0);
        assert_eq!(levels(&mut part), [Level::High, Level::Low]);
    }

    #[test]
    fn a_quiet_bus_and_a_flag_that_was_not_seen_hold_nothing() {
        for (faults, seen) in [(&[][..], FINISHED), (&["bus-busy"], 0)] {
            let (mut part, _) = cleared(faults, seen);
            assert_eq!(levels(&mut part), [], "{faults:?}");
        }
    }
}
