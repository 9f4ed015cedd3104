//! Counts and time-stamps the camera's VSYNC edges.
//!
//! The counted edge is the one that ends the vertical blanking: DCMI begins a frame at the same
//! edge. DCMI reports a frame as finished at the *other* edge, when blanking begins. So from a
//! frame's first row until then, the newest counted edge is the one that began it, however late a
//! handler looks within that time.

use core::cell::Cell;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::{self, EXTI, SYSCFG};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_time::Instant;
use hivtac_portable::capture::Edge;

/// The newest edge. Written by the handler below, and set to zero by the capture task; read by the
/// capture handlers, the capture task, the pipeline and the USB tasks.
static NEWEST_EDGE: CriticalSectionMutex<Cell<Edge>> = CriticalSectionMutex::new(Cell::new(Edge {
    number: 0,
    time_us: 0,
}));

/// The VSYNC pin is PB7 on every board with this camera connector.
const LINE: usize = 7;
const PORT_B: u8 = 1;

/// Begins to count edges. The pin itself is set up with the camera interface's pins: EXTI sees it
/// in any function. `blanking_is_high` is the level of the line during vertical blanking.
pub fn start(blanking_is_high: bool) {
    SYSCFG
        .exticr(LINE / 4)
        .modify(|w| w.set_exti(LINE % 4, PORT_B));
    critical_section::with(|_| {
        EXTI.ftsr(0).modify(|w| w.set_line(LINE, blanking_is_high));
        EXTI.rtsr(0).modify(|w| w.set_line(LINE, !blanking_is_high));
        pac::EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    });
    interrupt::EXTI9_5.unpend();
    // SAFETY: the handler below shares only `NEWEST_EDGE`, behind a mutex.
    unsafe { interrupt::EXTI9_5.enable() };
}

/// Returns the newest edge; number 0 before the first one.
pub fn newest() -> Edge {
    NEWEST_EDGE.lock(Cell::get)
}

/// Restarts the count from zero: the next edge gets number 1.
pub fn restart_count() {
    NEWEST_EDGE.lock(|newest| newest.set(Edge::default()));
}

#[embassy_stm32::interrupt]
fn EXTI9_5() {
    let pending = EXTI.pr(0);
    pending.write(|w| w.set_line(LINE, true));
    // The bus delays writes. If this handler returned before the line falls, it would run twice and
    // count an edge that did not occur; a read waits for the write.
    let _ = pending.read();
    let time_us = Instant::now().as_micros();
    NEWEST_EDGE.lock(|newest| {
        let number = newest.get().number.wrapping_add(1);
        newest.set(Edge { number, time_us });
    });
}
