//! What the sensing needs to know of lens and markers to tell a marker from another red thing.

use crate::units::Px;

/// Lens, frame and marker geometry (`docs/architecture.md`, presets).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Geometry {
    /// Columns of a frame.
    pub width: u16,
    /// Rows of a frame.
    pub height: u16,
    /// Focal length of the equidistant lens (r = f·θ), in pixels.
    pub focal: Px,
}
