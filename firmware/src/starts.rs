//! Reports good starts to the first stage, and takes the reset reason over from it.
//!
//! # Design `first_stage.s` counts the starts in a row that ended in a reset by the program itself
//! or by the watchdog. After four of them it starts the loader, so that a program that fails before
//! it serves USB can be replaced without opening the housing. A start is good as soon as a host
//! said hello, since that host can start the loader. Without a host it is good after [`GOOD_AFTER`]
//! in thread mode. Power-on, a low supply and the reset line begin the count anew.

use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::pac::RCC;
use embassy_stm32::pac::rcc::regs::Rsr;
use embassy_time::{Duration, Instant};

/// A start that lasts for this time is good.
const GOOD_AFTER: Duration = Duration::from_secs(5);
/// Marks a count, which its low byte has, as in `first_stage.s`: "ST" in ASCII.
const MARK: u32 = 0x5354_0000;
/// The flags of RCC_RSR that have a cause.
const CAUSES: u32 = 0x55FA_0000;

/// The failed starts in a row, and the flags of RCC_RSR at this start. It is not initialized.
/// Written by the first stage, by boot and by whoever finds the start good; read by the first stage
/// and at boot.
#[unsafe(link_section = ".kept.starts")]
static STARTS: Starts = Starts {
    failed: AtomicU32::new(0),
    flags: AtomicU32::new(0),
};

#[repr(C)]
struct Starts {
    failed: AtomicU32,
    flags: AtomicU32,
}

/// Returns why the microcontroller started, and clears it. The first stage has moved the flags
/// already, unless a debug probe started the program.
pub fn reset_flags() -> Rsr {
    let moved = STARTS.flags.swap(0, Ordering::Relaxed);
    let is_moved = STARTS.failed.load(Ordering::Relaxed) & 0xFFFF_0000 == MARK;
    let now = RCC.rsr().read();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    match now.0 & CAUSES {
        0 if is_moved => Rsr(moved),
        _ => now,
    }
}

/// Notes that this start is good.
pub fn good() {
    STARTS.failed.store(MARK, Ordering::Relaxed);
}

/// Notes so once the start has lasted long enough. Call from thread mode from time to time.
pub fn look() {
    if Instant::now() >= Instant::MIN + GOOD_AFTER {
        good();
    }
}
