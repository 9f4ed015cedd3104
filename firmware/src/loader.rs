//! Starts the microcontroller's own loader on request, which receives new firmware over USB (DFU).
//!
//! # Design
//! The loader expects the microcontroller in its state after a reset. So the program writes a
//! request into memory and resets: `first_stage.s` checks for that word before anything else. An
//! update does not write the first stage, so the word's place and value are part of the flash's
//! layout.

use crate::failure;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::SCB;
use embassy_time::{Duration, Timer};

/// "DFU!" in ASCII, as in `first_stage.s`.
const WANTED: u32 = 0x2155_4644;
/// Time until the reply has left.
const REPLY_TIME: Duration = Duration::from_millis(100);

/// It is not initialized, so it survives a reset.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".kept.wanted")]
static LOADER_WANTED: AtomicU32 = AtomicU32::new(0);

/// Starts the loader, after the host has received its reply.
pub async fn start() -> ! {
    Timer::after(REPLY_TIME).await;
    failure::forget();
    LOADER_WANTED.store(WANTED, Ordering::Relaxed);
    cortex_m::asm::dsb();
    SCB::sys_reset()
}
