//! Decides whether four markers may give a force, by comparing them with a rest position.
//!
//! Each limit is between the effect of a load on the markers and that of a false, cut or half dark
//! marker. The effect of loads was measured on rendered frames of the film's curves at QVGA and
//! 800×600, both presets. Forces were up to 0.25 N tilted by up to 12°, tip offsets up to 0.5 mm.
//! Each limit's comment gives the largest value seen. Lengths that come from the pixel grid do not
//! grow with the frame. A model of presses in the middle would give wrong forces for presses far
//! off it; they are refused because they strain the pattern. A model with place outputs has wider
//! limits ([`Reading`]).

use super::{
    Found, Image,
    pattern::{Pattern, distance, is_within, larger, length},
    reading::{Reading, STEEP_TAPER},
    shape::RadialShape,
};
use crate::markers::dilate::MAX_DILATIONS;
use crate::markers::kernels::sqrt;
use crate::markers::settings::Settings;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::Px;

/// Strain of binary centroids against this unit's own rest, as the displacement of one marker that
/// causes it, px (largest seen: 0.7 at QVGA, 0.26 at 800×600). For weighted ones:
/// [`Reading::displacement`]. It bounds the displacement of a false marker.
const STRAIN_BINARY: f32 = 0.7;
/// Strain against a model's rest: another unit's markers are at slightly different places.
const STRAIN_FOREIGN: f32 = 0.015;
/// Turn against the rest: the tangent of 5° (largest seen: 0.1°).
const TURN: f32 = 0.087_489;
/// Shift of the centre against the rest, relative to the rest's half side (largest seen: 0.11).
const SHIFT: f32 = 0.352;
/// Size relative to the rest (seen: 1 to 1.71).
const SCALE: (f32, f32) = (0.852, 2.0);
/// Width across the radius may deviate by [`Reading::width`] of it, and by this many px (largest
/// seen: 0.3). Detects eaten or swollen edges.
const WIDTH_PIXELS: f32 = 0.35;
/// The narrowest marker's aspect over the widest's is at least 1 minus the following: 0.05, 0.5 px
/// of its width, 6 times the taper, and the shift over the rest's half side. The film is steeper on
/// the side that comes nearer, and where an off-centre tip is. Detects one marker eaten or cut
/// along the radius.
const ASPECT: f32 = 0.05;
const ASPECT_PIXELS: f32 = 0.5;
const ASPECT_TAPER: f32 = 6.0;
/// Skew: 1 px of its width (largest seen: 0.91 px) and the taper. Detects a marker eaten or cut on
/// one side.
const SKEW_PIXELS: f32 = 1.0;
/// Hollowness, px², with none to three dilations, which make a disc slightly square (largest seen:
/// 0.20, 0.20, 0.28 and 0.44). Detects a dented, notched or grown marker.
pub(super) const HOLLOW: [f32; 1 + MAX_DILATIONS as usize] = [0.22, 0.22, 0.31, 0.49];
/// Smallest number of pixels that passed the threshold themselves, before dilation: that of an
/// ellipse with smaller diameters than the mask's. They are smaller by the part that dilation adds,
/// 8/π px each time, and by 0.328 px (largest seen: 0.27). A dilation adds 2 px to width and
/// height, 8·r + 4 px to a disc's area. Fewer pixels mean holes, which dilation closes: white
/// pixels, stripes, spots of light.
const DILATED: f32 = 8.0 / core::f32::consts::PI;
const HOLES: f32 = 0.328;
/// Lean: at most 0.3 px² for a marker as wide as at rest, in proportion to its width for a wider
/// one: the lens bends near images (largest seen: 0.16 near rest, 0.26 at 1.5 times the width).
/// Detects a marker cut or grown on one side.
const LEAN: f32 = 0.3;
/// Mean weight of a marker's pixels against that of all four: 0.015, and 12 px² over its width's
/// square. Seen at QVGA: more in 6 of 20,000 frames, 13.1 px² at most; at 800×600 less than 0.012
/// in all. Detects stripes, stains or glare inside a marker, where the dilated mask closes.
const DENSITY: f32 = 0.015;
const DENSITY_AREA: f32 = 12.0;
/// Largest difference between markers of the width that the mask adds to a diameter at rest, 1 px
/// (largest seen: 0.8 on units as people build them). Detects one marker cut or grown.
const EDGES_APART: f32 = 1.0;
/// Centroid against bounding box: 0.6 px and 0.0313 of its width. Detects a marker cut or grown on
/// one side.
pub(super) const LOPSIDED_PIXELS: f32 = 0.6;
pub(super) const LOPSIDED: f32 = 0.0313;

