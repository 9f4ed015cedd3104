//! Whether four markers may make a force: how they compare with a rest position.
//!
//! The limits stand between what a load does to the markers and what a false, cut or half dark marker does. The first
//! was measured on rendered frames of the film's curves at QVGA and 800×600, both presets: forces to 0.25 N tilted by up
//! to 12°, tip offsets to 0.5 mm. Each limit's comment gives the largest value seen. Lengths do not grow with the frame
//! where they come of the pixel grid. Presses far off the middle are refused where they strain the pattern: a model of
//! presses in the middle would read them wrong.

use super::{
    Found,
    pattern::{Pattern, distance, length},
    shape::Seen,
};
use crate::{
    geometry::Geometry,
    model::{CentroidEstimator, Rest},
    settings::Settings,
    status::Status,
    units::{MilliDegrees, Px},
};

/// Strain against this unit's own rest, as the displacement of one marker that makes it: 0.25 px for weighted centroids
/// (seen: 0.14, and 0.2 at four-fold noise), 0.7 px for binary ones (seen: 0.53 at QVGA, 0.2 at 800×600). It is what a
/// thing that stands in for a marker may be off.
const STRAIN_WEIGHTED: i64 = 16_384;
const STRAIN_BINARY: i64 = 45_875;
/// What a sideways force strains: 1.5 times the square of the shift over the half side (seen: 1.3 times with the tip up
/// to 0.25 mm off the middle, 1.5 times at 0.5 mm); in halves.
const STRAIN_BY_SHIFT: i64 = 3;
/// Strain against a model's rest, 0.015 of 65,536: another unit's markers are not quite where this one's are.
const STRAIN_FOREIGN: i64 = 983;
/// Taper against the rest's: 0.1 (seen: 0.066), of 65,536.
const TAPER: i64 = 6_554;
/// Turn against the rest's: 5° (seen: 0.1°).
const TURN: MilliDegrees = MilliDegrees(5_000);
/// Shift of the centre against the rest's: 0.35 of the rest's half side (seen: 0.11), of 256.
const SHIFT: i64 = 90;
/// Size against the rest's: 0.85 to 2 (seen: 1 to 1.71), of 256.
const SCALE: (i64, i64) = (218, 512);
/// Width across the radius: off by 0.06 of it (of 256) and 0.35 px (seen: 0.03 and 0.3 px). Eaten or swollen edges.
const WIDTH: i64 = 15;
const WIDTH_PIXELS: i64 = 22_938;
/// The narrowest marker's aspect over the widest's: 1 less 0.05 less 0.5 px of its width less 6 times the taper less the
/// shift over the rest's half side: the film is steeper on the side that comes nearer, and where an off-centre tip is.
/// One marker eaten or cut along the radius.
const ASPECT: i64 = 3_277;
const ASPECT_PIXELS: i64 = 32_768;
const ASPECT_TAPER: i64 = 6;
/// Skew: 1 px of its width (seen: 0.91 px) and the taper. Eaten or cut on one side.
const SKEW_PIXELS: i64 = 65_536;
/// Hollowness: at most 0.22 px² and 0.04 for the square of the number of dilations, which make a disc a little square
/// (seen: 0.20, 0.19, 0.28 and 0.44 with none to three). Dented, notched, grown.
const HOLLOW: i64 = 14_418;
const HOLLOW_BY_DILATIONS: i64 = 2_621;
/// Lean: at most 0.3 px² for a marker as wide as at rest, and more as it is wider: the lens bends what comes near
/// (seen: 0.16 near rest, 0.26 at 1.5 times its width). Cut or grown on one side.
const LEAN: i64 = 19_661;
/// Mean weight of a marker's pixels against that of all four: 0.015 and 11 px² over its width's square (seen: 0.007 at
/// 800×600, 0.032 at QVGA, 0.069 at 160×120). Striped, stained or glaring inside, where the dilated mask closes.
const DENSITY: i64 = 983;
const DENSITY_AREA: i64 = 11;
/// Centroid against bounding box: 0.6 px and 0.03 of its width (of 256). Cut or grown on one side.
const LOPSIDED_PIXELS: i64 = 39_322;
const LOPSIDED: i64 = 8;

/// What four markers are compared with.
#[derive(Clone, Copy, Debug)]
pub struct Trust<'a> {
    /// How they were found.
    pub settings: &'a Settings,
    /// Where they rest.
    pub rest: &'a Rest,
    /// Whether that was taken on this unit.
    pub own_rest: bool,
}

