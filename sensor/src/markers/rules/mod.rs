//! Four markers out of the blobs: correct or rejected, never silently wrong.
//!
//! The rules rest on optics and on the pattern's geometry, not on how the film gives:
//!
//! 1. *Candidates* (`shape`): blobs off the border, of a plausible area, filled like an ellipse.
//! 2. *Pattern* (`pattern`): four candidates, one in each quadrant around their own centre, that
//!    make a near-square.
//! 3. *Size*: a lens that is symmetric about its axis shows a circle about the axis as a circle, so
//!    it magnifies *across* the radius by image radius over film radius, whatever the film's height
//!    and tilt. A marker at distance r from the pattern's centre is therefore r·d/R wide across it,
//!    plus what dilation and soft edges add.
//! 4. *Trust* (`trust`): with a rest position, much tighter limits relative to it decide whether
//!    there may be a force. What the pattern does at a film's symmetric answer to any force bounds
//!    how far one marker may be displaced (strain); how little each image leans, is hollow or
//!    skewed, how alike their colours are, and how many of its pixels passed the threshold
//!    themselves, bounds what may be cut off, grown, hidden or holed.
//!
//! A rest position has none to be compared with. What shall become one ([`Found::may_rest`]) is
//! judged by 4 against itself, and by how alike the four are: they are punched alike, and a film at
//! rest is flat.
//!
//! Exactly one set of four must pass 1 to 3; two are ambiguous, however different.
//!
//! What stays unseen at QVGA (`tests/tests/markers.rs` and `tests/tests/hard_cases.rs` assert it on
//! rendered frames, and `hard-cases` of the tests prints a table): with weighted centroids and this
//! unit's own rest, a marker that is covered, glares or has red grown on it is off by less than
//! 0.3 px when it is accepted, as is a disc of its size in its place (0.04 mm away at most). At
//! 800×600 every hard case is within 0.15 px, but JPEG of quality 70 and less: up to 0.2 px. Under
//! a tip that sticks or slips the pattern may be strained more: 0.45 px, at 320×240 seldom 0.5 px
//! of JPEG of quality 30. Binary centroids are off by up to 0.36 px on honest frames, which no rule
//! can tell from a fault: there, 0.6 px for a covered marker, and 0.85 px for one under a red disc
//! of nearly its size. At 800×600 a disc of a marker's size in its place is accepted up to 0.3 px
//! away at small forces and 1.2 px under the largest sideways ones, which strain the film as much:
//! such a disc looks like a marker in everything else. Without an own rest position the pattern may
//! be strained by 5 px, for another unit's markers lie elsewhere.

mod central;
mod lean;
pub mod pattern;
mod reading;
mod shape;
mod trust;

pub use reading::Reading;
pub use trust::Trust;

use crate::markers::blob::Blob;
use crate::markers::settings::Settings;
use heapless::Vec;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;
use pattern::Pattern;
use shape::{RadialShape, Shape, nominal_edge};

/// Four markers, how their images look, and the pattern they make.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Markers 0–3.
    pub markers: [Marker; 4],
    /// Their images.
    images: [Image; 4],
    /// Their pattern.
    pattern: Pattern,
}

impl Found {
    /// Whether these are the images of four whole markers on a film at rest, by themselves: against
    /// the rest position that they would be.
    pub fn may_rest(&self, settings: &Settings) -> bool {
        let trust = Trust::new(settings, &self.markers, true, Reading::UNTOUCHED);
        let areas = self.markers.map(|marker| marker.area);
        trust.judge(self) == Status::OK && trust::are_equal(&settings.geometry, areas)
    }

    /// The same images, whose markers make the pattern that they make elsewhere: little farther
    /// than they are wide.
    pub fn moved_to(&self, markers: [Marker; 4]) -> Found {
        Found {
            pattern: Pattern::of_centroids(markers.map(|marker| (marker.x, marker.y))),
            markers,
            ..*self
        }
    }
}

/// What a rest position is to judge of a marker's image.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Image {
    /// As the pattern's centre sees it.
    radial: RadialShape,
    /// [`Shape::area`].
    area: u32,
    /// [`Shape::passed`].
    passed: u32,
    /// Its width by the optics, without what the mask adds, px.
    expected: f32,
    /// [`Shape::hollow`].
    hollow: f32,
    /// [`Shape::lopsided`].
    lopsided: f32,
    /// [`Shape::density`].
    density: f32,
}

/// More candidates than this are not sorted out: 8 make 70 sets of four.
const MAX_CANDIDATES: usize = 8;
/// A candidate has at least one part in this many of a marker's area at rest: markers only come
/// nearer.
const SMALLEST_PART: u32 = 3;
/// A candidate has at most this many times a marker's area at rest: at twice the rest's distance
/// from the axis it has less than four times, before dilation adds its share.
const LARGEST_MULTIPLE: u32 = 8;
/// Candidates fill their ellipse at least so far. A disc has 0.97 to 1 at any size and tilt, a half
/// disc 0.95, two touching discs 0.88, a crescent less.
const LEAST_FILL: f32 = 0.93;
/// How far a marker may be from the optical law in width: threshold, light and blur are unknown
/// before there is a rest position, and under a tip far off the middle the pattern's centre is not
/// on the axis.
const SIZE_TOLERANCE: f32 = 0.375;
/// Narrowest marker, along the radius over across it: foreshortened by distance and steepest film.
const LEAST_ASPECT: f32 = 0.199;
/// Widest: round, and the noise of a small picture.
const LARGEST_ASPECT: f32 = 1.152;

