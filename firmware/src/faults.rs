//! Handles faults: reports them if possible, and restarts.
//!
//! | what | ends in |
//! |---|---|
//! | panic | a line on the debug probe, then a hard fault (`panic-probe`) |
//! | hard fault: stack overflow, wild pointer, panic | reset at once, touching neither stack nor memory |
//! | interrupt without a handler | reset |
//! | thread mode stands still for 2 s, or the core is locked up | reset by the watchdog |

use core::sync::atomic::{AtomicU8, Ordering};
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use embassy_stm32::pac::{DBGMCU, RCC};
use embassy_stm32::peripherals::IWDG1;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Timer};
use hivtac_wire::health::ResetReason;
use panic_probe as _;

/// Why the microcontroller started, a `ResetReason`. Written at boot; read by the memory task.
static RESET_REASON: AtomicU8 = AtomicU8::new(ResetReason::Other as u8);

/// A quarter of the watchdog's time.
const FEED_PERIOD: Duration = Duration::from_millis(500);

/// Logs why the microcontroller was reset, keeps that for the host, and clears the reasons.
pub fn report_reset() {
    let reasons = RCC.rsr().read();
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
    defmt::info!(
        "reset: power {=bool}, pin {=bool}, software or fault {=bool}, watchdog {=bool}",
        reasons.porrstf(),
        reasons.pinrstf(),
        reasons.sftrstf(),
        reasons.iwdg1rstf()
    );
    RCC.rsr().modify(|w| w.set_rmvf(true));
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

/// Starts the watchdog and feeds it from thread mode. It resets the program if tasks of higher
/// priority never let thread mode run.
#[embassy_executor::task]
pub async fn feed_watchdog(mut watchdog: IndependentWatchdog<'static, IWDG1>) {
    // The watchdog stops while a debugger halts the core.
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    watchdog.unleash();
    loop {
        watchdog.pet();
        Timer::after(FEED_PERIOD).await;
    }
}

#[exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    // After a stack overflow no data may be pushed.
    SCB::sys_reset()
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    defmt::error!("interrupt {=i16} has no handler", number);
    SCB::sys_reset()
}
