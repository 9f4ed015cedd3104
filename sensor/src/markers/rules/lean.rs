//! Computes how far a shape leans to one side, from its third moments.
//!
//! The third central moments of an ellipse are zero; those of a shape that is cut off or bulges are
//! not. Scaled to a round shape by the diameters, E|d|²d is the combination that a pixel grid
//! hardly disturbs. One pixel more or less on the edge of a disc shifts its centroid and E|d|²d
//! such that the two effects nearly cancel.

/// The direction along and across which a shape is measured.
#[derive(Clone, Copy, Debug)]
pub struct Direction {
    /// cos², cos·sin, sin².
    products: [f32; 3],
}

impl Direction {
    /// The direction of a vector that is not zero; `by_square` is one over its square.
    pub fn of([x, y]: [f32; 2], by_square: f32) -> Direction {
        let (cos, sin) = (x * by_square, y * by_square);
        Direction {
            products: [x * cos, y * cos, y * sin],
        }
    }

    /// xᵀ·M·x of a symmetric M = [p q; q r] along the direction.
    pub fn along(&self, [p, q, r]: [f32; 3]) -> f32 {
        let [cc, cs, ss] = self.products;
        cc * p + (cs + cs) * q + ss * r
    }

    /// The same across the direction.
    pub fn across(&self, [p, q, r]: [f32; 3]) -> f32 {
        let [cc, cs, ss] = self.products;
        ss * p - (cs + cs) * q + cc * r
    }

    /// M's mixed component: along the direction on one side, across it on the other.
    pub fn mixed(&self, [p, q, r]: [f32; 3]) -> f32 {
        let [cc, cs, ss] = self.products;
        cs * (r - p) + (cc - ss) * q
    }
}

/// Returns the squared length of E|d|²d of a shape, scaled to a round one, px².
///
/// `third` are its third moments, px³, and `by` are one over the variances along and across the
/// direction, px⁻². The length of a vector does not depend on the axes, so only |d|² is rotated.
pub fn squared_lean([xxx, xxy, xyy, yyy]: [f32; 4], direction: &Direction, by: [f32; 2]) -> f32 {
    let [cc, cs, ss] = direction.products;
    let [p, r] = [cc * by[0] + ss * by[1], ss * by[0] + cc * by[1]];
    let q = (cs + cs) * (by[0] - by[1]);
    let x = p * xxx + q * xxy + r * xyy;
    let y = p * xxy + q * xyy + r * yyy;
    x * x + y * y
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::markers::blob::Blob;
    use crate::markers::rules::central::{
        Central,
        tests::{blob, of_whole},
    };

    /// The lean of a blob, px².
    fn lean_of(blob: &Blob) -> f32 {
        let Central { variance, third } = of_whole(blob);
        let by = [variance[0], variance[2]].map(|it| 1.0 / it);
        let direction = Direction::of([1.0, 0.0], 1.0);
        (variance[2] * squared_lean(third, &direction, by)).sqrt()
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