/// The rest position that four markers are compared with, and all numbers that follow from it.
#[derive(Clone, Debug)]
pub struct Trust {
    at_rest: Pattern,
    /// Width that the mask added to each marker's diameters at rest, px.
    edges: [f32; 4],
    /// One over a marker's width at rest, px.
    by_rest_width: f32,
    /// One over half the pattern's side at rest, px.
    by_half_side: f32,
    /// Factor of the pixel format on limits of second moments that come from the pixel grid. YUV422
    /// has one Cr for two columns.
    grid: f32,
    /// The same factor on limits of means, which the format hardly changes: nine eighths.
    grid_of_means: f32,
    /// Largest hollowness.
    hollow: f32,
    /// Difference that is allowed between the mask's diameters and those of the passed pixels, px.
    rim: f32,
    /// Strain as the displacement of one marker that causes it, px; `None` against a model's rest.
    displacement: Option<f32>,
    reading: Reading,
}

impl Trust {
    /// For markers found with these settings, and this rest position. `own_rest` is true if it was
    /// taken on this unit; `reading` is the kind of contact.
    pub fn new(settings: &Settings, rest: &[Marker; 4], own_rest: bool, reading: Reading) -> Trust {
        let geometry = &settings.geometry;
        let at_rest = Pattern::of_centroids(rest.map(|marker| (marker.x, marker.y)));
        let (grid, grid_of_means) = grid(settings.threshold.format());
        let displacement = match settings.centroid {
            CentroidEstimator::RednessWeighted => grid_of_means * reading.displacement,
            CentroidEstimator::BinaryMask => grid * STRAIN_BINARY,
        };
        let hollow = HOLLOW[usize::from(settings.dilations.min(MAX_DILATIONS))];
        let rest_width = geometry.across(geometry.rest_distance());
        Trust {
            edges: rest.map(|marker| {
                let distance = distance((marker.x, marker.y), at_rest.center);
                let distance = Px((distance * Px::ONE.0 as f32) as i32);
                edge_at_rest(geometry, distance, marker.area)
            }),
            by_rest_width: 1.0 / rest_width.to_f32().max(LEAST_LENGTH),
            by_half_side: 1.0 / at_rest.half_side.max(LEAST_LENGTH),
            at_rest,
            grid,
            grid_of_means,
            hollow: grid * (hollow + reading.hollow),
            rim: match settings.dilations {
                0 => 0.0,
                times => f32::from(times) * DILATED + HOLES,
            },
            displacement: own_rest.then_some(displacement),
            reading,
        }
    }

    /// The width that the mask added to a marker's diameters at rest, px; `None` if there is no
    /// such marker.
    pub(super) fn edge(&self, identity: usize) -> Option<f32> {
        self.edges.get(identity).copied()
    }

    /// Returns [`Status::OK`] if these markers may give a force, otherwise
    /// [`Status::MARKERS_IMPLAUSIBLE`].
    pub fn judge(&self, found: &Found) -> Status {
        let shift = distance(found.pattern.center, self.at_rest.center) * self.by_half_side;
        if self.moved_plausibly(&found.pattern, shift) && self.images_fit(found, shift) {
            Status::OK
        } else {
            Status::MARKERS_IMPLAUSIBLE
        }
    }

