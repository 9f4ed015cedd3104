//! Counts and time-stamps the camera's VSYNC edges.
//!
//! The counted edge is the one that ends the vertical blanking: DCMI begins a frame at the same
//! edge. It says that a frame is finished at the *other* edge, when blanking begins. So from a
//! frame's first row until then the newest counted edge is the one that began it, however late a
//! handler looks within that time.

use core::cell::Cell;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::{self, EXTI, SYSCFG};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_time::Instant;
use hivtac_capture::Edge;

/// The newest edge. Written by the handler below, and set to zero by the capture task; read by the
/// capture handlers, the capture task, the pipeline and the USB tasks.
static NEWEST_EDGE: CriticalSectionMutex<Cell<Edge>> = CriticalSectionMutex::new(Cell::new(Edge {
    number: 0,
    time_us: 0,
}));

/// The VSYNC pin is PB7 on every board with this camera connector.
const LINE: usize = 7;
const PORT_B: u8 = 1;

/// Begins to listen. The pin itself is set up with the camera interface's pins: EXTI sees it
/// whatever its function. The level is that of the line during vertical blanking.
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

/// The newest edge; number 0 when there was none yet.
pub fn newest() -> Edge {
    NEWEST_EDGE.lock(Cell::get)
}

/// Begins to count from zero: the next edge gets number 1.
pub fn restart_count() {
    NEWEST_EDGE.lock(|newest| newest.set(Edge::default()));
}

#[embassy_stm32::interrupt]
fn EXTI9_5() {
    let pending = EXTI.pr(0);
    pending.write(|w| w.set_line(LINE, true));
    // The bus takes a write and delivers it later. Before the line falls this handler must not
    // return, or it runs twice and counts an edge that there was not; a read waits for the write.
    let _ = pending.read();
    let time_us = Instant::now().as_micros();
    NEWEST_EDGE.lock(|newest| {
        let number = newest.get().number.wrapping_add(1);
        newest.set(Edge { number, time_us });
    });
}
