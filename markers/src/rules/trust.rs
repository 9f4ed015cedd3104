//! Whether four markers may make a force: how they compare with a rest position.
//!
//! The limits stand between what a load does to the markers and what a false, cut or half dark
//! marker does. The first was measured on rendered frames of the film's curves at QVGA and 800×600,
//! both presets: forces to 0.25 N tilted by up to 12°, tip offsets to 0.5 mm. Each limit's comment
//! gives the largest value seen. Lengths do not grow with the frame where they come of the pixel
//! grid. A model of presses in the middle would read presses far off it wrong: they are refused
//! where they strain the pattern. One that tells places has wider limits ([`Reading`]).

use super::{
    Found, Image,
    pattern::{Pattern, distance, length},
    reading::Reading,
    shape::RadialShape,
};
use crate::dilate::MAX_DILATIONS;
use crate::settings::Settings;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::division::{Reciprocal, limited, scaled};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::marker::Marker;
use hivtac_terms::root::root;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::{MilliDegrees, Px};

/// Strain of binary centroids against this unit's own rest, as the displacement of one marker that
/// makes it: 0.7 px (seen: 0.7 at QVGA, 0.26 at 800×600). Of weighted ones:
/// [`Reading::displacement`]. It is what a thing that stands in for a marker may be off.
const STRAIN_BINARY: i32 = 45_875;
/// Strain against a model's rest, 0.015 of 65,536: another unit's markers are not quite where this
/// one's are.
const STRAIN_FOREIGN: i32 = 983;
/// Turn against the rest's: 5° (seen: 0.1°).
const TURN: MilliDegrees = MilliDegrees(5_000);
/// Shift of the centre against the rest's: 0.35 of the rest's half side (seen: 0.11), of 256.
const SHIFT: i64 = 90;
/// Size against the rest's: 0.85 to 2 (seen: 1 to 1.71), of 256.
const SCALE: (i64, i64) = (218, 512);
/// Width across the radius: off by [`Reading::width`] of it and 0.35 px (seen: 0.3 px). Eaten or
/// swollen edges.
const WIDTH_PIXELS: i32 = 22_938;
/// The narrowest marker's aspect over the widest's: 1 less 0.05 less 0.5 px of its width less 6
/// times the taper less the shift over the rest's half side: the film is steeper on the side that
/// comes nearer, and where an off-centre tip is. One marker eaten or cut along the radius.
const ASPECT: i32 = 3_277;
const ASPECT_PIXELS: i32 = 32_768;
const ASPECT_TAPER: i32 = 6;
/// Skew: 1 px of its width (seen: 0.91 px) and the taper. Eaten or cut on one side.
const SKEW_PIXELS: i32 = 65_536;
/// Hollowness: at most 0.22, 0.22, 0.31 and 0.49 px² with none to three dilations, which make a
/// disc a little square (seen: 0.20, 0.20, 0.28 and 0.44). Dented, notched, grown.
const HOLLOW: [i32; 1 + MAX_DILATIONS as usize] = [14_418, 14_418, 20_316, 32_113];
/// Pixels that passed the threshold themselves, before dilation: at least as many as an ellipse has
/// whose diameters are smaller than the mask's by what dilation adds to them, 8/π px each time (it
/// adds 2 px to the width and to the height of what it dilates, 8·r + 4 px to a disc's area), and
/// by 0.33 px (seen: 0.27). In px with 8 fractional bits. What is less are holes, which dilation
/// closes: white pixels, stripes, spots of light.
const DILATED: i32 = 652;
const HOLES: i32 = 84;
/// Lean: at most 0.3 px² for a marker as wide as at rest, and more as it is wider: the lens bends
/// what comes near (seen: 0.16 near rest, 0.26 at 1.5 times its width). Cut or grown on one side.
const LEAN: i32 = 19_661;
/// Mean weight of a marker's pixels against that of all four: 0.015 and 12 px² over its width's
/// square (seen at QVGA: more in 6 of 20,000 frames, 13.1 px² at most; at 800×600 less than 0.012
/// in all). Striped, stained or glaring inside, where the dilated mask closes.
const DENSITY: i32 = 983;
const DENSITY_AREA: i32 = 12;
/// What the mask adds to one marker's diameter at rest less what it adds to another's: 1 px (seen:
/// 0.8 on units as people build them). One marker cut or grown.
const EDGES_APART: i32 = 65_536;
/// Centroid against bounding box: 0.6 px and 0.03 of its width (of 256). Cut or grown on one side.
const LOPSIDED_PIXELS: i32 = 39_322;
const LOPSIDED: i32 = 8;

