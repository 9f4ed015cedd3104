//! Sums the moments of a blob run by run. Multiples of the moments are stored, which cost the
//! fewest instructions per run.

use crate::markers::beside::Beside;
use crate::markers::blob::Blob;
use crate::markers::runs::Run;
use crate::markers::tables::Weights;

/// Moments over the runs of a blob, each of n pixels in row y with c = x0 + x1. Exact within 800 ×
/// 800 pixels:
///
/// - Σx of a run is n·c / 2, Σx² is n·(3c² + n² − 1) / 12, and Σx³ is n·c·(c² + n² − 1) / 8.
/// - For one run, these multiples fit `u32` before they are multiplied with a power of y: c ≤ 1599
///   − n, so that n·c < 2²⁰ and n·(3c² + n² − 1) < 2³¹. So does n·y < 2²⁰.
/// - Of a blob, twelve times Σx²·y is the largest: less than 12 · 2⁴⁹.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    /// Σ1.
    pub area: u32,
    /// Σ1 over the pixels that were set before dilation.
    pub passed: u32,
    /// 2 Σx ≤ 2 · 640,000 · 799 < 2³⁰.
    x: u32,
    /// Σy.
    y: u32,
    /// 12 Σx².
    xx: u64,
    /// 2 Σxy.
    xy: u64,
    /// Σy².
    yy: u64,
    /// 8 Σx³.
    xxx: u64,
    /// 12 Σx²y.
    xxy: u64,
    /// 2 Σxy².
    xyy: u64,
    /// Σy³.
    yyy: u64,
    weight: u32,
    weight_x: u64,
    weight_y: u64,
    /// The film next to its even rows.
    pub beside: Beside,
    x0: u16,
    y0: u16,
    x1: u16,
    /// Lowest row.
    pub y1: u16,
}

impl Moments {
    const NONE: Moments = Moments {
        area: 0,
        passed: 0,
        x: 0,
        y: 0,
        xx: 0,
        xy: 0,
        yy: 0,
        xxx: 0,
        xxy: 0,
        xyy: 0,
        yyy: 0,
        weight: 0,
        weight_x: 0,
        weight_y: 0,
        beside: Beside::NONE,
        x0: u16::MAX,
        y0: u16::MAX,
        x1: 0,
        y1: 0,
    };

    /// The sums of one run in row `y`.
    #[inline(always)]
    pub fn of_run(run: Run, y: u16) -> Moments {
        let mut sums = Moments {
            y0: y,
            ..Moments::NONE
        };
        sums.add_run(run, y);
        sums
    }

    /// Adds a run in row `y`, which must be the lowest row so far or the one below it.
    #[inline(always)]
    pub fn add_run(&mut self, run: Run, y: u16) {
        let (x0, x1, row) = (u32::from(run.x0), u32::from(run.x1), u32::from(y));
        let (n, c) = (x1 - x0 + 1, x0 + x1);
        let (x, cc) = (n * c, c * c);
        let square = cc + n * n - 1;
        let xx = n * (square + 2 * cc);
        let rows = n * row;
        let product = |a: u32, b: u32| u64::from(a) * u64::from(b);
        self.area += n;
        self.x += x;
        self.y += rows;
        self.xx += u64::from(xx);
        self.xy += product(x, row);
        self.yy += product(rows, row);
        self.xxx += product(x, square);
        self.xxy += product(xx, row);
        self.xyy += product(x, row * row);
        self.yyy += product(rows, row * row);
        self.x0 = self.x0.min(run.x0);
        self.x1 = self.x1.max(run.x1);
        self.y1 = y;
    }

    /// Adds the weights of pixels in row `y`, which must have been added before.
    #[inline(always)]
    pub fn weigh(&mut self, weights: Weights, y: u16) {
        self.weight += weights.sum;
        self.weight_x += u64::from(weights.sum_x);
        self.weight_y += u64::from(weights.sum) * u64::from(y);
    }

    /// Adds the sums of a part of the same blob.
    pub fn add(&mut self, other: &Moments) {
        self.area += other.area;
        self.passed += other.passed;
        self.x += other.x;
        self.y += other.y;
        self.xx += other.xx;
        self.xy += other.xy;
        self.yy += other.yy;
        self.xxx += other.xxx;
        self.xxy += other.xxy;
        self.xyy += other.xyy;
        self.yyy += other.yyy;
        self.weight += other.weight;
        self.weight_x += other.weight_x;
        self.weight_y += other.weight_y;
        self.beside.add(&other.beside);
        self.x0 = self.x0.min(other.x0);
        self.y0 = self.y0.min(other.y0);
        self.x1 = self.x1.max(other.x1);
        self.y1 = self.y1.max(other.y1);
    }

    /// Returns the moments themselves.
    pub fn blob(&self) -> Blob {
        Blob {
            area: self.area,
            passed: self.passed,
            sum_x: u64::from(self.x / 2),
            sum_y: u64::from(self.y),
            sum_xx: twelfth(self.xx),
            sum_xy: self.xy / 2,
            sum_yy: self.yy,
            sum_xxx: self.xxx / 8,
            sum_xxy: twelfth(self.xxy),
            sum_xyy: self.xyy / 2,
            sum_yyy: self.yyy,
            weight: self.weight,
            weight_x: self.weight_x,
            weight_y: self.weight_y,
            beside: self.beside,
            x0: self.x0,
            y0: self.y0,
            x1: self.x1,
            y1: self.y1,
        }
    }
}

/// Divides a multiple of twelve by twelve. The factor is 1 / 3 modulo 2⁶⁴: cheaper than a division.
fn twelfth(multiple: u64) -> u64 {
    (multiple / 4).wrapping_mul(0xAAAA_AAAA_AAAA_AAAB)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    fn run() -> impl Strategy<Value = Run> {
        (0..800_u16, 0..800_u16).prop_map(|(a, b)| Run {
            x0: a.min(b),
            x1: a.max(b),
        })
    }

    proptest! {
        #[test]
        fn runs_and_sums_add_up_to_the_sums_of_their_pixels(
            runs in prop::collection::vec((run(), run()), 1..12), y in 0..789_u16,
        ) {
            let mut left = Moments::of_run(runs[0].0, y);
            let mut right = Moments::of_run(runs[0].1, y);
            for (row, (a, b)) in (y + 1..).zip(&runs[1..]) {
                left.add_run(*a, row);
                right.add_run(*b, row);
            }
            left.add(&right);
            let rows = (u64::from(y)..).zip(&runs).flat_map(|(y, (a, b))| [(*a, y), (*b, y)]);
            let pixels: Vec<(u64, u64)> = rows
                .flat_map(|(run, y)| (run.x0..=run.x1).map(move |x| (u64::from(x), y)))
                .collect();
            let total = |f: fn(u64, u64) -> u64| pixels.iter().map(|(x, y)| f(*x, *y)).sum::<u64>();
            let blob = left.blob();
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
        }
    }

    #[test]
    fn the_largest_frame_does_not_overflow() {
        let whole = Run { x0: 0, x1: 799 };
        let mut sums = Moments::of_run(whole, 0);
        (1..800).for_each(|y| sums.add_run(whole, y));
        let blob = sums.blob();
        let powers = |k: u32| (0..800_u64).map(|x| x.pow(k)).sum::<u64>();
        assert_eq!(blob.area, 640_000);
        assert_eq!([blob.sum_x, blob.sum_y], [800 * powers(1); 2]);
        assert_eq!([blob.sum_xxx, blob.sum_yyy], [800 * powers(3); 2]);
        assert_eq!([blob.sum_xxy, blob.sum_xyy], [powers(2) * powers(1); 2]);
    }
}
