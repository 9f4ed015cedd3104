//! A meter that times work by the core's cycle counter.

use cortex_m::peripheral::{DCB, DWT};

/// Times work with interrupts disabled.
pub struct Meter {
    /// Cycles of an empty measurement.
    overhead: u32,
}

impl Meter {
    /// Starts the counter.
    pub fn start(mut dcb: DCB, mut dwt: DWT) -> Meter {
        dcb.enable_trace();
        DWT::unlock();
        dwt.enable_cycle_counter();
        let mut meter = Meter { overhead: 0 };
        // The first measurement is not yet in the instruction cache.
        for _ in 0..2 {
            meter.overhead = 0;
            meter.overhead = meter.time(|| ()).1;
        }
        meter
    }

    /// Does the work, and returns its result and its cycles; at most 2³², 8.9 s.
    pub fn time<T>(&self, work: impl FnOnce() -> T) -> (T, u32) {
        cortex_m::interrupt::free(|_| {
            let start = DWT::cycle_count();
            let result = work();
            let cycles = DWT::cycle_count().wrapping_sub(start);
            (result, cycles.saturating_sub(self.overhead))
        })
    }
}
