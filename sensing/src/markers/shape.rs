//! How the image of one marker looks: its moments as an ellipse's, and what the optics says of them.

use super::{lean::ThirdMoments, pattern::distance};
use crate::{
    blob::Blob,
    division::{Divisor, signed_quotient},
    model::CentroidEstimator,
    root::root,
    units::Px,
};

/// A blob's centroid and second moments. Lengths and variances have 16 fractional bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Centroid, column.
    pub x: Px,
    /// Centroid, row.
    pub y: Px,
    /// Pixels.
    pub area: u32,
    /// Area over that of the ellipse with the same moments, of 65,536. 1 for an ellipse, less for anything else.
    pub fill: i64,
    /// What [`fill`](Self::fill) lacks of 1, times the mean variance: px² in Q16.16. Pixels make it the same for discs of
    /// any size.
    pub hollow: i64,
    /// Distance of the centroid from the middle of the bounding box, the larger of x and y, px in Q16.16: 0 for an
    /// ellipse, more for one that is cut.
    pub lopsided: i64,
    /// Mean weight of its pixels, of 65,536; 0 when nothing was weighed.
    pub density: i64,
    variance: [i64; 3],
    third: ThirdMoments,
}

/// A shape as its pattern's centre sees it. Diameters in px, Q16.16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Distance from the centre.
    pub distance: Px,
    /// Diameter across the radius.
    pub across: i64,
    /// Diameter along the radius.
    pub along: i64,
    /// Covariance of both directions over the variance across, of 65,536: 0 where the ellipse lies across or along.
    pub skew: i64,
    /// How far it leans to one side ([`ThirdMoments::lean`]), px² in Q16.16.
    pub lean: i64,
}

/// A pixel is a square, not a point: 1/12 px² in Q16.
const PIXEL_VARIANCE: i64 = 5_461;
/// 4π in Q16.
const FOUR_PI: i64 = 823_550;
/// What soft edges add to a diameter (0.8 px: a pixel half covered by red passes), and a dilation (2 px).
const SOFT_EDGE: i32 = 52_429;
const DILATION_EDGE: i32 = 131_072;

/// What the mask adds to a marker's diameter before more is known, px.
pub fn nominal_edge(dilations: u8) -> Px {
    Px(SOFT_EDGE + i32::from(dilations) * DILATION_EDGE)
}

impl Shape {
    /// Of a blob of at least one pixel; `None` when its position cannot be told: no pixel has a weight.
    pub fn of_blob(blob: &Blob, estimator: CentroidEstimator) -> Option<Shape> {
        let by_area = Divisor::new(blob.area);
        let (x, y) = match estimator {
            CentroidEstimator::BinaryMask => blob.centroid_by(&by_area),
            CentroidEstimator::RednessWeighted => blob.weighted_centroid()?,
        };
        let moments = blob.central_moments();
        let area = i64::from(blob.area.max(1));
        // A whole number of px² first: the fraction lost is below 1/area.
        let variance = |moment: i64| by_area.signed_quotient(by_area.signed_quotient(moment) << 16);
        let variance = [
            variance(moments.xx) + PIXEL_VARIANCE,
            variance(moments.xy),
            variance(moments.yy) + PIXEL_VARIANCE,
        ];
        let lopsided = |low: u16, high: u16, mean: Px| {
            let middle = i64::from(u32::from(low) + u32::from(high)) << 15;
            (middle - i64::from(mean.0)).abs()
        };
        let fill = fill(area, variance);
        Some(Shape {
            x,
            y,
            area: blob.area,
            fill,
            hollow: ((65_536 - fill) * ((variance[0] + variance[2]) / 2)) >> 16,
            lopsided: lopsided(blob.x0, blob.x1, x).max(lopsided(blob.y0, blob.y1, y)),
            density: by_area.signed_quotient(i64::from(blob.weight) << 16),
            variance,
            third: ThirdMoments::of_blob(blob, &by_area),
        })
    }

    /// Seen from a centre; `None` from its own.
    pub fn seen_from(&self, center: (Px, Px)) -> Option<Seen> {
        let [dx, dy] =
            [(self.x, center.0), (self.y, center.1)].map(|(a, b)| a.0 as i64 - b.0 as i64);
        // Sixteenths of a pixel give the direction well enough, and a product below 2⁶³.
        let (ux, uy) = (dx >> 12, dy >> 12);
        let norm = ux * ux + uy * uy;
        let [xx, xy, yy] = self.variance;
        if norm == 0 {
            return None;
        }
        // Both parts are below 2¹⁴.
        let by_norm = Divisor::new(norm as u32);
        let [xx_part, xy_part, yy_part] = [ux * ux, ux * uy, uy * uy];
        let along = by_norm.signed_quotient(xx_part * xx + 2 * xy_part * xy + yy_part * yy);
        let across = by_norm.signed_quotient(yy_part * xx - 2 * xy_part * xy + xx_part * yy);
        let covariance = by_norm.signed_quotient(xy_part * (yy - xx) + (xx_part - yy_part) * xy);
        let by_root = Divisor::new(root(norm as u64));
        let direction = [ux, uy].map(|part| by_root.signed_quotient(part << 14));
        let [by_along, by_across] = [along, across].map(divisor);
        Some(Seen {
            distance: distance((self.x, self.y), center),
            across: diameter(across),
            along: diameter(along),
            skew: by_across.signed_quotient(covariance << 16),
            lean: self.third.lean(direction, &by_along, &by_across, across),
        })
    }
}

/// By a variance, at least 2⁻¹⁶ px². One of 2¹⁶ px² or more, which no marker has, divides as that does.
fn divisor(variance: i64) -> Divisor {
    Divisor::new(u32::try_from(variance.max(1)).unwrap_or(u32::MAX))
}

/// An ellipse's diameter is four standard deviations.
fn diameter(variance: i64) -> i64 {
    4 * i64::from(root((variance.max(0) as u64) << 16))
}

/// An ellipse's area is 4π√det of its covariance. Variances are below 800²/12 + 1 px² < 2³² in Q16, so that the
/// determinant fits 64 bits.
fn fill(area: i64, [xx, xy, yy]: [i64; 3]) -> i64 {
    let product = |a: i64, b: i64| a.unsigned_abs() * b.unsigned_abs();
    let determinant = product(xx, yy).saturating_sub(product(xy, xy));
    let ellipse_q24 = (FOUR_PI * i64::from(root(determinant))) >> 8;
    signed_quotient(area << 40, ellipse_q24)
}
