//! Selects the four markers among the blobs: correct or rejected, never silently wrong.
//!
//! The rules follow from optics and from the pattern's geometry, not from the film's stiffness:
//!
//! 1. *Candidates* (`shape`): blobs that do not touch the border, of a plausible area, filled like
//!    an ellipse.
//! 2. *Pattern* (`pattern`): four candidates, one in each quadrant around their own centre, that
//!    form a near-square.
//! 3. *Size*: a lens that is symmetric about its axis images a circle about the axis as a circle.
//!    So it magnifies *across* the radius by image radius over film radius, whatever the film's
//!    height and tilt. A marker at distance r from the pattern's centre is therefore r·d/R wide
//!    across it, plus the width that dilation and soft edges add.
//! 4. *Trust* (`trust`): limits relative to a rest position are much tighter and decide whether the
//!    markers may give a force. The film answers any force symmetrically, so the pattern's strain
//!    bounds the displacement of a single marker. Four properties of the images bound cuts,
//!    growths, covers and holes: lean, hollowness and skew of each image, and the likeness of their
//!    colours. So does the number of pixels that passed the threshold themselves.
//!
//! A new rest position has no earlier one to be compared with. Rule 4 judges it against itself
//! ([`Found::may_rest`]), and the four markers must be alike: they are punched alike, and a film at
//! rest is flat.
//!
//! With a forward model, three markers may suffice (`three`): the model predicts the fourth one.
//! Markers of other layouts than the square of four are found by their rest places (`placed`).
//!
//! Exactly one set of four must pass rules 1 to 3; two such sets are ambiguous, however different.
//!
//! Largest errors of accepted markers, asserted on rendered frames by `tests/tests/markers.rs` and
//! `tests/tests/hard_cases.rs`; `hard-cases` of the tests prints a table:
//!
//! | centroids, frame, case | largest error |
//! |---|---|
//! | weighted, QVGA, own rest: a marker covered, glaring, or with red grown on it | 0.3 px |
//! | the same: a disc of a marker's size in its place, at most 0.04 mm away | 0.3 px |
//! | weighted, 800×600: every hard case | 0.15 px |
//! | weighted, 800×600: JPEG of quality 70 and less | 0.2 px |
//! | weighted, under a tip that sticks or slips | 0.45 px |
//! | the same, seldom, at 320×240: JPEG of quality 30 | 0.5 px |
//! | binary, undisturbed frames, which no rule can distinguish from a fault | 0.36 px |
//! | binary: a covered marker | 0.6 px |
//! | binary: a marker under a red disc of nearly its size | 0.85 px |
//! | 800×600: a disc of a marker's size in its place, small forces | 0.3 px |
//! | the same, largest sideways forces, which strain the film as much | 1.2 px |
//! | without an own rest position, as another unit's markers lie elsewhere | 5 px of strain |
//!
//! A disc of a marker's size looks like a marker in everything but the pattern's strain.

mod central;
mod lean;
pub mod pattern;
mod placed;
mod reading;
mod shape;
mod three;
mod trust;

pub use placed::Placed;
pub use reading::Reading;
pub use three::Three;
pub use trust::Trust;

use crate::markers::blob::Blob;
use crate::markers::settings::Settings;
use heapless::Vec;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;
use pattern::{Pattern, larger};
use shape::{RadialShape, Shape, nominal_edge};

/// Four markers, the properties of their images, and their pattern.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Markers 0–3.
    pub markers: [Marker; 4],
    /// Their images.
    images: [Image; 4],
    /// Their pattern.
    pattern: Pattern,
    /// The largest [`Shape::shift_px2`] of a marker.
    pub shift_px2: f32,
}

impl Found {
    /// Returns whether these are the images of four whole markers on a film at rest. They are
    /// compared with the rest position that they would become.
    pub fn may_rest(&self, settings: &Settings) -> bool {
        let trust = Trust::new(settings, &self.markers, true, Reading::UNTOUCHED);
        let areas = self.markers.map(|marker| marker.area);
        trust.judge(self) == Status::OK && trust::are_equal(&settings.geometry, areas)
    }

    /// Returns the same images with markers at other places, moved by little more than their width.
    pub fn moved_to(&self, markers: [Marker; 4]) -> Found {
        Found {
            pattern: Pattern::of_centroids(markers.map(|marker| (marker.x, marker.y))),
            markers,
            ..*self
        }
    }
}

/// The reason why a blob is no marker's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unlike {
    /// It has fewer pixels than this.
    Small(u32),
    /// It has more pixels than this.
    Large(u32),
    /// It touches the picture's border, which cuts it.
    Cut,
    /// It is not filled as an ellipse is: cut, holed, or two things that touch.
    Uneven,
}

