//! Whether four markers may make a force: how they compare with a rest position.
//!
//! The limits stand between what any load does to the markers and what a false, cut or half dark marker does. The
//! first was measured on rendered frames of four film shapes (tent, membrane, bowl, spike) at QVGA and 800×600, forces
//! to 0.4 N tilted by up to 17°, pressed in the middle and up to 2 mm off it; each limit's comment gives the largest
//! value seen. Presses farther off the middle are refused where they strain the pattern: a model of presses in
//! the middle would read them wrong.

use super::{
    Found,
    pattern::{Pattern, distance, length},
    shape::Seen,
};
use crate::{
    geometry::Geometry,
    model::Rest,
    status::Status,
    units::{MilliDegrees, Px},
};

/// Strain against the rest's: 0.015 (seen: 0.002 pressed in the middle, 0.01 off it), of 65,536. It lets a marker be
/// false by 4r · 0.015: 5 px where r = 84 px.
const STRAIN: i64 = 983;
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
/// The narrowest marker's aspect over the widest's: 1 less 0.05 less 0.5 px of its width less 6 times the taper, for
/// the film is steeper on the side that comes nearer. One marker eaten or cut along the radius.
const ASPECT: i64 = 3_277;
const ASPECT_PIXELS: i64 = 32_768;
const ASPECT_TAPER: i64 = 6;
/// Skew: 0.04 and 0.3 px of its width and 1.5 times the taper. Eaten or cut on one side.
const SKEW: i64 = 2_621;
const SKEW_PIXELS: i64 = 19_661;
/// Halves of the taper.
const SKEW_TAPER: i64 = 3;
/// Fill: at least 0.98 (seen: 0.992), of 65,536.
const FILL: i64 = 64_225;
/// Centroid against bounding box: 0.6 px and 0.03 of its width (of 256). Cut or grown on one side.
const LOPSIDED_PIXELS: i64 = 39_322;
const LOPSIDED: i64 = 8;

/// Says whether these markers may make a force: [`Status::OK`] or [`Status::MARKERS_IMPLAUSIBLE`].
pub fn judge(geometry: &Geometry, rest: &Rest, found: &Found) -> Status {
    let at_rest = Pattern::of_centroids(rest.features.centroids);
    if moved_plausibly(&at_rest, &found.pattern) && images_fit(geometry, rest, &at_rest, found) {
        Status::OK
    } else {
        Status::MARKERS_IMPLAUSIBLE
    }
}

fn moved_plausibly(rest: &Pattern, now: &Pattern) -> bool {
    let change = |now: [i64; 2], rest: [i64; 2]| length([now[0] - rest[0], now[1] - rest[1]]);
    let shift = i64::from(distance(now.center, rest.center).0);
    change(now.strain, rest.strain) <= STRAIN
        && change(now.taper, rest.taper) <= TAPER
        && (now.turn.0 - rest.turn.0).abs() <= TURN.0
        && shift * 256 <= rest.half_side * SHIFT
        && (rest.half_side * SCALE.0..=rest.half_side * SCALE.1).contains(&(now.half_side * 256))
}

fn images_fit(geometry: &Geometry, rest: &Rest, at_rest: &Pattern, found: &Found) -> bool {
    let taper = length(found.pattern.taper);
    let (mut narrowest, mut widest, mut width) = (i64::MAX, 0, i64::MAX);
    for (identity, shape) in found.shapes.iter().enumerate() {
        let Some(seen) = shape.seen_from(found.pattern.center) else {
            return false;
        };
        let distance = distance(rest.features.centroids[identity], at_rest.center);
        let edge = edge_at_rest(geometry, distance, rest.areas[identity]);
        let limit = LOPSIDED_PIXELS + seen.across * LOPSIDED / 256;
        if !width_fits(geometry, &seen, edge)
            || !lies_straight(&seen, taper)
            || shape.fill < FILL
            || shape.lopsided > limit
        {
            return false;
        }
        let aspect = (seen.along << 16) / seen.across.max(1);
        (narrowest, widest) = (narrowest.min(aspect), widest.max(aspect));
        width = width.min(seen.across);
    }
    let spread = ((widest - narrowest) << 16) / widest.max(1);
    spread <= ASPECT + part_of(ASPECT_PIXELS, width) + ASPECT_TAPER * taper
}

fn width_fits(geometry: &Geometry, seen: &Seen, edge: i64) -> bool {
    let expected = i64::from(geometry.across(seen.distance).0);
    let excess = (seen.across - edge - expected).abs();
    excess <= expected * WIDTH / 256 + WIDTH_PIXELS
}

fn lies_straight(seen: &Seen, taper: i64) -> bool {
    seen.skew.abs() <= SKEW + part_of(SKEW_PIXELS, seen.across) + SKEW_TAPER * taper / 2
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
