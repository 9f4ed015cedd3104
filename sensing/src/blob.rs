//! Blobs: 8-connected runs with exact integer moments.

use crate::{runs::Run, units::Px};

/// The moments of one blob, in whole pixels.
///
/// They are exact for every frame of at most 800 × 800 pixels, the largest that the scanner takes. There, columns and
/// rows are at most 799 and a blob has at most 640,000 pixels, so that Σx² ≤ 640,000 · 799² < 2³⁹; what one run adds is
/// at most 800 · 799² < 2²⁹, and on the way to it Σx² of a run is 6 times as large, < 2³².
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

/// Second moments of a blob about its centroid, times its area: whole numbers, in px⁴ of an area in px².
/// The variance along x is `xx / area²`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CentralMoments {
    /// area · Σ(x − x̄)² = area · Σx² − (Σx)².
    pub xx: i64,
    /// area · Σ(x − x̄)(y − ȳ) = area · Σxy − Σx · Σy.
    pub xy: i64,
    /// area · Σ(y − ȳ)² = area · Σy² − (Σy)².
    pub yy: i64,
}

impl Blob {
    /// The blob of one run in row `y`, with columns and row below 800.
    pub(crate) fn of_run(run: Run, y: u16) -> Blob {
        let (x0, x1, row) = (u32::from(run.x0), u32::from(run.x1), u32::from(y));
        let area = x1 - x0 + 1;
        let sum_x = area * (x0 + x1) / 2;
        Blob {
            area,
            sum_x: u64::from(sum_x),
            sum_y: u64::from(area * row),
            sum_xx: u64::from(squares_below(x1 + 1) - squares_below(x0)),
            sum_xy: u64::from(sum_x * row),
            sum_yy: u64::from(area * row * row),
            x0: run.x0,
            y0: y,
            x1: run.x1,
            y1: y,
        }
    }

    /// Adds the pixels of another blob of the same frame that shares none with this one.
    pub(crate) fn add(&mut self, other: &Blob) {
        self.area += other.area;
        self.sum_x += other.sum_x;
        self.sum_y += other.sum_y;
        self.sum_xx += other.sum_xx;
        self.sum_xy += other.sum_xy;
        self.sum_yy += other.sum_yy;
        self.x0 = self.x0.min(other.x0);
        self.y0 = self.y0.min(other.y0);
        self.x1 = self.x1.max(other.x1);
        self.y1 = self.y1.max(other.y1);
    }

    /// The centroid (x, y), each rounded to the nearest step of Q16.16: off by at most 1/131,072 px.
    /// Σx · 2¹⁶ < 2⁴⁶.
    pub fn centroid(&self) -> (Px, Px) {
        let area = u64::from(self.area.max(1));
        let mean = |sum: u64| Px((((sum << Px::FRACTION_BITS) + area / 2) / area) as i32);
        (mean(self.sum_x), mean(self.sum_y))
    }

    /// The second moments about the centroid, exact: each product is at most 640,000² · 799² < 2⁵⁸.
    pub fn central_moments(&self) -> CentralMoments {
        let area = i64::from(self.area);
        let (x, y) = (self.sum_x as i64, self.sum_y as i64);
        CentralMoments {
            xx: area * self.sum_xx as i64 - x * x,
            xy: area * self.sum_xy as i64 - x * y,
            yy: area * self.sum_yy as i64 - y * y,
        }
    }
}

/// 0² + 1² + … + (n − 1)² for n ≤ 800: the product before the division is at most 799 · 800 · 1599 < 2³².
const fn squares_below(n: u32) -> u32 {
    if n == 0 {
        0
    } else {
        (n - 1) * n * (2 * n - 1) / 6
    }
}
