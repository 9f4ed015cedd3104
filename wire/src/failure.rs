//! Defines a device's report of the failure that last ended its program.

use heapless::String;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Most bytes of a [`Failure::place`].
pub const PLACE_BYTES: usize = 48;

/// What ended the program in an earlier run. A device keeps it until its power is cut or it gets
/// new firmware.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Failure {
    /// Its kind.
    pub kind: FailureKind,
    /// Number of starts since then: 1 if it ended the run before this one.
    pub starts_ago: u32,
    /// Number of failures since power-on, this one included.
    pub count: u32,
    /// Address of the instruction; `None` if it is unknown.
    pub program_counter: Option<u32>,
    /// The link register then, often the return address of the function; `None` if it is unknown.
    pub link_register: Option<u32>,
    /// Address that was accessed; `None` if the core did not report it.
    pub address: Option<u32>,
    /// The core's Configurable Fault Status Register, 0 without a fault.
    pub fault_status: u32,
    /// Number of the exception whose handler ran (ARMv7-M: 16 and the interrupt's number); 0 in
    /// thread mode.
    pub exception: u16,
    /// The end of the source file's path, and the line, of a panic; empty otherwise.
    pub place: String<PLACE_BYTES>,
}

/// The kinds of failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum FailureKind {
    /// The program found that it must not go on.
    Panic,
    /// A fault of none of the following kinds.
    HardFault,
    /// An access or instruction that the memory protection forbids.
    MemoryFault,
    /// An access to which no memory and no peripheral answers, or an error of memory.
    BusFault,
    /// An instruction that the core cannot execute.
    UsageFault,
    /// The stack ran out of its memory.
    StackOverflow,
    /// An interrupt without a handler.
    UnknownInterrupt,
    /// The program stood still, and the watchdog restarted it.
    Watchdog,
}

impl FailureKind {
    /// All kinds, sorted by their numbers on the wire.
    pub const ALL: [FailureKind; 8] = [
        FailureKind::Panic,
        FailureKind::HardFault,
        FailureKind::MemoryFault,
        FailureKind::BusFault,
        FailureKind::UsageFault,
        FailureKind::StackOverflow,
        FailureKind::UnknownInterrupt,
        FailureKind::Watchdog,
    ];

    /// The kind of a fault, by the core's Configurable Fault Status Register (ARMv7-M, B3.2.15).
    /// A stack that is not written (MSTKERR, STKERR) has run out of its memory.
    pub const fn of_fault(status: u32) -> FailureKind {
        const STACKING: u32 = 1 << 4 | 1 << 12;
        match status {
            _ if status & STACKING != 0 => FailureKind::StackOverflow,
            _ if status & 0xFF != 0 => FailureKind::MemoryFault,
            _ if status & 0xFF00 != 0 => FailureKind::BusFault,
            _ if status != 0 => FailureKind::UsageFault,
            _ => FailureKind::HardFault,
        }
    }

    /// Its name in `docs/wire.md`.
    pub const fn name(self) -> &'static str {
        match self {
            FailureKind::Panic => "panic",
            FailureKind::HardFault => "hard_fault",
            FailureKind::MemoryFault => "memory_fault",
            FailureKind::BusFault => "bus_fault",
            FailureKind::UsageFault => "usage_fault",
            FailureKind::StackOverflow => "stack_overflow",
            FailureKind::UnknownInterrupt => "unknown_interrupt",
            FailureKind::Watchdog => "watchdog",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_listed_by_their_numbers() {
        for (nth, kind) in (0..).zip(FailureKind::ALL) {
            assert_eq!(kind as u8, nth, "{kind:?}");
        }
    }

    #[test]
    fn the_cores_status_says_what_a_fault_was() {
        for (status, kind) in [
            (0, FailureKind::HardFault),
            (1 << 7 | 1 << 1, FailureKind::MemoryFault),
            (1 << 15 | 1 << 9, FailureKind::BusFault),
            (1 << 16, FailureKind::UsageFault),
            (1 << 25, FailureKind::UsageFault),
            (1 << 15 | 1 << 12 | 1 << 9, FailureKind::StackOverflow),
            (1 << 4, FailureKind::StackOverflow),
        ] {
            assert_eq!(FailureKind::of_fault(status), kind, "{status:#x}");
        }
    }
}
