//! How the image of one marker looks: its moments as an ellipse's, and what the optics says of
//! them.

use super::{
    central::Central,
    lean::{Direction, lean},
    pattern::distance,
};
use crate::blob::Blob;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::division::{Reciprocal, limited, scaled};
use hivtac_terms::root::{root, rough_root};
use hivtac_terms::units::Px;

/// A blob's centroid and how its pixels lie around it. Quotients and roots are to 2⁻¹⁵ of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Centroid, column.
    pub x: Px,
    /// Centroid, row.
    pub y: Px,
    /// Pixels.
    pub area: u32,
    /// [`Blob::passed`].
    pub passed: u32,
    /// Area over that of the ellipse with the same moments, of 65,536. 1 for an ellipse, less for
    /// anything else.
    pub fill: i32,
    /// What [`fill`](Self::fill) lacks of 1, times the mean variance: px² in Q16.16. Pixels make it
    /// the same for discs of any size.
    pub hollow: i32,
    /// Distance of the centroid from the middle of the bounding box, the larger of x and y, px in
    /// Q16.16: 0 for an ellipse, more for one that is cut.
    pub lopsided: i32,
    /// Mean weight of its pixels, of 65,536; 0 when nothing was weighed.
    pub density: i32,
    central: Central,
}

/// A shape along and across the radius from its pattern's centre. Diameters in px, Q16.16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RadialShape {
    /// Distance from the centre.
    pub distance: Px,
    /// Diameter across the radius.
    pub across: i32,
    /// Diameter along the radius.
    pub along: i32,
    /// Covariance of both directions over the variance across, of 65,536: 0 where the ellipse lies
    /// across or along.
    pub skew: i32,
    /// How far it leans to one side ([`lean`]), px² in Q16.16.
    pub lean: i32,
}

/// 4π in Q16.
const FOUR_PI: u64 = 823_550;
/// What soft edges add to a diameter (0.8 px: a pixel half covered by red passes), and a dilation
/// (2 px).
const SOFT_EDGE: i32 = 52_429;
const DILATION_EDGE: i32 = 131_072;

/// What the mask adds to a marker's diameter before more is known, px.
pub fn nominal_edge(dilations: u8) -> Px {
    Px(SOFT_EDGE + i32::from(dilations) * DILATION_EDGE)
}

impl Shape {
    /// Of a blob of at least one pixel; `None` when its position cannot be told: no pixel has a
    /// weight.
    pub fn of_blob(blob: &Blob, estimator: CentroidEstimator) -> Option<Shape> {
        let (x, y) = match estimator {
            CentroidEstimator::BinaryMask => blob.centroid(),
            CentroidEstimator::RednessWeighted => blob.weighted_centroid()?,
        };
        let by_area = Reciprocal::of(blob.area);
        let central = Central::of_blob(blob, &by_area);
        let (fill, hollow) = fill(blob.area, central.variance);
        let lopsided = |low: u16, high: u16, mean: Px| {
            let middle = (i32::from(low) + i32::from(high)) << 15;
            (middle - mean.0).abs()
        };
        Some(Shape {
            x,
            y,
            area: blob.area,
            passed: blob.passed,
            fill,
            hollow,
            lopsided: lopsided(blob.x0, blob.x1, x).max(lopsided(blob.y0, blob.y1, y)),
            density: by_area.part(blob.weight as i32),
            central,
        })
    }

    /// About a centre; `None` about its own.
    pub fn about(&self, center: (Px, Px)) -> Option<RadialShape> {
        let distance = distance((self.x, self.y), center);
        if distance.0 == 0 {
            return None;
        }
        let by_distance = Reciprocal::of(distance.0 as u32);
        let [cos, sin] = [self.x - center.0, self.y - center.1]
            .map(|part| by_distance.times(i64::from(part.0) << 14) as i32);
        let direction = Direction::new(cos, sin);
        let Central { variance, third } = self.central;
        let along = direction.along(variance).max(1);
        let across = direction.across(variance).max(1);
        let [by_along, by_across] = [along, across].map(|it| Reciprocal::of(it as u32));
        let deviation = deviation(across);
        Some(RadialShape {
            distance,
            across: diameter(deviation),
            along: diameter(self::deviation(along)),
            skew: by_across.part(direction.mixed(variance)),
            lean: lean(third, &direction, [&by_along, &by_across], deviation),
        })
    }
}

/// Of a variance in px² with 12 fractional bits, px with 16.
fn deviation(variance: i32) -> i32 {
    rough_root((variance.max(0) as u64) << 20) as i32
}

/// An ellipse's diameter is four standard deviations.
fn diameter(deviation: i32) -> i32 {
    4 * deviation
}

/// [`Shape::fill`] and [`Shape::hollow`]. An ellipse's area is 4π√det of its covariance; the
/// determinant is below 2⁶⁰.
fn fill(area: u32, [xx, xy, yy]: [i32; 3]) -> (i32, i32) {
    let product = |a: i32, b: i32| u64::from(a.unsigned_abs()) * u64::from(b.unsigned_abs());
    let determinant = product(xx, yy).saturating_sub(product(xy, xy));
    // With 8 fractional bits: below 2³², as a blob's variances are below 800²/12 px².
    let ellipse = ((FOUR_PI * u64::from(root(determinant))) >> 20) as u32;
    let lack = i64::from(ellipse) - (i64::from(area) << 8);
    let lack = limited(Reciprocal::of(ellipse).times(lack << 20));
    let mean = (xx + yy) / 2;
    (65_536 - (lack >> 4), scaled(lack, mean, 16))
}
