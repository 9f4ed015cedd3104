//! The camera in use: that of the board. Each is one file, and one with its registers, with the
//! same names.

mod bus;
mod identity;
mod registers;
pub use bus::Bus;
pub use identity::Error;
pub use registers::Comparison;

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

/// What a camera is set to.
pub struct Setting {
    /// The number by which it says what it is.
    pub id: u16,
    /// Its registers beside what was written.
    pub comparison: Comparison,
    /// How long a row is exposed, µs.
    pub exposure_us: u32,
    /// The longest that it can be, µs.
    pub longest_exposure_us: u32,
    /// Its gain, sixteenths.
    pub gain_sixteenths: u16,
}

/// From the VSYNC edge that begins a frame to the middle of its middle row's exposure, µs. Negative
/// where that was before.
pub fn exposure_middle_us() -> i32 {
    EXPOSURE_MIDDLE_US.load(Ordering::Relaxed)
}
