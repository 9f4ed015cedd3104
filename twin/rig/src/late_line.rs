//! Makes the EXTI line of VSYNC fall late after the write that clears it.
//!
//! The bus accepts a write and delivers it later. The core has meanwhile left its handler, finds
//! the line still up, and enters it again. A read of the same peripheral waits for the write. The
//! chip's delay is not specified. Here the line falls late enough that every handler has returned,
//! unless a register was read back.

use rigless::emulator::{Access, AccessKind};
use rigless::mcu::Operate;
use rigless::soc::Width;
use rigless::soc::stm32h743::Stm32h743;
use rigless::time::VirtualNanos;

/// EXTI's registers.
const EXTI: std::ops::Range<u64> = 0x5800_0000..0x5800_0400;
/// EXTI_SWIER1, which raises a line as its edge does, and EXTI_CPUPR1, which clears it.
const RAISE: u64 = 0x5800_0008;
pub const CLEAR: u64 = 0x5800_0088;
/// Delay of the line's fall after the write: more than a handler takes from the write to its end,
/// less than a line of a frame.
const LATE_NS: u64 = 10_000;

/// Writes that have not arrived yet.
#[derive(Debug, Default)]
pub struct LateLine {
    /// Lines that will fall, and the time, ns.
    falling: Option<(u64, u64)>,
    /// Whether the next write belongs to a handler that was entered again.
    again: bool,
}

impl LateLine {
    /// Handles an access by the core: a read or a write.
    pub fn accessed(&mut self, access: &Access, value: u64) {
        if !EXTI.contains(&access.address) {
            return;
        }
        self.falling = match access.kind {
            AccessKind::Write if access.address == CLEAR && !std::mem::take(&mut self.again) => {
                Some((value, access.virtual_time.0 + LATE_NS))
            }
            AccessKind::Write => self.falling,
            _ => None,
        };
    }

    /// Raises the lines again that were still up when their handler returned.
    pub fn settle(&mut self, part: &mut Stm32h743, at: VirtualNanos) {
        if let Some((lines, _)) = self.falling.take_if(|(_, falls)| at.0 >= *falls) {
            self.again = true;
            // Never fails: EXTI has no clock gate.
            let _ = part.write(at, RAISE, Width::W32, lines);
        }
    }
}
