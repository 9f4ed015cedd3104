//! The paper's eleven features (Section 5).

use crate::units::Px;

/// x = [x0, y0, x1, y1, x2, y2, x3, y3, x_rect, y_rect, Area_rect].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Features {
    /// Centroids of markers 0–3, (x, y).
    pub centroids: [(Px, Px); 4],
    /// Centre of their bounding rectangle over the real-valued centroids, (x, y).
    pub rect_center: (Px, Px),
    /// Its area in px², Q16.16 in 64 bits (it overflows 32 bits from VGA up).
    pub rect_area: i64,
}
