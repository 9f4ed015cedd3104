//! Computes how a blob's pixels are distributed around their mean: variances and third moments, in
//! single precision.

use crate::markers::blob::Blob;

/// Central moments of a blob per pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Central {
    /// E x², E xy, E y², plus the variance of a square pixel, px². Below 800²/4 px².
    pub variance: [f32; 3],
    /// E x³, E x²y, E xy², E y³, px³.
    pub third: [f32; 4],
}

/// Variance of a pixel along each axis, px²: it is a square, not a point.
const PIXEL_VARIANCE: f32 = 1.0 / 12.0;

impl Central {
    /// Moments of a blob of at least one pixel; `by_area` is one over its area.
    ///
    /// Sums are first taken exactly about the whole pixel next to the mean: no term exceeds 3 ·
    /// 640,000 · 799³ < 2⁵¹. They are then corrected to the mean, which is (a, b) away.
    pub fn of_blob(blob: &Blob, by_area: f32) -> Central {
        // Below 2²⁹ each.
        let [sx, sy] = [blob.sum_x, blob.sum_y].map(|sum| sum as u32);
        let [x, y] = [sx, sy].map(|sum| ((sum + blob.area / 2) / blob.area.max(1)) as i32);
        let [area, sx, sy] = [blob.area, sx, sy].map(|sum| sum as i32);
        let (dx, dy) = (sx - x * area, sy - y * area);
        let [sxx, sxy, syy] = [blob.sum_xx, blob.sum_xy, blob.sum_yy].map(|sum| sum as i64);
        let [sxxx, sxxy, sxyy, syyy] =
            [blob.sum_xxx, blob.sum_xxy, blob.sum_xyy, blob.sum_yyy].map(|sum| sum as i64);
        let product = |a: i32, b: i32| i64::from(a) * i64::from(b);
        let (xx, yy) = (sxx - product(x, sx + dx), syy - product(y, sy + dy));
        let second = [xx, sxy - product(x, sy) - product(y, dx), yy];
        let [wide_x, wide_y] = [x, y].map(i64::from);
        let third = [
            sxxx - wide_x * (2 * sxx - product(x, sx) + xx),
            sxxy - wide_x * (2 * sxy - product(x, sy)) - wide_y * xx,
            sxyy - wide_y * (2 * sxy - product(y, sx)) - wide_x * yy,
            syyy - wide_y * (2 * syy - product(y, sy) + yy),
        ];
        let [a, b] = [dx, dy].map(|sum| sum as f32 * by_area);
        let second = second.map(|sum| rounded(sum) * by_area);
        let third = third.map(|sum| rounded(sum) * by_area);
        about_the_mean([a, b], second, third)
    }
}

/// Converts moments about a point that is (a, b) px off the mean: E(x−a)² = E x² − a² and so on.
fn about_the_mean(
    [a, b]: [f32; 2],
    [xx, xy, yy]: [f32; 3],
    [xxx, xxy, xyy, yyy]: [f32; 4],
) -> Central {
    let [vxx, vxy, vyy] = [xx - a * a, xy - a * b, yy - b * b];
    // E(x−a)³ = E x³ − a·(2·E x² + the variance) + a³, and E(x−a)²(y−b) = E x²y − 2·a·E xy − b·the
    // variance along x + a²·b. The last terms, at most 1/8 px³, are omitted.
    let third = [
        xxx - a * (xx + xx + vxx),
        xxy - (a + a) * xy - b * vxx,
        xyy - (b + b) * xy - a * vyy,
        yyy - b * (yy + yy + vyy),
    ];
    Central {
        variance: [vxx + PIXEL_VARIANCE, vxy, vyy + PIXEL_VARIANCE],
        third,
    }
}

/// A number within ±2⁶² in single precision. It takes two 32-bit conversions, because the processor
/// has none of 64 bits. The low word is signed, so that it holds a small number completely.
fn rounded(sum: i64) -> f32 {
    let low = sum as i32;
    let high = ((sum - i64::from(low)) >> 32) as i32;
    high as f32 * 4_294_967_296.0 + low as f32
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::markers::runs::Run;
    use crate::markers::tables::Weights;
    use proptest::prelude::*;

    /// The moments of a blob.
    pub fn of_whole(blob: &Blob) -> Central {
        Central::of_blob(blob, 1.0 / blob.area as f32)
    }

    /// The blob of all pixels for which `inside` is true.
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
        let central = of_whole(&sum);
        for (found, expected) in central.third.iter().zip(expected) {
            let found = f64::from(*found);
            assert!((found - expected).abs() < 0.05, "{found} {expected}");
        }
        let expected = [
            mean(&|x, _| x * x) + 1.0 / 12.0,
            mean(&|x, y| x * y),
            mean(&|_, y| y * y) + 1.0 / 12.0,
        ];
        for (found, expected) in central.variance.iter().zip(expected) {
            let found = f64::from(*found);
            assert!((found - expected).abs() < 1e-4, "{found} {expected}");
        }
    }

    /// Two pixels in opposite corners have the largest variance; three have the largest third
    /// moment.
    #[test]
    fn what_fills_the_largest_frame_does_not_overflow() {
        let near = |found: f32, expected: f64| {
            let off = (f64::from(found) - expected).abs();
            assert!(off <= 1e-6 * expected.abs() + 0.2, "{found} {expected}");
        };
        let pixel = |x: u16, y: u16| Blob::of_run(Run { x0: x, x1: x }, y, Weights::NONE);
        let mut corners = pixel(0, 0);
        corners.add(&pixel(799, 799));
        let expected = 399.5_f64.powi(2);
        for found in of_whole(&corners).variance {
            near(found, expected);
        }
        corners.add(&pixel(0, 1));
        // 799 px once and 0 px twice: 2/27 of the cube.
        let expected = 799_f64.powi(3) * 2.0 / 27.0;
        for found in of_whole(&corners).third {
            assert!((f64::from(found) / expected - 1.0).abs() < 0.01, "{found}");
        }
        let mut whole: Option<Blob> = None;
        for y in 0..800 {
            let row = Blob::of_run(Run { x0: 0, x1: 799 }, y, Weights::NONE);
            match &mut whole {
                Some(whole) => whole.add(&row),
                none => *none = Some(row),
            }
        }
        let central = of_whole(&whole.unwrap());
        let expected = 800.0_f64.powi(2) / 12.0;
        for (found, expected) in central.variance.iter().zip([expected, 0.0, expected]) {
            near(*found, expected);
        }
        // Symmetric: the rounding error is 2⁻²³ of 400 px cubed.
        assert!(
            central.third.iter().all(|third| third.abs() < 8.0),
            "{central:?}"
        );
    }

    proptest! {
        #[test]
        fn sums_are_rounded_once_or_twice(sum: i64, shift in 2..64u32) {
            let sum = sum >> shift;
            let error = f64::from(rounded(sum)) - sum as f64;
            prop_assert!(error.abs() <= (sum as f64).abs() / (1 << 23) as f64, "{}", error);
        }
    }
}
