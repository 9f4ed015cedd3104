//! Defines markers: the dots as an image shows them.

use crate::list::List;
use crate::units::Px;

/// Fewest markers of a layout: a contact has five unknowns.
pub const LEAST_MARKERS: usize = 4;

/// Most markers of a layout.
pub const MOST_MARKERS: usize = 16;

/// The markers of a frame, in the order of their identities.
pub type MarkerList = List<Marker, MOST_MARKERS>;

/// One of the dots. Its index is its identity, in the order of the layout. With four dots: 0 upper
/// left, 1 upper right, 2 lower right, 3 lower left, as seen in the image.
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
