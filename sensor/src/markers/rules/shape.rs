//! Describes the image of one marker: its moments as those of an ellipse, along and across the
//! radius.

use super::{
    central::Central,
    lean::{Direction, squared_lean},
    pattern::{larger, offset},
};
use crate::markers::blob::Blob;
use crate::markers::kernels::sqrt;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::Px;

/// A blob's centroid, and the distribution of its pixels around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Centroid, column.
    pub x: Px,
    /// Centroid, row.
    pub y: Px,
    /// Pixels.
    pub area: u32,
    /// [`Blob::passed`].
    pub passed: u32,
    /// Area over that of the ellipse with the same moments: 1 for an ellipse, less for any other
    /// shape.
    pub fill: f32,
    /// (1 − [`fill`](Self::fill)) times the mean variance, px². The pixel grid makes it the same
    /// for discs of any size.
    pub hollow: f32,
    /// Distance of the centroid from the middle of the bounding box, the larger of x and y, px: 0
    /// for an ellipse, more for a cut one.
    pub lopsided: f32,
    /// Mean weight of its pixels; 0 if pixels were not weighed.
    pub density: f32,
    /// [`Beside::shift_px2`](crate::markers::beside::Beside::shift_px2).
    pub shift_px2: f32,
    central: Central,
}

/// A shape along and across the radius from its pattern's centre. Diameters in px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialShape {
    /// Distance from the centre, px.
    pub distance: f32,
    /// Diameter across the radius.
    pub across: f32,
    /// One over `across`.
    pub by_across: f32,
    /// Diameter along the radius.
    pub along: f32,
    /// Covariance of both directions over the variance across: 0 if an axis of the ellipse points
    /// along the radius.
    pub skew: f32,
    /// The square of its lean to one side ([`squared_lean`]), px⁴.
    pub squared_lean: f32,
}

/// An ellipse's area is 4π times the root of its covariance's determinant.
const FOUR_PI: f32 = 4.0 * core::f32::consts::PI;
/// Smallest ellipse and smallest variance of a blob: it has at least one pixel.
const LEAST_AREA: f32 = 1.0;
const LEAST_VARIANCE: f32 = 1.0 / 4_096.0;
/// Width that soft edges add to a diameter: 0.8 px, because a pixel half covered by red passes.
const SOFT_EDGE: Px = Px(52_429);
/// Width that a dilation adds to a diameter, px.
const DILATION_EDGE: i32 = 2;

/// Width that the mask adds to a marker's diameter before more is known, px.
pub fn nominal_edge(dilations: u8) -> Px {
    SOFT_EDGE + Px::from_int(i32::from(dilations) * DILATION_EDGE)
}

impl Shape {
    /// The shape of a blob of at least one pixel. Returns `None` if its position is unknown because
    /// no pixel has a weight.
    pub fn of_blob(blob: &Blob, estimator: CentroidEstimator) -> Option<Shape> {
        let (x, y) = match estimator {
            CentroidEstimator::BinaryMask => blob.centroid(),
            CentroidEstimator::RednessWeighted => blob.weighted_centroid()?,
        };
        let area = blob.area as f32;
        let by_area = 1.0 / area;
        let central = Central::of_blob(blob, by_area);
        let [xx, xy, yy] = central.variance;
        let determinant = larger(xx * yy - xy * xy, 0.0);
        let fill = area / larger(FOUR_PI * sqrt(determinant), LEAST_AREA);
        let lopsided = |low: u16, high: u16, mean: Px| {
            let middle = (i32::from(low) + i32::from(high)) << (Px::FRACTION_BITS - 1);
            Px((middle - mean.0).abs())
        };
        let lopsided = lopsided(blob.x0, blob.x1, x).max(lopsided(blob.y0, blob.y1, y));
        Some(Shape {
            x,
            y,
            area: blob.area,
            passed: blob.passed,
            fill,
            hollow: (1.0 - fill) * 0.5 * (xx + yy),
            lopsided: lopsided.to_f32(),
            density: blob.weight as f32 * by_area,
            shift_px2: blob.beside.shift_px2(blob.area, [blob.y0, blob.y1]),
            central,
        })
    }

    /// The marker with this image.
    pub fn marker(&self) -> Marker {
        Marker {
            x: self.x,
            y: self.y,
            area: self.area,
        }
    }

    /// Returns the shape about a centre; `None` about its own centroid.
    pub fn about(&self, center: (Px, Px)) -> Option<RadialShape> {
        let [x, y] = offset((self.x, self.y), center);
        let square = x * x + y * y;
        if square == 0.0 {
            return None;
        }
        let direction = Direction::of([x, y], 1.0 / square);
        let Central { variance, third } = self.central;
        let along = larger(direction.along(variance), LEAST_VARIANCE);
        let across = larger(direction.across(variance), LEAST_VARIANCE);
        // One division instead of two.
        let by_both = 1.0 / (along * across);
        let (by_along, by_across) = (by_both * across, by_both * along);
        // An ellipse's diameter is four standard deviations.
        let diameter = 4.0 * sqrt(across);
        Some(RadialShape {
            distance: sqrt(square),
            across: diameter,
            by_across: 0.0625 * by_across * diameter,
            along: 4.0 * sqrt(along),
            skew: direction.mixed(variance) * by_across,
            squared_lean: across * squared_lean(third, &direction, [by_along, by_across]),
        })
    }
}
