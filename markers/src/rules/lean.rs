//! Third moments: how far a shape leans to one side.
//!
//! An ellipse's third central moments are zero. What is cut off or sticks out leaves one. Scaled to
//! a round shape by the diameters, E|d|²d is the part of it that a pixel grid hardly disturbs: a
//! pixel more or less on the edge of a disc shifts its centroid and E|d|²d so that the two nearly
//! cancel.

use super::pattern::length;
use hivtac_terms::division::{Reciprocal, limited, scaled};

/// Which way to look at a shape: along a direction and across it.
#[derive(Clone, Copy, Debug)]
pub struct Direction {
    cos: i32,
    sin: i32,
    /// cos², cos·sin, sin².
    products: [i32; 3],
}

impl Direction {
    /// Of cosine and sine with 14 fractional bits, as are all parts.
    pub fn new(cos: i32, sin: i32) -> Direction {
        Direction {
            cos,
            sin,
            products: [cos * cos, cos * sin, sin * sin].map(|product| product >> 14),
        }
    }

    /// xᵀ·M·x of a symmetric M = [p q; q r] along the direction.
    pub fn along(&self, [p, q, r]: [i32; 3]) -> i32 {
        let [cc, cs, ss] = self.products;
        sum([(cc, p), (2 * cs, q), (ss, r)])
    }

    /// The same across it.
    pub fn across(&self, [p, q, r]: [i32; 3]) -> i32 {
        let [cc, cs, ss] = self.products;
        sum([(ss, p), (-2 * cs, q), (cc, r)])
    }

    /// Of M, along it on one side and across it on the other.
    pub fn mixed(&self, [p, q, r]: [i32; 3]) -> i32 {
        let [cc, cs, ss] = self.products;
        sum([(-cs, p), (cc - ss, q), (cs, r)])
    }

    /// A vector's parts along and across it.
    fn turned(&self, p: i32, q: i32) -> [i32; 2] {
        [
            sum([(self.cos, p), (self.sin, q)]),
            sum([(self.cos, q), (-self.sin, p)]),
        ]
    }
}

/// Σ of factors with 14 fractional bits times values.
fn sum<const N: usize>(terms: [(i32, i32); N]) -> i32 {
    let products = terms.map(|(factor, value)| i64::from(factor) * i64::from(value));
    limited(products.iter().sum::<i64>() >> 14)
}

/// E|d|²d of a shape, scaled to a round one, times its variance: px² with 16 fractional bits.
///
/// `third` are its third moments, px³ with 8 fractional bits. `by` divides by the variances along
/// and across the direction, in px² with 12 fractional bits, and `deviation` is the root of the
/// second of them, in px with 16.
pub fn lean(
    [xxx, xxy, xyy, yyy]: [i32; 4],
    direction: &Direction,
    by: [&Reciprocal; 2],
    deviation: i32,
) -> i32 {
    let parts = [(xxx, xxy), (xxy, xyy), (xyy, yyy)].map(|(p, q)| direction.turned(p, q));
    // px³ with 8 bits over px² with 12 are px with 16 once they are shifted by 20.
    let rounded = |third: [i32; 3]| {
        let parts = [direction.along(third), direction.across(third)].map(|it| i64::from(it) << 20);
        limited(by[0].times(parts[0]) + by[1].times(parts[1]))
    };
    let [[xx, yx], [xy, yy], [xz, yz]] = parts;
    let lean = length([[xx, xy, xz], [yx, yy, yz]].map(rounded));
    scaled(lean, deviation, 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::Blob;
    use crate::rules::{central::Central, central::tests::blob};

    /// px².
    fn lean_of(blob: &Blob) -> f64 {
        let Central { variance, third } = Central::of_blob(blob, &Reciprocal::of(blob.area));
        let [by_xx, by_yy] = [variance[0], variance[2]].map(|it| Reciprocal::of(it as u32));
        let deviation = (f64::from(variance[2]) / 4_096.0).sqrt() * 65_536.0;
        let direction = Direction::new(1 << 14, 0);
        let lean = lean(third, &direction, [&by_xx, &by_yy], deviation as i32);
        f64::from(lean) / 65_536.0
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
