//! Blobs: 8-connected runs with exact integer moments.

/// The moments of one blob, in whole pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Blob {
    /// Number of pixels.
    pub area: u32,
    /// Σx.
    pub sum_x: u64,
    /// Σy.
    pub sum_y: u64,
    /// Σx².
    pub sum_xx: u64,
    /// Σxy.
    pub sum_xy: u64,
    /// Σy².
    pub sum_yy: u64,
    /// Leftmost column.
    pub x0: u16,
    /// Topmost row.
    pub y0: u16,
    /// Rightmost column (inclusive).
    pub x1: u16,
    /// Lowest row (inclusive).
    pub y1: u16,
}
