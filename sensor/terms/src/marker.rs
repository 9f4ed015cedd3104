//! Defines markers: the four dots as an image shows them.

use crate::units::Px;

/// Most markers of a layout.
pub const MOST_MARKERS: usize = 16;

/// One of the four dots. Its index is its identity: 0 upper left, 1 upper right, 2 lower right, 3
/// lower left, as seen in the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Marker {
    /// Centroid, column.
    pub x: Px,
    /// Centroid, row.
    pub y: Px,
    /// Number of pixels in the mask, after dilation.
    pub area: u32,
}
