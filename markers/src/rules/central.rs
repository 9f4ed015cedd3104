//! How the pixels of a blob lie around their mean: variances and third moments, to 2⁻²⁷ of them and
//! their last place.

use crate::blob::Blob;
use hivtac_terms::division::{Reciprocal, limited};

/// Central moments of a blob per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Central {
    /// E x², E xy, E y² and what a pixel has as it is a square, px² with 12 fractional bits. Below
    /// 800²/4 px².
    pub variance: [i32; 3],
    /// E x³, E x²y, E xy², E y³, px³ with 8 fractional bits. Those beyond ±2²³ px³, of no marker,
    /// are as those.
    pub third: [i32; 4],
}

/// A pixel is a square, not a point: 1/12 px² in Q12.
const PIXEL_VARIANCE: i32 = 341;

impl Central {
    /// Of a blob of at least one pixel, with one over its area.
    ///
    /// Sums are first taken about a whole pixel next to the mean, exactly: no term is beyond 3 ·
    /// 640,000 · 799³ < 2⁵¹. About the mean, which is (a, b) away from that, they are then
    /// corrected.
    pub fn of_blob(blob: &Blob, by_area: &Reciprocal) -> Central {
        let area = i64::from(blob.area);
        let [sx, sy, sxx, sxy, syy] = [
            blob.sum_x,
            blob.sum_y,
            blob.sum_xx,
            blob.sum_xy,
            blob.sum_yy,
        ]
        .map(|sum| sum as i64);
        let [sxxx, sxxy, sxyy, syyy] =
            [blob.sum_xxx, blob.sum_xxy, blob.sum_xyy, blob.sum_yyy].map(|sum| sum as i64);
        let [x, y] = [sx, sy].map(|sum| by_area.times(sum + area / 2));
        let (dx, dy) = (sx - x * area, sy - y * area);
        let (xx, yy) = (sxx - x * (sx + dx), syy - y * (sy + dy));
        let second = [xx, sxy - x * sy - y * dx, yy];
        let third = [
            sxxx - x * (2 * sxx - x * sx + xx),
            sxxy - x * (2 * sxy - x * sy) - y * xx,
            sxyy - y * (2 * sxy - y * sx) - x * yy,
            syyy - y * (2 * syy - y * sy + yy),
        ];
        let [a, b] = [dx, dy].map(|sum| by_area.times(sum << 16) as i32);
        let second = second.map(|sum| by_area.times(sum << 12) as i32);
        let third = third.map(|sum| limited(by_area.times(sum << 8)));
        about_the_mean([a, b], second, third)
    }
}