/// Finds the markers among the blobs of a frame. Holds all that follows from the settings before
/// there is a frame.
#[derive(Clone, Debug)]
pub struct Finder {
    /// Columns and rows of a frame.
    size: [u16; 2],
    /// The picture's middle.
    center: (Px, Px),
    /// A marker's distance from it at rest, px.
    rest_distance: f32,
    /// A marker's width across the radius over its distance from the middle: see
    /// [`Geometry::across`](hivtac_terms::geometry::Geometry::across).
    across: f32,
    /// What the mask adds to it, px.
    edge: f32,
    areas: (u32, u32),
    centroid: CentroidEstimator,
}

impl Finder {
    /// For frames that are scanned so.
    pub fn new(settings: &Settings) -> Finder {
        let geometry = &settings.geometry;
        let edge = nominal_edge(settings.dilations);
        let smallest = geometry.rest_area(Px(0)) / SMALLEST_PART;
        let largest = geometry.rest_area(edge).saturating_mul(LARGEST_MULTIPLE);
        Finder {
            size: [geometry.width, geometry.height],
            center: geometry.center(),
            rest_distance: geometry.rest_distance().to_f32(),
            across: geometry.marker_diameter.0 as f32 / geometry.marker_radius.0.max(1) as f32,
            edge: edge.to_f32(),
            areas: (smallest.max(1), largest),
            centroid: settings.centroid,
        }
    }

    /// The four markers among `blobs`.
    ///
    /// # Errors
    /// [`Status::MARKERS_MISSING`] with fewer than four candidates; [`Status::MARKERS_IMPLAUSIBLE`]
    /// when four of them make the pattern but their sizes do not fit it;
    /// else [`Status::MARKERS_AMBIGUOUS`]: two sets fit, or none does, or there are too many
    /// candidates.
    pub fn find(&self, blobs: &[Blob]) -> Result<Found, Status> {
        let mut candidates = Vec::<Shape, MAX_CANDIDATES>::new();
        for blob in blobs {
            if let Some(shape) = self.candidate(blob) {
                let pushed = candidates.push(shape);
                pushed.map_err(|_| Status::MARKERS_AMBIGUOUS)?;
            }
        }
        if candidates.len() < 4 {
            return Err(Status::MARKERS_MISSING);
        }
        let mut found = None;
        let mut reason = Status::MARKERS_AMBIGUOUS;
        for set in sets_of_four(candidates.len()) {
            let [Some(a), Some(b), Some(c), Some(d)] = set.map(|index| candidates.get(index))
            else {
                continue;
            };
            match self.examine([a, b, c, d]) {
                Ok(_) if found.is_some() => return Err(Status::MARKERS_AMBIGUOUS),
                Ok(set) => found = Some(set),
                Err(why) if why == Status::MARKERS_IMPLAUSIBLE => reason = why,
                Err(_) => {}
            }
        }
        found.ok_or(reason)
    }

    fn candidate(&self, blob: &Blob) -> Option<Shape> {
        if !self.may_be_marker(blob) {
            return None;
        }
        Shape::of_blob(blob, self.centroid).filter(|shape| shape.fill >= LEAST_FILL)
    }

    /// Plausible area, and no pixel on the border: what touches it is cut.
    fn may_be_marker(&self, blob: &Blob) -> bool {
        (self.areas.0..=self.areas.1).contains(&blob.area)
            && blob.x0 > 0
            && blob.y0 > 0
            && blob.x1 + 1 < self.size[0]
            && blob.y1 + 1 < self.size[1]
    }

    /// Whether four shapes are the markers.
    fn examine(&self, shapes: [&Shape; 4]) -> Result<Found, Status> {
        let shapes = pattern::identify(shapes).ok_or(Status::MARKERS_AMBIGUOUS)?;
        let pattern = Pattern::of_centroids(shapes.map(|shape| (shape.x, shape.y)));
        if !pattern.is_plausible(self.center, self.rest_distance) {
            return Err(Status::MARKERS_AMBIGUOUS);
        }
        let image = |shape| {
            self.image(shape, &pattern)
                .ok_or(Status::MARKERS_IMPLAUSIBLE)
        };
        let [a, b, c, d] = shapes;
        Ok(Found {
            markers: shapes.map(|shape| Marker {
                x: shape.x,
                y: shape.y,
                area: shape.area,
            }),
            images: [image(a)?, image(b)?, image(c)?, image(d)?],
            pattern,
        })
    }

    /// A marker's image, when its size fits its distance from the pattern's centre.
    fn image(&self, shape: &Shape, pattern: &Pattern) -> Option<Image> {
        let radial = shape.about(pattern.center)?;
        let expected = radial.distance * self.across;
        let excess = radial.across - self.edge - expected;
        let is_plausible = excess.abs() <= expected * SIZE_TOLERANCE
            && radial.along >= LEAST_ASPECT * radial.across
            && radial.along <= LARGEST_ASPECT * radial.across;
        is_plausible.then_some(Image {
            radial,
            area: shape.area,
            passed: shape.passed,
            expected,
            hollow: shape.hollow,
            lopsided: shape.lopsided,
            density: shape.density,
        })
    }
}

/// Every way to take four of `count` things, in order.
fn sets_of_four(count: usize) -> impl Iterator<Item = [usize; 4]> {
    (0..count).flat_map(move |a| {
        (a + 1..count).flat_map(move |b| {
            (b + 1..count).flat_map(move |c| (c + 1..count).map(move |d| [a, b, c, d]))
        })
    })
}
