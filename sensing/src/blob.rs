//! Blobs: 8-connected runs with exact integer moments.

use crate::{runs::Run, units::Px};

/// The moments of one blob, in whole pixels.
///
/// They are exact for every frame of at most 800 × 800 pixels, the largest that the scanner takes. There, columns and
/// rows are at most 799 and a blob has at most 640,000 pixels: Σx² ≤ 640,000 · 799² < 2³⁹. What one run adds fits
/// `u32`: at most 800 · 799² < 2²⁹, and 799 · 800 · 1599 < 2³⁰ on the way to it.
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

/// Second moments of a blob about its centroid, multiplied by its area so that they are whole numbers.
/// The variance along x, in px², is `xx / area²`.
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
    /// Σx · 2¹⁶ ≤ 640,000 · 799 · 2¹⁶ < 2⁴⁵.
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

/// 0² + 1² + … + (n − 1)² for n ≤ 800: the product before the division is at most 799 · 800 · 1599 < 2³⁰.
const fn squares_below(n: u32) -> u32 {
    if n == 0 {
        0
    } else {
        (n - 1) * n * (2 * n - 1) / 6
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A blob of some runs of the largest frame.
    fn blobs() -> impl Strategy<Value = Blob> {
        prop::collection::vec((0..800_u16, 0..800_u16, 0..800_u16), 1..20).prop_map(|runs| {
            let blob = |(a, b, y): (u16, u16, u16)| {
                let (x0, x1) = (a.min(b), a.max(b));
                Blob::of_run(Run { x0, x1 }, y)
            };
            let mut runs = runs.into_iter().map(blob);
            let first = runs.next().unwrap();
            runs.fold(first, |mut sum, run| {
                sum.add(&run);
                sum
            })
        })
    }

    proptest! {
        #[test]
        fn a_run_sums_its_pixels(a in 0..800_u16, b in 0..800_u16, y in 0..800_u16) {
            let (x0, x1) = (a.min(b), a.max(b));
            let blob = Blob::of_run(Run { x0, x1 }, y);
            let total = |f: fn(u64, u64) -> u64| (x0..=x1).map(|x| f(x.into(), y.into())).sum::<u64>();
            prop_assert_eq!(u64::from(blob.area), total(|_, _| 1));
            prop_assert_eq!((blob.sum_x, blob.sum_y), (total(|x, _| x), total(|_, y| y)));
            prop_assert_eq!((blob.sum_xx, blob.sum_yy), (total(|x, _| x * x), total(|_, y| y * y)));
            prop_assert_eq!(blob.sum_xy, total(|x, y| x * y));
            prop_assert_eq!((blob.x0, blob.y0, blob.x1, blob.y1), (x0, y, x1, y));
        }

        #[test]
        fn a_centroid_is_off_by_half_a_step_at_most(blob in blobs()) {
            let (x, y) = blob.centroid();
            for (mean, sum) in [(x, blob.sum_x), (y, blob.sum_y)] {
                let exact = i128::from(sum) << 16;
                let error = i128::from(mean.0) * i128::from(blob.area) - exact;
                prop_assert!(2 * error.abs() <= i128::from(blob.area));
            }
        }

        #[test]
        fn central_moments_do_not_overflow(blob in blobs()) {
            let [area, x, y, xx, xy, yy] =
                [blob.area.into(), blob.sum_x, blob.sum_y, blob.sum_xx, blob.sum_xy, blob.sum_yy].map(i128::from);
            let moments = blob.central_moments();
            prop_assert_eq!(i128::from(moments.xx), area * xx - x * x);
            prop_assert_eq!(i128::from(moments.xy), area * xy - x * y);
            prop_assert_eq!(i128::from(moments.yy), area * yy - y * y);
        }
    }
}