/// What four markers are compared with: a rest position, and all that follows from it before there
/// is a frame.
#[derive(Clone, Debug)]
pub struct Trust {
    at_rest: Pattern,
    /// What the mask added to each marker's diameters at rest, px in Q16.16.
    edges: [i32; 4],
    /// By a marker's width at rest, px in Q16.16.
    by_rest_width: Reciprocal,
    /// By half the pattern's side at rest, px in Q16.16.
    by_half_side: Reciprocal,
    /// Limits of a marker's second moments that come of the pixel grid are so many times those of
    /// other formats: YUV422 has one Cr for two columns. It hardly changes means: see
    /// [`grid_of_means`].
    grid: i32,
    /// Largest hollowness.
    hollow: i32,
    /// By how much the diameters of the pixels that passed may be smaller than the mask's, px with
    /// 8 fractional bits.
    rim: i32,
    /// Strain as the displacement of one marker that makes it, px in Q16.16; `None` against a
    /// model's rest.
    displacement: Option<i32>,
    reading: Reading,
}

impl Trust {
    /// For markers found with these settings that rest there; `own_rest` says whether that was
    /// taken on this unit, and `reading` what presses.
    pub fn new(settings: &Settings, rest: &[Marker; 4], own_rest: bool, reading: Reading) -> Trust {
        let geometry = &settings.geometry;
        let centroids = rest.map(|marker| (marker.x, marker.y));
        let at_rest = Pattern::of_centroids(centroids);
        let grid = match settings.threshold.format() {
            PixelFormat::Yuv422 => 2,
            PixelFormat::Rgb565 | PixelFormat::Mono => 1,
        };
        let displacement = match settings.centroid {
            CentroidEstimator::RednessWeighted => grid_of_means(grid, reading.displacement),
            CentroidEstimator::BinaryMask => grid * STRAIN_BINARY,
        };
        let hollow = HOLLOW[usize::from(settings.dilations.min(MAX_DILATIONS))];
        Trust {
            edges: core::array::from_fn(|identity| {
                let distance = distance(centroids[identity], at_rest.center);
                edge_at_rest(geometry, distance, rest[identity].area)
            }),
            by_rest_width: by(geometry.across(geometry.rest_distance()).0),
            by_half_side: by(at_rest.half_side),
            at_rest,
            grid,
            hollow: grid * (hollow + reading.hollow),
            rim: match i32::from(settings.dilations) {
                0 => 0,
                times => times * DILATED + HOLES,
            },
            displacement: own_rest.then_some(displacement),
            reading,
        }
    }

    /// Says whether these markers may make a force: [`Status::OK`] or
    /// [`Status::MARKERS_IMPLAUSIBLE`].
    pub fn judge(&self, found: &Found) -> Status {
        let moved = distance(found.pattern.center, self.at_rest.center);
        let shift = self.by_half_side.part(moved.0);
        if self.moved_plausibly(&found.pattern, moved, shift) && self.images_fit(found, shift) {
            Status::OK
        } else {
            Status::MARKERS_IMPLAUSIBLE
        }
    }

    /// `shift` is that of the centre over the half side at rest, of 65,536, here and below.
    fn moved_plausibly(&self, now: &Pattern, moved: Px, shift: i32) -> bool {
        let rest = &self.at_rest;
        // Plausible patterns differ by little.
        let change =
            |now: [i32; 2], rest: [i32; 2]| length([0, 1].map(|i| now[i].saturating_sub(rest[i])));
        let taper = change(now.taper, rest.taper);
        let (rest_side, side) = (i64::from(rest.half_side), 256 * i64::from(now.half_side));
        change(now.strain, rest.strain) <= self.strain_limit(now, shift, taper)
            && taper <= self.reading.taper
            && (now.turn.0 - rest.turn.0).abs() <= TURN.0
            && i64::from(moved.0) * 256 <= rest_side * SHIFT
            && (rest_side * SCALE.0..=rest_side * SCALE.1).contains(&side)
    }