    /// Here and below, `shift` is the shift of the centre over the half side at rest.
    fn moved_plausibly(&self, now: &Pattern, shift: f32) -> bool {
        let rest = &self.at_rest;
        let change = |now: [f32; 2], rest: [f32; 2]| [now[0] - rest[0], now[1] - rest[1]];
        let taper = length(change(now.taper, rest.taper));
        let scale = now.half_side * self.by_half_side;
        let ([cos, sin], [rest_cos, rest_sin]) = (now.turn, rest.turn);
        let turned = [
            cos * rest_cos + sin * rest_sin,
            sin * rest_cos - cos * rest_sin,
        ];
        is_within(
            change(now.strain, rest.strain),
            self.strain_limit(now, shift, taper),
        ) && taper <= self.reading.taper
            && turned[1].abs() <= turned[0] * TURN
            && shift <= SHIFT
            && (SCALE.0..=SCALE.1).contains(&scale)
    }

    fn strain_limit(&self, now: &Pattern, shift: f32, taper: f32) -> f32 {
        let always = self.reading.strain_always;
        let Some(displacement) = self.displacement else {
            return larger(STRAIN_FOREIGN, always);
        };
        // A marker's distance from the centre is √2 half sides. Displaced by δ it causes a strain
        // of δ over four of those, and √2 times as much taper: that part is not from a tip.
        let displaced = displacement / (FOUR_DISTANCES * now.half_side);
        let tapered = larger(taper - displaced * core::f32::consts::SQRT_2, 0.0);
        let limit = displaced
            + shift * shift * self.reading.strain_by_shift
            + tapered * self.reading.strain_by_taper;
        larger(limit, always)
    }

    fn images_fit(&self, found: &Found, shift: f32) -> bool {
        let taper = length(found.pattern.taper);
        let (mut narrowest, mut widest, mut by_width) = (f32::INFINITY, 0.0_f32, 0.0_f32);
        for (image, edge) in found.images.iter().zip(&self.edges) {
            if !self.image_fits(image, *edge, taper) {
                return false;
            }
            let aspect = image.radial.along * image.radial.by_across;
            narrowest = if aspect < narrowest {
                aspect
            } else {
                narrowest
            };
            widest = larger(widest, aspect);
            by_width = larger(by_width, image.radial.by_across);
        }
        let aspect = ASPECT
            + by_width * (self.grid * ASPECT_PIXELS)
            + taper * ASPECT_TAPER
            + shift * self.reading.aspect_by_shift
            + self.reading.aspect_always;
        widest - narrowest <= aspect * widest && self.evenly_coloured(found, shift, by_width)
    }

    fn image_fits(&self, image: &Image, edge: f32, taper: f32) -> bool {
        let Image {
            radial, expected, ..
        } = image;
        let width = radial.across;
        let lopsided = self.grid_of_means * LOPSIDED_PIXELS + width * LOPSIDED;
        let skew = self.grid * SKEW_PIXELS * radial.by_across
            + taper * self.reading.skew_by_taper
            + self.reading.skew_always;
        // The limit grows if the optics make the marker wider than at rest.
        let wider = larger(expected * self.by_rest_width, 1.0);
        let by_square = taper * self.reading.lean_by_taper
            + larger(taper - STEEP_TAPER, 0.0) * self.reading.lean_by_steep_taper;
        let bent = width * width * by_square;
        let lean = (LEAN * wider + bent) * (0.5 * (self.grid + 1.0));
        self.width_fits(*expected, radial, edge)
            && radial.skew.abs() <= skew
            && image.hollow <= self.hollow
            && radial.squared_lean <= lean * lean
            && image.lopsided <= lopsided
            && is_filled(image, self.rim, self.reading.holes)
    }

    /// Whether a marker has the width `expected` by the optics, plus the width that the mask adds.
    fn width_fits(&self, expected: f32, radial: &RadialShape, edge: f32) -> bool {
        let excess = radial.across - edge - expected;
        excess.abs() <= expected * self.reading.width + self.grid_of_means * WIDTH_PIXELS
    }

