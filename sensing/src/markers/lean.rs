//! Third moments: how far a shape leans to one side.
//!
//! An ellipse's third central moments are zero. What is cut off or sticks out leaves one. Scaled to a round shape by the
//! diameters, E|d|²d is the part of it that a pixel grid hardly disturbs: a pixel more or less on the edge of
//! a disc shifts its centroid and E|d|²d so that the two nearly cancel.

use super::pattern::length;
use crate::{blob::Blob, division::Divisor, root::root};

/// Central third moments of a blob per pixel, px³ with 8 fractional bits: x³, x²y, xy², y³.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThirdMoments([i64; 4]);

impl ThirdMoments {
    /// Of a blob of at least one pixel, with its area as a divisor.
    ///
    /// Sums are first taken about the whole pixel nearest to the centroid, exactly: no term is beyond
    /// 3 · 640,000 · 799³ < 2⁵¹. About the centroid itself they are then corrected by its remaining fraction (a, b).
    pub fn of_blob(blob: &Blob, by_area: &Divisor) -> ThirdMoments {
        let area = i64::from(blob.area.max(1));
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
        // ⌊(2·sum + area)/(2·area)⌋, as the halves that are lost make no whole.
        let nearest = |sum: i64| by_area.signed_quotient(sum + area / 2);
        let (x, y) = (nearest(sx), nearest(sy));
        let first = [sx - x * area, sy - y * area];
        let xx = sxx - 2 * x * sx + x * x * area;
        let xy = sxy - x * sy - y * sx + x * y * area;
        let yy = syy - 2 * y * sy + y * y * area;
        let third = [
            sxxx - 3 * x * sxx + 3 * x * x * sx - x * x * x * area,
            sxxy - 2 * x * sxy + x * x * sy - y * xx,
            sxyy - 2 * y * sxy + y * y * sx - x * yy,
            syyy - 3 * y * syy + 3 * y * y * sy - y * y * y * area,
        ];
        let [a, b] = first.map(|sum| by_area.signed_quotient(sum << 16));
        let [xx, xy, yy] = [xx, xy, yy].map(|sum| by_area.signed_quotient(sum << 8));
        // A product of a fraction with 16 bits and a second moment, or of three fractions, with 8.
        let with = |fraction: i64, moment: i64| (fraction * moment) >> 16;
        let cube = |p: i64, q: i64, r: i64| (2 * p * q * r) >> 40;
        let [xxx, xxy, xyy, yyy] = third.map(|sum| by_area.signed_quotient(sum << 8));
        ThirdMoments([
            xxx - 3 * with(a, xx) + cube(a, a, a),
            xxy - 2 * with(a, xy) - with(b, xx) + cube(a, a, b),
            xyy - 2 * with(b, xy) - with(a, yy) + cube(a, b, b),
            yyy - 3 * with(b, yy) + cube(b, b, b),
        ])
    }

    /// E|d|²d of the shape, scaled to a round one, times its variance: px² with 16 fractional bits. (`cos`, `sin`) with 14
    /// fractional bits is the direction; `by_along` and `by_across` divide by the variances along and across it, and
    /// `across` is the second of them, in px² with 16 fractional bits.
    pub fn lean(
        &self,
        [cos, sin]: [i64; 2],
        by_along: &Divisor,
        by_across: &Divisor,
        across: i64,
    ) -> i64 {
        let [xxx, xxy, xyy, yyy] = self.0;
        let turned = |p: i64, q: i64| (cos * p + sin * q) >> 14;
        let crossed = |p: i64, q: i64| (cos * q - sin * p) >> 14;
        let [cc, cs, ss] = [cos * cos, cos * sin, sin * sin].map(|product| product >> 14);
        let twice_along = |[p, q, r]: [i64; 3]| (cc * p + 2 * cs * q + ss * r) >> 14;
        let twice_across = |[p, q, r]: [i64; 3]| (ss * p - 2 * cs * q + cc * r) >> 14;
        let u = [turned(xxx, xxy), turned(xxy, xyy), turned(xyy, yyy)];
        let v = [crossed(xxx, xxy), crossed(xxy, xyy), crossed(xyy, yyy)];
        let scaled = |third: [i64; 3]| {
            by_along.signed_quotient(twice_along(third) << 24)
                + by_across.signed_quotient(twice_across(third) << 24)
        };
        let deviation = i64::from(root((across.max(0) as u64) << 16));
        (length([scaled(u), scaled(v)]) * deviation) >> 16
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{runs::Run, tables::Weights};

    /// The pixels inside, as a blob.
    fn blob(inside: impl Fn(f64, f64) -> bool) -> Blob {
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

    /// px².
    fn lean_of(blob: &Blob) -> f64 {
        let moments = blob.central_moments();
        let square = i64::from(blob.area) * i64::from(blob.area);
        let variance = |moment: i64| ((i128::from(moment) << 16) / i128::from(square)) as i64;
        let [xx, yy] = [moments.xx, moments.yy].map(variance);
        let [by_xx, by_yy] = [xx, yy].map(|variance| Divisor::new(variance as u32));
        let third = ThirdMoments::of_blob(blob, &Divisor::new(blob.area));
        let lean = third.lean([1 << 14, 0], &by_xx, &by_yy, yy);
        lean as f64 / 65_536.0
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
        for (found, expected) in ThirdMoments::of_blob(&sum, &Divisor::new(sum.area))
            .0
            .iter()
            .zip(expected)
        {
            assert!(
                (*found as f64 / 256.0 - expected).abs() < 0.05,
                "{found} {expected}"
            );
        }
    }

    #[test]
    fn discs_and_ellipses_hardly_lean() {
        for (x, y) in [(50.0, 60.0), (50.5, 60.25), (49.7, 60.4)] {
            for radius in [5.0, 8.3, 17.0, 30.0] {
                for squeezed in [1.0, 0.8] {
                    let lean = lean_of(&blob(|px, py| {
                        ((px - x) / squeezed).hypot(py - y) <= radius
                    }));
                    assert!(lean < 0.2, "{radius} {squeezed}: {lean}");
                }
            }
        }
    }

    #[test]
    fn what_is_cut_leans_whichever_side() {
        for degrees in [0.0_f64, 30.0, 90.0, 200.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let lean = lean_of(&blob(|x, y| {
                let (dx, dy) = (x - 70.2, y - 60.7);
                dx.hypot(dy) <= 9.0 && dx * cos + dy * sin < 6.5
            }));
            assert!(lean > 0.3, "{degrees}: {lean}");
        }
    }
}