    /// Of 65,536.
    fn strain_limit(&self, now: &Pattern, shift: i32, taper: i32) -> i32 {
        let always = self.reading.strain_always;
        let Some(displacement) = self.displacement else {
            return STRAIN_FOREIGN.max(always);
        };
        // A marker's distance from the centre is √2 half sides; displaced by δ it strains by δ over
        // four of those, and tapers by √2 times as much: that part of a taper is no tip's.
        let four_distances = scaled(now.half_side, 1_452, 8);
        let displaced = by(four_distances).part(displacement);
        let tapered = (taper - scaled(displaced, 363, 8)).max(0);
        let squared = scaled(shift, shift, 16);
        displaced
            .saturating_add(scaled(squared, self.reading.strain_by_shift, 1))
            .saturating_add(scaled(tapered, self.reading.strain_by_taper, 8))
            .max(always)
    }

    fn images_fit(&self, found: &Found, shift: i32) -> bool {
        let taper = length(found.pattern.taper);
        let (mut narrowest, mut widest, mut width) = (i32::MAX, 0, i32::MAX);
        let mut inner_densities = [0; 4];
        let images = found.images.iter().zip(&self.edges);
        for ((image, edge), inner) in images.zip(&mut inner_densities) {
            let radial = &image.radial;
            let by_across = by(radial.across);
            if !self.image_fits(image, &by_across, *edge, taper) {
                return false;
            }
            let aspect = by_across.part(radial.along);
            (narrowest, widest) = (narrowest.min(aspect), widest.max(aspect));
            width = width.min(radial.across);
            if self.reading.inner_density_area.is_some() {
                *inner = inner_density(image, &by_across, *edge);
            }
        }
        let by_width = by(width);
        let spread = by(widest).part(widest - narrowest);
        let aspect = ASPECT
            .saturating_add(by_width.part(self.grid * ASPECT_PIXELS))
            .saturating_add(scaled(taper, ASPECT_TAPER, 0))
            .saturating_add(scaled(shift, self.reading.aspect_by_shift, 8))
            .saturating_add(self.reading.aspect_always);
        let even = scaled(shift, self.reading.density_by_shift, 8);
        let densities = found.images.each_ref().map(|image| image.density);
        let over_square = |area: i32| over_square(self.grid * area, &by_width);
        evenly_coloured(&densities, even.saturating_add(over_square(DENSITY_AREA)))
            && (self.reading.inner_density_area)
                .is_none_or(|area| evenly_coloured(&inner_densities, over_square(area)))
            && spread <= aspect
    }

    fn image_fits(&self, image: &Image, by_across: &Reciprocal, edge: i32, taper: i32) -> bool {
        let Image {
            radial, expected, ..
        } = image;
        let lopsided =
            grid_of_means(self.grid, LOPSIDED_PIXELS) + scaled(radial.across, LOPSIDED, 8);
        let skew = by_across
            .part(self.grid * SKEW_PIXELS)
            .saturating_add(scaled(taper, self.reading.skew_by_taper, 8))
            .saturating_add(self.reading.skew_always);
        // For a marker that the optics makes so wide now.
        let wider = limited(
            self.by_rest_width
                .times(i64::from(LEAN) * i64::from(*expected)),
        );
        let bent = scaled(scaled(radial.across, radial.across, 32), taper, 0);
        let lean = LEAN
            .max(wider)
            .saturating_add(scaled(bent, self.reading.lean_by_taper, 16));
        self.width_fits(*expected, radial, edge)
            && radial.skew.saturating_abs() <= skew
            && image.hollow <= self.hollow
            && radial.lean <= scaled(lean, self.grid + 1, 1)
            && image.lopsided <= lopsided
            && is_filled(image, self.rim, self.reading.holes)
    }

