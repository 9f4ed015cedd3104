//! Finds and judges three markers in a frame whose fourth one is missing or faulty.
//!
//! Three markers are no pattern, so the rest position identifies them. Each lies nearest to its own
//! rest place: loads within ±6 mm of the middle, up to 200 mN, move no marker half the way to
//! another one's. Three images that are nearest to three rest places are the three markers. If
//! there are four, the rules must object to exactly one of them.
//!
//! The film that explains the three predicts the lost marker. With it the pattern is whole, and the
//! rules of four markers judge pattern and three images by the same limits. The lost marker gets an
//! image that passes every rule.
//!
//! A shift that keeps an image's shape is checked by one redundant coordinate instead of three.

use super::pattern::Pattern;
use super::placed::nearest;
use super::shape::{RadialShape, Shape};
use super::{Finder, Found, Image, Trust, most_shifted};
use crate::markers::blob::Blob;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;

/// Three markers, and which one is lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Three {
    /// Markers 0–3. The lost one is where it rests.
    pub markers: [Marker; 4],
    /// The identity of the lost one, 0–3.
    pub lost: usize,
    /// Their images; `None` for the lost one.
    shapes: [Option<Shape>; 4],
}

impl Three {
    /// The largest [`Shape::shift_px2`] of a marker.
    pub fn shift_px2(&self) -> f32 {
        most_shifted(self.shapes.iter().flatten())
    }
}

impl Finder {
    /// Returns the markers if three of `blobs` can be markers, and these are nearest to three
    /// different places of `rest`. Of four, the one is left out that alone is not to be trusted.
    /// Otherwise `None`.
    pub fn find_three(&self, blobs: &[Blob], rest: &[Marker; 4], trust: &Trust) -> Option<Three> {
        let (mut markers, mut shapes) = (*rest, [None; 4]);
        for blob in blobs {
            let Ok(shape) = self.candidate(blob) else {
                continue;
            };
            let identity = nearest((shape.x, shape.y), rest);
            let place = shapes.get_mut(identity).zip(markers.get_mut(identity));
            let (place, marker) = place?;
            if place.replace(shape).is_some() {
                return None;
            }
            *marker = shape.marker();
        }
        let is_missing = |identity: &usize| matches!(shapes.get(*identity), Some(None));
        let mut missing = (0..4).filter(is_missing);
        let lost = match (missing.next(), missing.next()) {
            (Some(lost), None) => lost,
            (None, _) => self.only_faulty(&markers, &shapes, trust)?,
            _ => return None,
        };
        let (shape, marker) = shapes.get_mut(lost).zip(markers.get_mut(lost))?;
        (*shape, *marker) = (None, *rest.get(lost)?);
        Some(Three {
            markers,
            lost,
            shapes,
        })
    }

    /// Returns the one of four markers without which the others may give a force; `None` if there
    /// are more or none.
    fn only_faulty(
        &self,
        markers: &[Marker; 4],
        shapes: &[Option<Shape>; 4],
        trust: &Trust,
    ) -> Option<usize> {
        let is_faulty = |lost: &usize| {
            let found = self.completed(shapes, *lost, trust, *markers);
            found.is_some_and(|found| trust.judge(&found) == Status::OK)
        };
        let mut faulty = (0..4).filter(is_faulty);
        let first = faulty.next();
        first.filter(|_| faulty.next().is_none())
    }

    /// Judges three markers by the rules of four, as [`Trust::judge`] does. `markers` are at one
    /// common time, with the lost one where the film has it.
    pub fn judge_three(&self, three: &Three, trust: &Trust, markers: &[Marker; 4]) -> Status {
        let mut seen = three.markers;
        if let Some((seen, completed)) = seen.get_mut(three.lost).zip(markers.get(three.lost)) {
            *seen = *completed;
        }
        match self.completed(&three.shapes, three.lost, trust, seen) {
            Some(found) => trust.judge(&found.moved_to(*markers)),
            None => Status::MARKERS_IMPLAUSIBLE,
        }
    }

    /// Returns the markers with an invented image of the lost one; `None` if the pattern or another
    /// image is impossible. Not inlined, as it is called for each marker.
    #[inline(never)]
    fn completed(
        &self,
        shapes: &[Option<Shape>; 4],
        lost: usize,
        trust: &Trust,
        markers: [Marker; 4],
    ) -> Option<Found> {
        let pattern = Pattern::of_centroids(markers.map(|marker| (marker.x, marker.y)));
        if !pattern.is_plausible(self.center, self.rest_distance) {
            return None;
        }
        let (mut images, mut density) = ([None; 4], 0.0);
        for (identity, (image, shape)) in images.iter_mut().zip(shapes).enumerate() {
            let Some(shape) = shape.as_ref().filter(|_| identity != lost) else {
                continue;
            };
            *image = Some(self.image(shape, &pattern)?);
            density += shape.density * (1.0 / 3.0);
        }
        let edge = trust.edge(lost)?;
        let like = images.iter().flatten().next()?;
        let invented = Image {
            density,
            ..like.without_fault(edge)
        };
        Some(Found {
            markers,
            images: images.map(|image| image.unwrap_or(invented)),
            pattern,
            shift_px2: 0.0,
        })
    }
}

impl Image {
    /// An image of this size that passes every rule, for a marker to whose diameters the mask adds
    /// `edge` px.
    fn without_fault(&self, edge: f32) -> Image {
        Image {
            radial: RadialShape {
                skew: 0.0,
                squared_lean: 0.0,
                ..self.radial
            },
            passed: self.area,
            expected: self.radial.across - edge,
            hollow: 0.0,
            lopsided: 0.0,
            ..*self
        }
    }
}