    /// Whether the mean weights are alike to the limit at this shift; if the reading asks for it,
    /// also without the mask's edge. `by_width` is one over the narrowest marker's width.
    fn evenly_coloured(&self, found: &Found, shift: f32, by_width: f32) -> bool {
        let over_square = |area: f32| self.grid * area * (by_width * by_width);
        let densities = found.images.each_ref().map(|image| image.density);
        let more = shift * self.reading.density_by_shift + over_square(DENSITY_AREA);
        let inner = |area: f32| {
            let [a, b, c, d] = &found.images;
            let [e, f, g, h] = self.edges;
            let pairs = [(a, e), (b, f), (c, g), (d, h)];
            let densities = pairs.map(|(image, edge)| inner_density(image, edge));
            are_alike(densities, over_square(area))
        };
        are_alike(densities, more) && self.reading.inner_density_area.is_none_or(inner)
    }
}

/// The factors of a pixel format on limits of second moments, and of means, that come from the
/// pixel grid.
pub(super) fn grid(format: PixelFormat) -> (f32, f32) {
    match format {
        PixelFormat::Yuv422 => (2.0, 1.125),
        PixelFormat::Rgb565 | PixelFormat::Mono => (1.0, 1.0),
    }
}

/// Four times a marker's distance from the centre, in half sides.
const FOUR_DISTANCES: f32 = 4.0 * core::f32::consts::SQRT_2;
/// Smallest divisor that is a length, px.
const LEAST_LENGTH: f32 = 1.0 / 65_536.0;

/// Returns whether markers of these areas at rest are equal: discs of one size on a flat film, to
/// whose diameters the mask adds the same width.
pub fn are_equal(geometry: &Geometry, areas: [u32; 4]) -> bool {
    let edges = areas.map(|area| edge_at_rest(geometry, geometry.rest_distance(), area));
    let least = edges.iter().copied().fold(f32::INFINITY, f32::min);
    edges.iter().all(|edge| edge - least <= EDGES_APART)
}

/// Whether four mean weights are alike, to 0.015 of them and `more`; true without weights.
fn are_alike(densities: [f32; 4], more: f32) -> bool {
    let [a, b, c, d] = densities;
    let sum = a + b + c + d;
    let allowed = sum * (DENSITY + more);
    densities
        .iter()
        .all(|density| (4.0 * density - sum).abs() <= allowed)
}

/// The mean weight of a marker without the edge that the mask adds. The edge weighs little, and is
/// a larger part of a narrow image: e/a + e/b of an ellipse a by b, if it adds e to both. Only
/// without the edge are images of different aspects comparable.
fn inner_density(image: &Image, edge: f32) -> f32 {
    let outer = edge * image.radial.by_across + edge / image.radial.along;
    image.density / larger(1.0 - outer, 0.125)
}

/// Whether enough pixels passed, for diameters that are smaller by `rim` px, except for the part
/// `holes`.
fn is_filled(image: &Image, rim: f32, holes: f32) -> bool {
    let (across, along) = (image.radial.across, image.radial.along);
    let least = image.area as f32 * larger(across - rim, 0.0) * larger(along - rim, 0.0);
    image.passed as f32 * across * along >= least * (1.0 - holes)
}

/// Returns the width that the mask added to a marker's diameters at rest, px.
///
/// At rest the film is flat, and the optics give the marker's image: t across the radius, q = t·sin
/// θ·cos θ/θ along it. So (t + e)(q + e)·π/4 is the area: e = (√((t − q)² + 16·area/π) − t − q)/2.
fn edge_at_rest(geometry: &Geometry, distance: Px, area: u32) -> f32 {
    const SIXTEEN_OVER_PI: f32 = 16.0 / core::f32::consts::PI;
    let across = geometry.across(distance).to_f32();
    let along = geometry.along_flat(distance).to_f32();
    let squared = (across - along) * (across - along) + area as f32 * SIXTEEN_OVER_PI;
    0.5 * (sqrt(squared) - across - along)
}
