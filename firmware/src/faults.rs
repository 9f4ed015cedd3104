//! Handles faults: reports them if possible, and restarts.
//!
//! | what | ends in |
//! |---|---|
//! | panic | a record (`failure`) and a line on the debug probe, then a reset |
//! | hard fault: stack overflow, wild pointer | a record, then a reset |
//! | interrupt without a handler | the same |
//! | the start or thread mode stands still for 2 s, or the core is locked up | reset by the watchdog |

use crate::{failure, seeded_bugs, starts};
use core::sync::atomic::{AtomicU8, Ordering};
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG1};
use embassy_time::{Duration, Timer};
use hivtac_wire::health::ResetReason;

/// Why the microcontroller started, a `ResetReason`. Written at boot; read by the memory task.
static RESET_REASON: AtomicU8 = AtomicU8::new(ResetReason::Other as u8);

/// A quarter of the watchdog's time.
const FEED_PERIOD: Duration = Duration::from_millis(500);
/// The watchdog counts 4,096 of its 32 kHz, divided by 16: 2.05 s.
const WATCHDOG_DIVIDER: Pr = Pr::DIVIDE_BY16;

/// Keeps why the microcontroller was reset. Call first, and once. It does not log: the clock of the
/// log's times does not run yet.
pub fn note_reset() {
    let reasons = starts::reset_flags();
    // Each reset also pulls the reset line, and a power-on also sets the flags of other supply
    // resets.
    let reason = match () {
        () if reasons.porrstf() => ResetReason::PowerOn,
        () if reasons.borrstf() => ResetReason::BrownOut,
        () if reasons.iwdg1rstf() => ResetReason::Watchdog,
        () if reasons.sftrstf() => ResetReason::Software,
        () if reasons.pinrstf() => ResetReason::Pin,
        () => ResetReason::Other,
    };
    RESET_REASON.store(reason as u8, Ordering::Relaxed);
    let was_unpowered = matches!(reason, ResetReason::PowerOn | ResetReason::BrownOut);
    failure::started(was_unpowered, reason == ResetReason::Watchdog);
}

/// Logs why the microcontroller was reset.
pub fn log_reset() {
    defmt::info!("started by {}", defmt::Debug2Format(&reset_reason()));
}

/// Why the microcontroller started.
pub fn reset_reason() -> ResetReason {
    const REASONS: [ResetReason; 5] = [
        ResetReason::PowerOn,
        ResetReason::BrownOut,
        ResetReason::Pin,
        ResetReason::Software,
        ResetReason::Watchdog,
    ];
    let number = RESET_REASON.load(Ordering::Relaxed);
    let reason = REASONS.into_iter().find(|reason| *reason as u8 == number);
    reason.unwrap_or(ResetReason::Other)
}

/// Starts the watchdog. It resets the program if the start takes longer, or tasks of higher
/// priority never let thread mode run.
pub fn start_watchdog() {
    // The watchdog stops while a debugger halts the core.
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    IWDG1.kr().write(|w| w.set_key(Key::START));
    IWDG1.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG1.pr().write(|w| w.set_pr(WATCHDOG_DIVIDER));
}

fn feed() {
    IWDG1.kr().write(|w| w.set_key(Key::RESET));
}

/// Feeds the watchdog from thread mode.
#[embassy_executor::task]
pub async fn feed_watchdog() {
    loop {
        feed();
        starts::look();
        seeded_bugs::fail_late();
        Timer::after(FEED_PERIOD).await;
    }
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    failure::record_interrupt(number);
    defmt::error!("interrupt {=i16} has no handler", number);
    SCB::sys_reset()
}