    /// Whether a marker is as wide as the optics makes it: `expected`, and what the mask adds.
    fn width_fits(&self, expected: i32, radial: &RadialShape, edge: i32) -> bool {
        let excess = i64::from(radial.across) - i64::from(edge) - i64::from(expected);
        let pixels = grid_of_means(self.grid, WIDTH_PIXELS);
        excess.abs() <= i64::from(expected) * self.reading.width / 256 + i64::from(pixels)
    }
}

/// Whether markers of these areas at rest are equal: discs of one size on a flat film, to whose
/// diameters the mask adds the same.
pub fn are_equal(geometry: &Geometry, areas: [u32; 4]) -> bool {
    let edges = areas.map(|area| edge_at_rest(geometry, geometry.rest_distance(), area));
    let least = edges.iter().copied().min().unwrap_or_default();
    edges.iter().all(|edge| edge - least <= EDGES_APART)
}

/// Whether all markers are alike in their mean weight, to 0.015 of it and `more`. Always without
/// weights.
fn evenly_coloured(densities: &[i32; 4], more: i32) -> bool {
    // Below 2²⁸ each.
    let sum: i32 = densities.iter().sum();
    let differs = |density: &i32| (4 * density).abs_diff(sum);
    let allowed = scaled(sum, DENSITY.saturating_add(more), 16);
    densities.iter().map(differs).max() <= Some(allowed.unsigned_abs())
}

/// px² over the square of a width in Q16.16, of 65,536.
fn over_square(area: i32, by_width: &Reciprocal) -> i32 {
    // With 16 fractional bits over 16, and over 16 again.
    limited(by_width.times(by_width.times(i64::from(area) << 40) << 8))
}

/// The mean weight of a marker without what the mask adds around it, which weighs little and is a
/// larger part of a narrow image: of an ellipse a by b, e/a + e/b when it adds e to both. Images of
/// other aspects are comparable only so.
fn inner_density(image: &Image, by_across: &Reciprocal, edge: i32) -> i32 {
    let outer = by_across
        .part(edge)
        .saturating_add(by(image.radial.along).part(edge));
    by(65_536_i32.saturating_sub(outer).max(1 << 13)).part(image.density)
}

/// A limit of a mean over a marker, in YUV422 nine eighths of what it is in other formats.
fn grid_of_means(grid: i32, limit: i32) -> i32 {
    (grid + 7) * limit / 8
}

/// Whether enough pixels passed, for diameters that may be smaller by `rim`, px with 8 fractional
/// bits, but for `holes` of 256 of them. Both products are below 2⁵⁷: diameters are below 2¹⁸ then,
/// and an area is at most 640,000 px.
fn is_filled(image: &Image, rim: i32, holes: i64) -> bool {
    let [across, along] = [image.radial.across, image.radial.along].map(|length| length >> 8);
    let product = |count: u32, a: i32, b: i32| i64::from(count) * (i64::from(a) * i64::from(b));
    let least = product(image.area, (across - rim).max(0), (along - rim).max(0));
    product(image.passed, across, along) >= least - least / 256 * holes
}

/// By a length, at least the least one.
fn by(length: i32) -> Reciprocal {
    Reciprocal::of(length.max(1) as u32)
}

/// What the mask added to a marker's diameters at rest, px in Q16.16.
///
/// At rest the film is flat, and the optics gives the marker's image: t across the radius, q =
/// t·sin θ·cos θ/θ along it. So (t + e)(q + e)·π/4 is the area: e = (√((t − q)² + 16·area/π) − t −
/// q)/2.
fn edge_at_rest(geometry: &Geometry, distance: Px, area: u32) -> i32 {
    /// 16/π in Q32.
    const SIXTEEN_OVER_PI: u64 = 21_874_088_818;
    let across = i64::from(geometry.across(distance).0);
    let along = i64::from(geometry.along_flat(distance).0);
    // Below 2⁶⁴: the diameters are of a picture, and the area is at most 640,000 px.
    let squared = (across - along).unsigned_abs().pow(2) + u64::from(area) * SIXTEEN_OVER_PI;
    limited((i64::from(root(squared)) - across - along) / 2)
}
