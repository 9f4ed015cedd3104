//! Holds the rest position: where the markers are while nothing touches the film.

use crate::force::features::Features;
use crate::markers::rules::pattern::distance;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::list::List;
use hivtac_terms::marker::{LEAST_MARKERS, MOST_MARKERS, Marker, MarkerList};
use hivtac_terms::units::Px;

/// The longest side of a picture, px.
const LARGEST_SIDE: i32 = 800;

/// Half a pixel. After the camera's motion is removed, the untouched film of the same unit has all
/// markers within this of its rest position. A touch, or another unit's film, moves one of them
/// farther.
pub const NEAR: Px = Px(Px::ONE.0 / 2);

/// A rest position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rest {
    /// Features of the untouched film.
    pub features: Features,
    /// Areas of its markers in the mask, px.
    pub areas: List<u32, MOST_MARKERS>,
}

impl Rest {
    /// The rest position of these markers.
    pub fn of_markers(markers: &[Marker]) -> Rest {
        Rest {
            features: Features::of_markers(markers),
            areas: List::of(markers.iter().map(|marker| marker.area)),
        }
    }

    /// Returns whether all coordinates of these markers are within [`NEAR`] of the rest position.
    pub fn is_near(&self, features: &Features) -> bool {
        let near = |a: Px, b: Px| a.0.abs_diff(b.0) <= NEAR.0.unsigned_abs();
        let pairs = self
            .features
            .centroids
            .iter()
            .zip(features.centroids.iter());
        pairs
            .into_iter()
            .all(|(a, b)| near(a.0, b.0) && near(a.1, b.1))
    }

    /// Its markers.
    pub fn markers(&self) -> MarkerList {
        let pairs = self.features.centroids.iter().zip(self.areas.iter());
        List::of(pairs.map(|((x, y), area)| Marker {
            x: *x,
            y: *y,
            area: *area,
        }))
    }

    /// Returns the rest position with each marker moved by `px`. The bounding rectangle of a mean
    /// is not the mean of rectangles, so the rectangle's change is added.
    pub fn displaced(&self, px: &[[f32; 2]]) -> Rest {
        let mut markers = self.markers();
        let before = Features::of_markers(&markers);
        for (marker, [x, y]) in markers.iter_mut().zip(px) {
            marker.x.0 = marker.x.0.saturating_add(Px::of_f32(*x).0);
            marker.y.0 = marker.y.0.saturating_add(Px::of_f32(*y).0);
        }
        let after = Features::of_markers(&markers);
        let (center, area) = (self.features.rect_center, self.features.rect_area);
        let shifted =
            |of: Px, from: Px, to: Px| Px(of.0.saturating_add(to.0.saturating_sub(from.0)));
        Rest {
            features: Features {
                centroids: after.centroids,
                rect_center: (
                    shifted(center.0, before.rect_center.0, after.rect_center.0),
                    shifted(center.1, before.rect_center.1, after.rect_center.1),
                ),
                rect_area: area.saturating_add(after.rect_area - before.rect_area),
            },
            areas: self.areas,
        }
    }

    /// Returns whether this can be a rest position: of enough markers, inside the largest picture,
    /// of at least a pixel each.
    pub fn is_sound(&self) -> bool {
        let inside = |px: Px| (0..=LARGEST_SIDE << Px::FRACTION_BITS).contains(&px.0);
        let largest = (LARGEST_SIDE * LARGEST_SIDE) as u32;
        self.features
            .centroids
            .iter()
            .all(|c| inside(c.0) && inside(c.1))
            && self.areas.len() >= LEAST_MARKERS
            && self.areas.iter().all(|area| (1..=largest).contains(area))
    }

    /// Returns whether the markers' mean distance from their common centre fits a film at rest, to
    /// 15 %. That allows a film 1.5 mm nearer or farther, and markers 0.7 mm off their places. It
    /// refuses a film that is pressed: every force against such a rest position would be wrong.
    pub fn fits(&self, geometry: &Geometry) -> bool {
        let centroids = &self.features.centroids;
        let count = centroids.len() as i64;
        let mean = |part: fn(&(Px, Px)) -> Px| {
            let sum: i64 = centroids.iter().map(|at| i64::from(part(at).0)).sum();
            Px(sum.checked_div_euclid(count).unwrap_or(0) as i32)
        };
        let center = (mean(|at| at.0), mean(|at| at.1));
        let sum: f32 = centroids.iter().map(|at| distance(*at, center)).sum();
        let expected = count as f32 * geometry.rest_distance().to_f32();
        (sum - expected).abs() <= 0.15 * expected
    }
}
