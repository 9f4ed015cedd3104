//! The independent watchdog.
//!
//! RM0433, "Independent watchdog". Simulated: start, refresh, write access, prescaler and reload,
//! at 32 kHz, and the reset. Not simulated: the window, the time that new values take to be taken
//! over, the hardware watchdog of the option bytes, and that a debugger stops it.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32h743::generated::iwdg::Register;
use rigless::time::{EventId, VirtualNanos};

/// KR: the keys that may be written to it.
const START: u64 = 0xCCCC;
const REFRESH: u64 = 0xAAAA;
const ENABLE_ACCESS: u64 = 0x5555;
/// LSI, Hz.
const CLOCK_HZ: u64 = 32_000;

/// The watchdog.
#[derive(Debug)]
pub struct Iwdg {
    is_open: bool,
    prescaler: u64,
    reload: u64,
    /// The event of its end of count; `None` until it is started.
    end: Option<EventId>,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self {
            is_open: false,
            prescaler: 0,
            reload: 0xFFF,
            end: None,
        }
    }
}

impl Iwdg {
    /// Counts from the reload value on.
    fn count(&mut self, context: &mut DeviceContext<'_>) {
        let divider = 4 << self.prescaler.min(6);
        let ns = (self.reload + 1) * divider * 1_000_000_000 / CLOCK_HZ;
        self.end = Some(context.schedule(VirtualNanos(context.now().0 + ns)));
    }

    fn key(&mut self, key: u64, context: &mut DeviceContext<'_>) {
        self.is_open = key == ENABLE_ACCESS;
        if key == START || key == REFRESH && self.end.is_some() {
            self.count(context);
        }
    }
}

impl Device for Iwdg {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            Register::Kr => self.key(value & 0xFFFF, context),
            Register::Pr if self.is_open => {
                self.prescaler = value & 7;
                // The count goes on at the new pace; a whole one is the longest that it may take.
                if self.end.is_some() {
                    self.count(context);
                }
            }
            Register::Rlr if self.is_open => self.reload = value & 0xFFF,
            _ => {}
        }
        registers.set(Register::Pr, self.prescaler);
        registers.set(Register::Rlr, self.reload);
    }

    fn on_event(
        &mut self,
        event: EventId,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.end == Some(event) {
            self.end = None;
            context.request_reset();
        }
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::{Operate, Single};
    use rigless::soc::Width;
    use rigless::soc::stm32h743::{builder, generated::IWDG};

    fn write(part: &mut Single<Iwdg>, at_ms: u64, offset: u64, value: u64) {
        let at = VirtualNanos(at_ms * 1_000_000);
        part.write(at, IWDG.base + offset, Width::W32, value)
            .unwrap();
    }

    /// 2,000 × 16 / 32 kHz is a second.
    #[test]
    fn it_ends_when_nobody_feeds_it_for_its_time() {
        let mut part = Single::new(builder(), "IWDG", Iwdg::default()).unwrap();
        write(&mut part, 0, 4, 2);
        assert_eq!(part.next_event(), None, "it is locked and stopped");
        for (offset, value) in [(0, ENABLE_ACCESS), (4, 2), (8, 1_999), (0, START)] {
            write(&mut part, 10, offset, value);
        }
        assert_eq!(part.next_event(), Some(VirtualNanos(1_010_000_000)));
    }
}
