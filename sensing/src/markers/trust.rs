//! Whether four markers may make a force: how they compare with a rest position.
//!
//! The limits stand between what a load does to the markers and what a false, cut or half dark marker does. The first
//! was measured on rendered frames of the film's curves at QVGA and 800×600, both presets: forces to 0.25 N tilted by up
//! to 12°, tip offsets to 0.5 mm. Each limit's comment gives the largest value seen. Lengths do not grow with the frame
//! where they come of the pixel grid. Presses far off the middle are refused where they strain the pattern: a model of
//! presses in the middle would read them wrong.

use super::{
    Found, Image,
    pattern::{Pattern, distance, length},
    reading::Reading,
    shape::Seen,
};
use crate::{
    division::{Divisor, signed_quotient},
    geometry::Geometry,
    model::{CentroidEstimator, ContactReading, Rest},
    root::root,
    settings::Settings,
    status::Status,
    threshold::PixelFormat,
    units::{MilliDegrees, Px},
};

/// Strain against this unit's own rest, as the displacement of one marker that makes it: 0.25 px for weighted centroids
/// (seen: 0.14, and 0.2 at four-fold noise), 0.7 px for binary ones (seen: 0.53 at QVGA, 0.2 at 800×600). It is what a
/// thing that stands in for a marker may be off.
const STRAIN_WEIGHTED: i64 = 16_384;
const STRAIN_BINARY: i64 = 45_875;
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

/// What four markers are compared with: a rest position, and all that follows from it before there is a frame.
#[derive(Clone, Debug)]
pub struct Trust {
    at_rest: Pattern,
    /// What the mask added to each marker's diameters at rest, px in Q16.16.
    edges: [i64; 4],
    /// By a marker's width at rest, px in Q16.16.
    by_rest_width: Divisor,
    /// By half the pattern's side at rest, px in Q16.16.
    by_half_side: Divisor,
    /// Limits that come of the pixel grid are so many times those of other formats: YUV422 has one Cr for two columns.
    grid: i64,
    /// Largest hollowness.
    hollow: i64,
    /// Strain as the displacement of one marker that makes it, px in Q16.16; `None` against a model's rest.
    displacement: Option<i64>,
    reading: Reading,
}

impl Trust {
    /// For markers found with these settings that rest there; `own_rest` says whether that was taken on this unit, and
    /// `contact` what presses.
    pub fn new(settings: &Settings, rest: &Rest, own_rest: bool, contact: ContactReading) -> Trust {
        let geometry = &settings.geometry;
        let at_rest = Pattern::of_centroids(rest.features.centroids);
        let dilations = i64::from(settings.dilations);
        let grid = match settings.threshold.format() {
            PixelFormat::Yuv422 => 2,
            PixelFormat::Rgb565 | PixelFormat::Mono => 1,
        };
        let displacement = match settings.centroid {
            CentroidEstimator::RednessWeighted => STRAIN_WEIGHTED,
            CentroidEstimator::BinaryMask => STRAIN_BINARY,
        };
        Trust {
            edges: core::array::from_fn(|identity| {
                let distance = distance(rest.features.centroids[identity], at_rest.center);
                edge_at_rest(geometry, distance, rest.areas[identity])
            }),
            by_rest_width: divisor(geometry.across(geometry.rest_distance()).0.into()),
            by_half_side: divisor(at_rest.half_side),
            at_rest,
            grid,
            hollow: grid * (HOLLOW + HOLLOW_BY_DILATIONS * dilations * dilations),
            displacement: own_rest.then_some(grid * displacement),
            reading: Reading::of(contact),
        }
    }

    /// Says whether these markers may make a force: [`Status::OK`] or [`Status::MARKERS_IMPLAUSIBLE`].
    pub fn judge(&self, found: &Found) -> Status {
        let moved = distance(found.pattern.center, self.at_rest.center);
        let shift = self.by_half_side.signed_quotient(i64::from(moved.0) << 16);
        if self.moved_plausibly(&found.pattern, moved, shift) && self.images_fit(found, shift) {
            Status::OK
        } else {
            Status::MARKERS_IMPLAUSIBLE
        }
    }

    /// `shift` is that of the centre over the half side at rest, of 65,536, here and below.
    fn moved_plausibly(&self, now: &Pattern, moved: Px, shift: i64) -> bool {
        let rest = &self.at_rest;
        let change = |now: [i64; 2], rest: [i64; 2]| length([now[0] - rest[0], now[1] - rest[1]]);
        let taper = change(now.taper, rest.taper);
        change(now.strain, rest.strain) <= self.strain_limit(now, shift, taper)
            && taper <= TAPER
            && (now.turn.0 - rest.turn.0).abs() <= TURN.0
            && i64::from(moved.0) * 256 <= rest.half_side * SHIFT
            && (rest.half_side * SCALE.0..=rest.half_side * SCALE.1)
                .contains(&(now.half_side * 256))
    }

