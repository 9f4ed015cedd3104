//! Holds a blob: 8-connected runs with exact integer moments.

use crate::markers::beside::Beside;
#[cfg(test)]
use crate::markers::{moments::Moments, runs::Run, tables::Weights};
use hivtac_terms::division::Divisor;
use hivtac_terms::units::Px;

/// The moments of one blob, in whole pixels.
///
/// They are exact for every frame of at most 800 × 800 pixels, the largest that the scanner takes.
/// Columns and rows are at most 799, and a blob has at most 640,000 pixels: Σx³ ≤ 640,000 · 799³ <
/// 2⁴⁹. A weight is at most 127: Σw ≤ 640,000 · 127 < 2²⁷ and Σw·x ≤ 2²⁷ · 799 < 2³⁷.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Blob {
    /// Number of pixels.
    pub area: u32,
    /// Number of pixels that passed the threshold themselves; dilation added the others. At most
    /// `area`.
    pub passed: u32,
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
    /// Σx³.
    pub sum_xxx: u64,
    /// Σx²y.
    pub sum_xxy: u64,
    /// Σxy².
    pub sum_xyy: u64,
    /// Σy³.
    pub sum_yyy: u64,
    /// Σw, w being a pixel's weight ([`Pixels::weight`](crate::markers::tables::Pixels::weight)); 0
    /// if pixels are not weighed.
    pub weight: u32,
    /// Σw·x.
    pub weight_x: u64,
    /// Σw·y.
    pub weight_y: u64,
    /// The film next to it; [`Beside::NONE`] if pixels are not weighed.
    pub beside: Beside,
    /// Leftmost column.
    pub x0: u16,
    /// Topmost row.
    pub y0: u16,
    /// Rightmost column (inclusive).
    pub x1: u16,
    /// Lowest row (inclusive).
    pub y1: u16,
}

impl Blob {
    /// The blob of one run in row `y`, with columns and row below 800, and its weights. All its
    /// pixels passed the threshold.
    #[cfg(test)]
    pub(crate) fn of_run(run: Run, y: u16, weights: Weights) -> Blob {
        let mut moments = Moments::of_run(run, y);
        moments.weigh(weights, y);
        moments.passed = moments.area;
        moments.blob()
    }

    /// Adds the pixels of another blob of the same frame; the two must not overlap.
    #[cfg(test)]
    pub(crate) fn add(&mut self, other: &Blob) {
        self.area += other.area;
        self.passed += other.passed;
        self.sum_x += other.sum_x;
        self.sum_y += other.sum_y;
        self.sum_xx += other.sum_xx;
        self.sum_xy += other.sum_xy;
        self.sum_yy += other.sum_yy;
        self.sum_xxx += other.sum_xxx;
        self.sum_xxy += other.sum_xxy;
        self.sum_xyy += other.sum_xyy;
        self.sum_yyy += other.sum_yyy;
        self.weight += other.weight;
        self.weight_x += other.weight_x;
        self.weight_y += other.weight_y;
        self.beside.add(&other.beside);
        self.x0 = self.x0.min(other.x0);
        self.y0 = self.y0.min(other.y0);
        self.x1 = self.x1.max(other.x1);
        self.y1 = self.y1.max(other.y1);
    }

    /// Returns the centroid (x, y), each rounded to the nearest step of Q16.16: its error is at
    /// most 1/131,072 px. Σx · 2¹⁶ ≤ 640,000 · 799 · 2¹⁶ < 2⁴⁵.
    pub fn centroid(&self) -> (Px, Px) {
        let area = Divisor::new(self.area);
        let mean = |sum| mean(sum, self.area.max(1), &area);
        (mean(self.sum_x), mean(self.sum_y))
    }

    /// Returns the weighted centroid (x, y), rounded in the same way; `None` without weights. Σw·x
    /// · 2¹⁶ < 2⁵³.
    pub fn weighted_centroid(&self) -> Option<(Px, Px)> {
        if self.weight == 0 {
            return None;
        }
        let weight = Divisor::new(self.weight);
        let mean = |sum| mean(sum, self.weight, &weight);
        Some((mean(self.weight_x), mean(self.weight_y)))
    }
}

/// A mean rounded to the nearest step of Q16.16; `by` divides by `count` ≥ 1.
fn mean(sum: u64, count: u32, by: &Divisor) -> Px {
    Px(by.quotient((sum << Px::FRACTION_BITS) + u64::from(count / 2)) as i32)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A blob of several runs of the largest frame.
    fn blobs() -> impl Strategy<Value = Blob> {
        prop::collection::vec((0..800_u16, 0..800_u16, 0..800_u16), 1..20).prop_map(|runs| {
            let blob = |(a, b, y): (u16, u16, u16)| {
                let (x0, x1) = (a.min(b), a.max(b));
                Blob::of_run(Run { x0, x1 }, y, Weights::NONE)
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
            let weights = Weights { sum: 3, sum_x: 5 };
            let blob = Blob::of_run(Run { x0, x1 }, y, weights);
            let total = |f: fn(u64, u64) -> u64| {
                (x0..=x1).map(|x| f(x.into(), y.into())).sum::<u64>()
            };
            prop_assert_eq!(u64::from(blob.area), total(|_, _| 1));
            prop_assert_eq!((blob.sum_x, blob.sum_y), (total(|x, _| x), total(|_, y| y)));
            prop_assert_eq!((blob.sum_xx, blob.sum_yy), (total(|x, _| x * x), total(|_, y| y * y)));
            prop_assert_eq!(blob.sum_xy, total(|x, y| x * y));
            prop_assert_eq!(
                (blob.sum_xxx, blob.sum_yyy),
                (total(|x, _| x * x * x), total(|_, y| y * y * y))
            );
            prop_assert_eq!(
                (blob.sum_xxy, blob.sum_xyy),
                (total(|x, y| x * x * y), total(|x, y| x * y * y))
            );
            let row = u64::from(y);
            prop_assert_eq!((blob.weight, blob.weight_x, blob.weight_y), (3, 5, 3 * row));
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
    }
}
