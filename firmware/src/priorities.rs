//! Sets all interrupt priorities of the program: which task may interrupt which.
//!
//! | priority | who | why there |
//! |---|---|---|
//! | 0 | VSYNC edge | its time stamp is the frame's time |
//! | 1 | DCMI and its DMA | a band takes the number of the newest VSYNC edge; neither interrupts the other |
//! | 2 | time driver | wakes the tasks below |
//! | 3 | capture task | sets the camera up while nothing else works |
//! | 4 | USB core, DMA of the UART | moves packets between its FIFOs and memory; signals that a frame was sent |
//! | 5 | USB tasks | answer the host while a frame is being processed |
//! | thread | processing, health | takes milliseconds and may be interrupted by all above |

use crate::seeded_bugs;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};

/// Interrupt whose vector runs the capture executor. The UART itself is not used.
pub const CAPTURE_EXECUTOR: interrupt::Interrupt = interrupt::UART4;
/// Interrupt whose vector runs the USB executor. The UART itself is not used.
pub const USB_EXECUTOR: interrupt::Interrupt = interrupt::UART5;

/// Priority of DCMI and its DMA, which is set during their set-up.
pub const CAPTURE: Priority = Priority::P1;

/// Priority of the HAL's DMA: the UART's.
pub const DMA: Priority = Priority::P4;

/// Sets every other priority. Call once, before any of these interrupts is enabled.
pub fn set() {
    interrupt::EXTI9_5.set_priority(if seeded_bugs::lowers_vsync() {
        Priority::P4
    } else {
        Priority::P0
    });
    interrupt::TIM2.set_priority(Priority::P2);
    CAPTURE_EXECUTOR.set_priority(Priority::P3);
    interrupt::OTG_FS.set_priority(Priority::P4);
    USB_EXECUTOR.set_priority(Priority::P5);
}