/// From about a point that is (a, b) off the mean, px with 16 fractional bits: E(x−a)² = E x² − a²
/// and so on.
fn about_the_mean(
    [a, b]: [i32; 2],
    [xx, xy, yy]: [i32; 3],
    [xxx, xxy, xyy, yyy]: [i32; 4],
) -> Central {
    let product = |p: i32, q: i32| i64::from(p) * i64::from(q);
    let variance = [
        xx - (product(a, a) >> 20) as i32,
        xy - (product(a, b) >> 20) as i32,
        yy - (product(b, b) >> 20) as i32,
    ];
    // E(x−a)³ = E x³ − a·(2·E x² + the variance), and E(x−a)²(y−b) = E x²y − 2·a·E xy − b·the
    // variance along x.
    let [vxx, _, vyy] = variance;
    let third = [
        (xxx, 2 * product(a, xx) + product(a, vxx)),
        (xxy, 2 * product(a, xy) + product(b, vxx)),
        (xyy, 2 * product(b, xy) + product(a, vyy)),
        (yyy, 2 * product(b, yy) + product(b, vyy)),
    ];
    let [vxx, vxy, vyy] = variance;
    Central {
        variance: [vxx + PIXEL_VARIANCE, vxy, vyy + PIXEL_VARIANCE],
        third: third.map(|(moment, shift)| limited(i64::from(moment) - (shift >> 20))),
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::runs::Run;
    use crate::tables::Weights;

    /// The pixels inside, as a blob.
    pub fn blob(inside: impl Fn(f64, f64) -> bool) -> Blob {
        let mut sum: Option<Blob> = None;
        for y in 0..120_u16 {
            for x in (0..160_u16).filter(|x| inside(f64::from(*x), f64::from(y))) {
                let pixel = Blob::of_run(Run { x0: x, x1: x }, y, Weights::NONE);
                match &mut sum {
                    Some(sum) => sum.add(&pixel),
                    None => sum = Some(pixel),
                }
            }
        }
        sum.unwrap()
    }

    #[test]
    fn moments_are_those_of_the_pixels() {
        let (mut pixels, mut center) = (std::vec::Vec::new(), [0.0; 2]);
        let inside = |x: f64, y: f64| (x - 90.3).hypot(y - 60.8) < 9.0 && x + 0.4 * y < 117.0;
        let sum = blob(inside);
        for y in 0..120 {
            for x in 0..160 {
                if inside(f64::from(x), f64::from(y)) {
                    pixels.push([f64::from(x), f64::from(y)]);
                }
            }
        }
        for [x, y] in &pixels {
            center[0] += x / pixels.len() as f64;
            center[1] += y / pixels.len() as f64;
        }
        let mean = |f: &dyn Fn(f64, f64) -> f64| {
            let terms = pixels.iter().map(|[x, y]| f(x - center[0], y - center[1]));
            terms.sum::<f64>() / pixels.len() as f64
        };
        let expected = [
            mean(&|x, _| x * x * x),
            mean(&|x, y| x * x * y),
            mean(&|x, y| x * y * y),
            mean(&|_, y| y * y * y),
        ];
        let central = Central::of_blob(&sum, &Reciprocal::of(sum.area));
        for (found, expected) in central.third.iter().zip(expected) {
            let found = f64::from(*found) / 256.0;
            assert!((found - expected).abs() < 0.05, "{found} {expected}");
        }
        let expected = [
            mean(&|x, _| x * x) + 1.0 / 12.0,
            mean(&|x, y| x * y),
            mean(&|_, y| y * y) + 1.0 / 12.0,
        ];
        for (found, expected) in central.variance.iter().zip(expected) {
            let found = f64::from(*found) / 4_096.0;
            assert!((found - expected).abs() < 0.002, "{found} {expected}");
        }
    }

    /// Two pixels in opposite corners have the largest variance, and three the largest third
    /// moment.
    #[test]
    fn what_fills_the_largest_frame_does_not_overflow() {
        let pixel = |x: u16, y: u16| Blob::of_run(Run { x0: x, x1: x }, y, Weights::NONE);
        let mut corners = pixel(0, 0);
        corners.add(&pixel(799, 799));
        let central = Central::of_blob(&corners, &Reciprocal::of(2));
        let expected = 399.5_f64.powi(2) * 4_096.0;
        for (found, more) in central.variance.iter().zip([341.0, 0.0, 341.0]) {
            assert!((f64::from(*found) - expected - more).abs() < 8.0, "{found}");
        }
        corners.add(&pixel(0, 1));
        let third = Central::of_blob(&corners, &Reciprocal::of(3)).third;
        assert!(third.iter().all(|third| *third > 1 << 30), "{third:?}");
        let mut whole: Option<Blob> = None;
        for y in 0..800 {
            let row = Blob::of_run(Run { x0: 0, x1: 799 }, y, Weights::NONE);
            match &mut whole {
                Some(whole) => whole.add(&row),
                none => *none = Some(row),
            }
        }
        let central = Central::of_blob(&whole.unwrap(), &Reciprocal::of(640_000));
        let expected = 800.0_f64.powi(2) / 12.0 * 4_096.0;
        for (found, expected) in central.variance.iter().zip([expected, 0.0, expected]) {
            assert!(
                (f64::from(*found) - expected).abs() < 8.0,
                "{found} {expected}"
            );
        }
        assert!(
            central.third.iter().all(|third| third.abs() < 700),
            "{central:?}"
        );
    }
}
