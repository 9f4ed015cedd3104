//! The camera in use. A second camera is one more file with the same names.

mod ov7725;
mod ov7725_registers;
mod sccb;
pub use ov7725::*;
pub use ov7725_registers::Format;
pub use sccb::Sccb;

use hivtac_terms::geometry::Geometry;

/// Lens, frame and markers of the sensor with this camera.
pub const GEOMETRY: Geometry = Geometry::preset(PRESET, WIDTH, HEIGHT);
