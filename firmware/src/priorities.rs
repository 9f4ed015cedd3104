//! Who may interrupt whom: the whole program's interrupt priorities in one place.
//!
//! | priority | who | why there |
//! |---|---|---|
//! | 0 | VSYNC edge | its time stamp is the frame's time |
//! | 1 | DCMI events | a finished frame takes the number of the newest VSYNC edge |
//! | 2 | time driver | wakes the tasks below |
//! | 3 | capture task | must arm the next frame within the camera's vertical blanking |
//! | 4 | USB core | moves packets between its FIFOs and memory |
//! | 5 | USB tasks | answer the host while a frame is being processed |
//! | thread | processing, health | takes milliseconds and may be interrupted by all above |

use embassy_stm32::interrupt::{self, InterruptExt, Priority};

/// Interrupt whose vector runs the capture executor. The UART itself is not used.
pub const CAPTURE_EXECUTOR: interrupt::Interrupt = interrupt::UART4;
/// Interrupt whose vector runs the USB executor. The UART itself is not used.
pub const USB_EXECUTOR: interrupt::Interrupt = interrupt::UART5;

/// Sets every priority. Call once, before any of these interrupts is enabled.
pub fn set() {
    interrupt::EXTI9_5.set_priority(Priority::P0);
    interrupt::DCMI.set_priority(Priority::P1);
    interrupt::TIM2.set_priority(Priority::P2);
    CAPTURE_EXECUTOR.set_priority(Priority::P3);
    interrupt::OTG_FS.set_priority(Priority::P4);
    USB_EXECUTOR.set_priority(Priority::P5);
}