    /// Of 65,536.
    fn strain_limit(&self, now: &Pattern, shift: i64, taper: i64) -> i64 {
        let Some(displacement) = self.displacement else {
            return STRAIN_FOREIGN;
        };
        // A marker's distance from the centre is √2 half sides; displaced by δ it strains by δ over four of those, and
        // tapers by √2 times as much: that part of a taper is no tip's.
        let distance = (now.half_side * 363) >> 8;
        let displaced = part_of(displacement, 4 * distance);
        let tapered = (taper - ((displaced * 363) >> 8)).max(0);
        displaced
            + ((self.reading.strain_by_shift * shift * shift) >> 17)
            + ((self.reading.strain_by_taper * tapered) >> 8)
    }

    fn images_fit(&self, found: &Found, shift: i64) -> bool {
        let taper = length(found.pattern.taper);
        let (mut narrowest, mut widest, mut width) = (i64::MAX, 0, i64::MAX);
        let mut inner_densities = [0; 4];
        let images = found.images.iter().zip(&self.edges);
        for ((image, edge), inner) in images.zip(&mut inner_densities) {
            let seen = &image.seen;
            let by_across = divisor(seen.across);
            if !self.image_fits(image, &by_across, *edge, taper) {
                return false;
            }
            let aspect = by_across.signed_quotient(seen.along << 16);
            (narrowest, widest) = (narrowest.min(aspect), widest.max(aspect));
            width = width.min(seen.across);
            if self.reading.inner_density_area.is_some() {
                *inner = inner_density(image, &by_across, *edge);
            }
        }
        let spread = part_of(widest - narrowest, widest);
        let aspect = ASPECT + part_of(self.grid * ASPECT_PIXELS, width) + ASPECT_TAPER * taper;
        let even = (self.reading.density_by_shift * shift) >> 8;
        let densities = found.images.each_ref().map(|image| image.density);
        evenly_coloured(
            &densities,
            even + over_square(self.grid * DENSITY_AREA, width),
        ) && (self.reading.inner_density_area).is_none_or(|area| {
            evenly_coloured(&inner_densities, over_square(self.grid * area, width))
        }) && spread <= aspect + ((self.reading.aspect_by_shift * shift) >> 8)
    }

    fn image_fits(&self, image: &Image, by_across: &Divisor, edge: i64, taper: i64) -> bool {
        let Image { seen, expected, .. } = image;
        let lopsided = self.grid * LOPSIDED_PIXELS + seen.across * LOPSIDED / 256;
        let skew = by_across.signed_quotient((self.grid * SKEW_PIXELS) << 16)
            + ((self.reading.skew_by_taper * taper) >> 8);
        // For a marker that the optics makes so wide now.
        let wider = self.by_rest_width.signed_quotient(LEAN * expected);
        let bent = (((seen.across >> 8) * (seen.across >> 8)) >> 16) * taper;
        let lean = LEAN.max(wider) + ((self.reading.lean_by_taper * bent) >> 16);
        width_fits(*expected, seen, edge, self.grid)
            && seen.skew.abs() <= skew
            && image.hollow <= self.hollow
            && seen.lean <= self.grid * lean
            && image.lopsided <= lopsided
    }
}

/// Whether all markers are alike in their mean weight, to 0.015 of it and `more`. Always without weights.
fn evenly_coloured(densities: &[i64; 4], more: i64) -> bool {
    let sum: i64 = densities.iter().sum();
    let differs = |density: &i64| (4 * density - sum).abs();
    densities.iter().map(differs).max() <= Some((sum * (DENSITY + more)) >> 16)
}

/// px² over the square of a width in Q16.16, of 65,536.
fn over_square(area: i64, width: i64) -> i64 {
    signed_quotient(area << 48, width * width)
}

/// The mean weight of a marker without what the mask adds around it, which weighs little and is a larger part of a narrow
/// image: of an ellipse a by b, e/a + e/b when it adds e to both. Images of other aspects are comparable only so.
fn inner_density(image: &Image, by_across: &Divisor, edge: i64) -> i64 {
    let outer = by_across.signed_quotient(edge << 16) + part_of(edge, image.seen.along);
    part_of(image.density, (65_536 - outer).max(1 << 13))
}

/// Whether a marker is as wide as the optics makes it: `expected`, and what the mask adds.
fn width_fits(expected: i64, seen: &Seen, edge: i64, grid: i64) -> bool {
    let excess = (seen.across - edge - expected).abs();
    excess <= expected * WIDTH / 256 + grid * WIDTH_PIXELS
}

/// A length as a part of another, of 65,536.
fn part_of(length: i64, whole: i64) -> i64 {
    signed_quotient(length << 16, whole.max(1))
}

/// By a length in Q16.16, which is below 2¹⁶ px; at least 2⁻¹⁶ px.
fn divisor(length: i64) -> Divisor {
    Divisor::new(u32::try_from(length.max(1)).unwrap_or(u32::MAX))
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
    (i64::from(root(squared)) - across - along) / 2
}
