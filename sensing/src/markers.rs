//! Four markers out of the blobs: correct or rejected, never silently wrong.

use crate::units::Px;

/// One of the four dots. Its identity is its index: 0 upper left, 1 upper right, 2 lower right, 3 lower left
/// as the image shows them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Marker {
    /// Centroid, column.
    pub x: Px,
    /// Centroid, row.
    pub y: Px,
    /// Pixels in the mask, after dilation.
    pub area: u32,
}
