//! The camera in use: that of the board. Each is one file, and one with its registers, with the
//! same names.

mod bus;
mod identity;
pub use bus::Bus;
pub use identity::Error;

#[cfg(feature = "board-openmv-h7")]
mod mt9v034;
#[cfg(feature = "board-openmv-h7")]
mod mt9v034_registers;
#[cfg(feature = "board-openmv-h7")]
pub use {mt9v034::*, mt9v034_registers::Format};

#[cfg(feature = "board-weact")]
mod ov7725;
#[cfg(feature = "board-weact")]
mod ov7725_registers;
#[cfg(feature = "board-weact")]
pub use {ov7725::*, ov7725_registers::Format};

use crate::shared::EXPOSURE_MIDDLE_US;
use core::sync::atomic::Ordering;
use hivtac_terms::geometry::Geometry;

/// Lens, frame and markers of the sensor with this camera.
pub const GEOMETRY: Geometry = Geometry::preset(PRESET, WIDTH, HEIGHT);

/// From the VSYNC edge that begins a frame to the middle of its middle row's exposure, µs. Negative
/// where that was before.
pub fn exposure_middle_us() -> i32 {
    EXPOSURE_MIDDLE_US.load(Ordering::Relaxed)
}