/// The properties of a marker's image that are compared with a rest position.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Image {
    /// Shape relative to the pattern's centre.
    radial: RadialShape,
    /// [`Shape::area`].
    area: u32,
    /// [`Shape::passed`].
    passed: u32,
    /// Its width by the optics, without the width that the mask adds, px.
    expected: f32,
    /// [`Shape::hollow`].
    hollow: f32,
    /// [`Shape::lopsided`].
    lopsided: f32,
    /// [`Shape::density`].
    density: f32,
}

/// Most candidates; frames with more are refused. 8 candidates make 70 sets of four.
const MAX_CANDIDATES: usize = 8;
/// A candidate has at least this part of a marker's area at rest (1 over this): markers only come
/// nearer.
const SMALLEST_PART: u32 = 3;
/// A candidate has at most this many times a marker's area at rest. At twice the distance from the
/// axis it has less than four times the area, before dilation adds its share.
const LARGEST_MULTIPLE: u32 = 8;
/// Smallest fill of a candidate's ellipse. A disc has 0.97 to 1 at any size and tilt, a half disc
/// 0.95, two touching discs 0.88, a crescent less.
const LEAST_FILL: f32 = 0.93;
/// Largest relative deviation of a marker's width from the optical law. Before there is a rest
/// position, threshold, light and blur are unknown; under a tip far off the middle the pattern's
/// centre is not on the axis.
const SIZE_TOLERANCE: f32 = 0.375;
/// Smallest width along the radius over that across it: foreshortened by distance and the steepest
/// film.
const LEAST_ASPECT: f32 = 0.199;
/// Largest such ratio: a round marker, and the noise of a small picture.
const LARGEST_ASPECT: f32 = 1.152;

/// Finds the markers among the blobs of a frame. Holds all numbers that follow from the settings.
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
    /// Width that the mask adds, px.
    edge: f32,
    areas: (u32, u32),
    centroid: CentroidEstimator,
    dilations: u8,
    /// Factor of the pixel format on limits that come from the pixel grid.
    grid: f32,
}

impl Finder {
    /// A finder for frames that are scanned with these settings.
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
            dilations: settings.dilations,
            grid: trust::grid(settings.threshold.format()).0,
        }
    }

    /// Returns the four markers among `blobs`.
    ///
    /// # Errors
    /// [`Status::MARKERS_MISSING`] with fewer than four candidates; [`Status::MARKERS_IMPLAUSIBLE`]
    /// if four of them form the pattern but their sizes do not fit it; otherwise
    /// [`Status::MARKERS_AMBIGUOUS`]: two sets fit, none fits, or there are too many candidates.
    pub fn find(&self, blobs: &[Blob]) -> Result<Found, Status> {
        let mut candidates = Vec::<Shape, MAX_CANDIDATES>::new();
        for blob in blobs {
            if let Ok(shape) = self.candidate(blob) {
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

    /// Returns why a blob is no marker's image; `None` if it could be one.
    pub fn unlike(&self, blob: &Blob) -> Option<Unlike> {
        self.candidate(blob).err()
    }

    fn candidate(&self, blob: &Blob) -> Result<Shape, Unlike> {
        let (least, most) = self.areas;
        if blob.area < least {
            return Err(Unlike::Small(least));
        }
        if blob.area > most {
            return Err(Unlike::Large(most));
        }
        let [width, height] = self.size;
        let ends = [(blob.x0, blob.x1, width), (blob.y0, blob.y1, height)];
        if ends
            .iter()
            .any(|(from, to, side)| *from == 0 || to + 1 >= *side)
        {
            return Err(Unlike::Cut);
        }
        let shape = Shape::of_blob(blob, self.centroid);
        shape
            .filter(|shape| shape.fill >= LEAST_FILL)
            .ok_or(Unlike::Uneven)
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
            markers: shapes.map(Shape::marker),
            images: [image(a)?, image(b)?, image(c)?, image(d)?],
            pattern,
            shift_px2: most_shifted(shapes.into_iter()),
        })
    }

    /// Returns a marker's image; `None` if its size does not fit its distance from the pattern's
    /// centre.
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

/// The largest [`Shape::shift_px2`].
fn most_shifted<'s>(shapes: impl Iterator<Item = &'s Shape>) -> f32 {
    shapes.fold(0.0, |most, shape| larger(most, shape.shift_px2))
}

/// Every way to take four of `count` items, in order.
fn sets_of_four(count: usize) -> impl Iterator<Item = [usize; 4]> {
    (0..count).flat_map(move |a| {
        (a + 1..count).flat_map(move |b| {
            (b + 1..count).flat_map(move |c| (c + 1..count).map(move |d| [a, b, c, d]))
        })
    })
}
