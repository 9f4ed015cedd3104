//! The microcontroller's own loader, which takes new firmware over USB (DFU): started on request.
//!
//! # Design
//! The loader expects the part as a reset leaves it. So a word in memory asks for it, and the
//! program resets the part: `start.s` looks for that word before anything else.

use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::SCB;
use embassy_time::{Duration, Timer};

/// "DFU!" in ASCII; `start.s` has it, too.
const WANTED: u32 = 0x2155_4644;
/// Until the reply has left.
const REPLY_TIME: Duration = Duration::from_millis(100);

/// Nothing initializes it: it outlives a reset.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.loader")]
static LOADER_WANTED: AtomicU32 = AtomicU32::new(0);

/// Starts the loader, once the host has had its reply.
pub async fn start() -> ! {
    Timer::after(REPLY_TIME).await;
    LOADER_WANTED.store(WANTED, Ordering::Relaxed);
    cortex_m::asm::dsb();
    SCB::sys_reset()
}
