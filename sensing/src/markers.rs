//! Four markers out of the blobs: correct or rejected, never silently wrong.

use crate::{blob::Blob, geometry::Geometry, model::Rest, status::Status, units::Px};

/// One of the four dots. Its identity is its index: 0 upper left, 1 upper right, 2 lower right, 3 lower left
/// as the image shows them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Marker {
    /// Centroid, column.
    pub x: Px,
    /// Centroid, row.
    pub y: Px,
    /// Pixels in the mask, after dilation.
    pub area: u32,
}

/// Finds the markers of one frame after another.
#[derive(Clone, Copy, Debug)]
pub struct Finder {
    smallest: u32,
}

impl Finder {
    /// For a geometry and, when one is known, the rest position.
    pub fn new(geometry: &Geometry, rest: Option<&Rest>) -> Finder {
        let area = rest.map_or(geometry.rest_area(), |rest| {
            rest.areas.iter().sum::<u32>() / 4
        });
        Finder { smallest: area / 2 }
    }

    /// The four markers among `blobs`.
    ///
    /// # Errors
    /// The status bit that says why there are none.
    pub fn find(&self, blobs: &[Blob]) -> Result<[Marker; 4], Status> {
        let mut large = blobs.iter().filter(|blob| blob.area >= self.smallest);
        let mut found = [Marker::default(); 4];
        for slot in &mut found {
            let blob = large.next().ok_or(Status::MARKERS_MISSING)?;
            let (x, y) = blob.centroid();
            *slot = Marker {
                x,
                y,
                area: blob.area,
            };
        }
        if large.next().is_some() {
            return Err(Status::MARKERS_AMBIGUOUS);
        }
        found.sort_unstable_by_key(|marker| marker.y);
        found[..2].sort_unstable_by_key(|marker| marker.x);
        found[2..].sort_unstable_by_key(|marker| core::cmp::Reverse(marker.x));
        Ok(found)
    }
}