impl Trust<'_> {
    /// Says whether these markers may make a force: [`Status::OK`] or [`Status::MARKERS_IMPLAUSIBLE`].
    pub fn judge(&self, found: &Found) -> Status {
        let at_rest = Pattern::of_centroids(self.rest.features.centroids);
        if self.moved_plausibly(&at_rest, found) && self.images_fit(&at_rest, found) {
            Status::OK
        } else {
            Status::MARKERS_IMPLAUSIBLE
        }
    }

    fn moved_plausibly(&self, rest: &Pattern, found: &Found) -> bool {
        let now = &found.pattern;
        let change = |now: [i64; 2], rest: [i64; 2]| length([now[0] - rest[0], now[1] - rest[1]]);
        let shift = i64::from(distance(now.center, rest.center).0);
        change(now.strain, rest.strain) <= self.strain_limit(rest, now, shift)
            && change(now.taper, rest.taper) <= TAPER
            && (now.turn.0 - rest.turn.0).abs() <= TURN.0
            && shift * 256 <= rest.half_side * SHIFT
            && (rest.half_side * SCALE.0..=rest.half_side * SCALE.1)
                .contains(&(now.half_side * 256))
    }

    /// Of 65,536.
    fn strain_limit(&self, rest: &Pattern, now: &Pattern, shift: i64) -> i64 {
        if !self.own_rest {
            return STRAIN_FOREIGN;
        }
        // A marker's distance from the centre is √2 half sides; displaced by δ it strains by δ over four of those.
        let distance = (now.half_side * 363) >> 8;
        let displacement = match self.settings.centroid {
            CentroidEstimator::RednessWeighted => STRAIN_WEIGHTED,
            CentroidEstimator::BinaryMask => STRAIN_BINARY,
        };
        let part = (shift << 16) / rest.half_side.max(1);
        part_of(displacement, 4 * distance) + ((STRAIN_BY_SHIFT * part * part) >> 17)
    }

    fn images_fit(&self, at_rest: &Pattern, found: &Found) -> bool {
        let (geometry, rest) = (&self.settings.geometry, self.rest);
        let taper = length(found.pattern.taper);
        let shift = part_of(
            distance(found.pattern.center, at_rest.center).0.into(),
            at_rest.half_side,
        );
        let dilations = i64::from(self.settings.dilations);
        let hollow = HOLLOW + HOLLOW_BY_DILATIONS * dilations * dilations;
        let at_rest_across = i64::from(geometry.across(geometry.rest_distance()).0);
        let (mut narrowest, mut widest, mut width) = (i64::MAX, 0, i64::MAX);
        for (identity, shape) in found.shapes.iter().enumerate() {
            let Some(seen) = shape.seen_from(found.pattern.center) else {
                return false;
            };
            let distance = distance(rest.features.centroids[identity], at_rest.center);
            let edge = edge_at_rest(geometry, distance, rest.areas[identity]);
            let expected = i64::from(geometry.across(seen.distance).0);
            let lopsided = LOPSIDED_PIXELS + seen.across * LOPSIDED / 256;
            if !width_fits(expected, &seen, edge)
                || !lies_straight(&seen, taper)
                || shape.hollow > hollow
                || seen.lean > lean_limit(expected, at_rest_across)
                || shape.lopsided > lopsided
            {
                return false;
            }
            let aspect = (seen.along << 16) / seen.across.max(1);
            (narrowest, widest) = (narrowest.min(aspect), widest.max(aspect));
            width = width.min(seen.across);
        }
        let spread = ((widest - narrowest) << 16) / widest.max(1);
        evenly_coloured(found, width)
            && spread <= ASPECT + part_of(ASPECT_PIXELS, width) + ASPECT_TAPER * taper + shift
    }
}

/// Whether all markers are alike in their mean weight; `width` is that of the narrowest. Always without weights.
fn evenly_coloured(found: &Found, width: i64) -> bool {
    let sum: i64 = found.shapes.iter().map(|shape| shape.density).sum();
    let limit = DENSITY + (DENSITY_AREA << 48) / (width * width).max(1);
    let differs = |density: i64| (4 * density - sum).abs();
    let shapes = found.shapes.iter();
    shapes.map(|shape| differs(shape.density)).max() <= Some((sum * limit) >> 16)
}

/// For a marker that the optics makes so wide now, and so wide at rest.
fn lean_limit(now: i64, at_rest: i64) -> i64 {
    LEAN.max(LEAN * now / at_rest.max(1))
}

/// Whether a marker is as wide as the optics makes it: `expected`, and what the mask adds.
fn width_fits(expected: i64, seen: &Seen, edge: i64) -> bool {
    let excess = (seen.across - edge - expected).abs();
    excess <= expected * WIDTH / 256 + WIDTH_PIXELS
}

fn lies_straight(seen: &Seen, taper: i64) -> bool {
    seen.skew.abs() <= part_of(SKEW_PIXELS, seen.across) + taper
}

/// A length as a part of another, of 65,536.
fn part_of(length: i64, whole: i64) -> i64 {
    (length << 16) / whole.max(1)
}

/// What the mask added to a marker's diameters at rest, px in Q16.16.
///
/// At rest the film is flat, and the optics gives the marker's image: t across the radius, q = t·sin θ·cos θ/θ along
/// it. So (t + e)(q + e)·π/4 is the area: e = (√((t − q)² + 16·area/π) − t − q)/2.
fn edge_at_rest(geometry: &Geometry, distance: Px, area: u32) -> i64 {
    /// 16/π in Q32.
    const SIXTEEN_OVER_PI: u64 = 21_874_088_818;
    let across = i64::from(geometry.across(distance).0);
    let along = i64::from(geometry.along_flat(distance).0);
    // Below 2⁶⁴: the diameters are of a picture, and the area is at most 640,000 px.
    let squared = (across - along).unsigned_abs().pow(2) + u64::from(area) * SIXTEEN_OVER_PI;
    let root = squared.isqrt() as i64;
    (root - across - along) / 2
}
