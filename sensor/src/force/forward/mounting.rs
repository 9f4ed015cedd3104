//! Describes where a unit's markers are glued on its film, and how its camera sees them.

use super::predict::Markers;
use super::solve::{Column, square};
use crate::force::kernels::sqrt;
use crate::force::rest::{NEAR, Rest};
use hivtac_terms::list::List;
use hivtac_terms::units::SignedMicrometres;

/// How a unit's camera sees its film, and where its markers are glued.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// Focal lengths per px: a position x + iy in px times this complex number is in focal lengths
    /// along the film's axes.
    pub per_px: [f32; 2],
    /// Distance of each marker from its nominal place, mm.
    pub beside_mm: Markers,
}

/// How to read a mounting from a rest picture, with the camera as in the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestImage {
    /// Where the tables' markers are seen at rest, focal lengths from the axis.
    pub at: Markers,
    /// Millimetres on the film per focal length at each marker: away from the axis, and across
    /// that.
    pub film_mm: Markers,
}

/// The number of markers of the square.
const SQUARE: usize = 4;
/// Largest motion of a unit's own camera that was mounted anew: shift as a fraction of the
/// pattern's radius, turn as its sine, relative change of scale.
const LARGEST_SHIFT: f32 = 0.125;
const LARGEST_TURN: f32 = 0.052;
const LARGEST_SCALE: f32 = 0.01;

impl RestImage {
    /// Unit vector from the axis to a marker's image; along x if the image is on the axis.
    #[inline]
    pub fn away(&self, dot: usize) -> [f32; 2] {
        let [x, y] = self.at.get(dot).copied().unwrap_or_default();
        let far = sqrt(x * x + y * y);
        match far > 0.0 {
            true => [x / far, y / far],
            false => [1.0, 0.0],
        }
    }

    /// Whether each marker is within this distance, mm, of the one with its identity in a layout.
    pub fn is_layout(&self, layout: &[[SignedMicrometres; 2]], near_mm: f32) -> bool {
        let is_near = |(number, place): (usize, &[SignedMicrometres; 2])| {
            let place_mm = place.map(|part| 1e-3 * part.0 as f32);
            let mut squares = self.squared_distances_mm(place_mm);
            let square = squares.nth(number);
            square.is_some_and(|square| square < near_mm * near_mm)
        };
        self.at.len() == layout.len() && layout.iter().enumerate().all(is_near)
    }

    /// Where on the film the markers moved most, mm: the mean of their places, weighted by the
    /// square of their motion; the middle if none moved.
    pub fn where_most(&self, moved: &Column) -> [f32; 2] {
        let (mut sum, mut all) = ([0.0; 2], f32::MIN_POSITIVE);
        let moved = moved.as_chunks().0;
        for ((at, film_mm), [x, y]) in self.at.iter().zip(self.film_mm.iter()).zip(moved) {
            let counts = x * x + y * y;
            sum = [0, 1].map(|i| sum[i] + counts * film_mm[1] * at[i]);
            all += counts;
        }
        sum.map(|part| part / all)
    }

    /// The square of the distance of each marker, at rest on the film, from a place, mm².
    pub fn squared_distances_mm(&self, [right, below]: [f32; 2]) -> impl Iterator<Item = f32> {
        let markers = self.at.iter().zip(self.film_mm.iter());
        markers.map(move |([x, y], [_, across_mm])| {
            let (right, below) = (right - across_mm * x, below - across_mm * y);
            right * right + below * below
        })
    }

    /// How much less exactly each marker is seen than the one whose image is largest, away from the
    /// axis and across that; 1 for the four of the square, which are alike. Noise is in a marker's
    /// edge. Beside the axis its image is an ellipse of half axes a across and b away: a mean over
    /// the edge is known to √(a + b) / a away and √(a + b) / b across.
    pub fn grain(&self) -> Markers {
        if self.film_mm.len() == SQUARE {
            return Markers::filled(SQUARE, [1.0; 2]);
        }
        let across_mm = self.film_mm.iter().map(|[_, across]| *across);
        let nearest_mm = across_mm.fold(f32::INFINITY, f32::min);
        self.film_mm.map(|[away_mm, across_mm]| {
            let narrow = across_mm / away_mm;
            let away = sqrt(0.5 * (1.0 + narrow) * across_mm / nearest_mm);
            [away, away / narrow]
        })
    }

    /// The covariance (xx, xy, yy) of a marker's image with these variances away from the axis and
    /// across that.
    #[inline]
    pub fn noise(&self, dot: usize, [away, across]: [f32; 2]) -> [f32; 3] {
        let [x, y] = self.away(dot);
        [
            away * x * x + across * y * y,
            (away - across) * x * y,
            away * y * y + across * x * x,
        ]
    }

    /// Returns the mounting of a unit when only its tare is known. Shift, turn and size of the
    /// whole pattern are attributed to the camera, because a rest picture cannot separate them from
    /// gluing. The remainder is gluing.
    pub fn mounting(&self, rest: &Rest) -> Mounting {
        let seen = about_middle(&places_px(rest));
        let own = about_middle(&self.at);
        let per_px = similarity(&seen, &own);
        let pairs = seen.iter().zip(own.iter()).enumerate();
        let beside = pairs.map(|(dot, (seen, own))| {
            let [x, y] = turned(per_px, *seen);
            self.on_film(dot, [x - own[0], y - own[1]])
        });
        Mounting {
            per_px,
            beside_mm: List::of(beside),
        }
    }

    /// Converts a shift of a marker's image, focal lengths, to millimetres on the film.
    fn on_film(&self, dot: usize, [x, y]: [f32; 2]) -> [f32; 2] {
        let film_mm = self.film_mm.get(dot).copied();
        let ([ux, uy], [away, across]) = (self.away(dot), film_mm.unwrap_or_default());
        let away = away * (x * ux + y * uy);
        let across = across * (y * ux - x * uy);
        [away * ux - across * uy, away * uy + across * ux]
    }
}

fn places_px(rest: &Rest) -> Markers {
    let centroids = rest.features.centroids.iter();
    Markers::of(centroids.map(|(x, y)| [x.to_f32(), y.to_f32()]))
}

fn middle(places: &Markers) -> [f32; 2] {
    let mut middle = [0.0; 2];
    for place in places.iter() {
        middle = [0, 1].map(|i| middle[i] + place[i] / places.len() as f32);
    }
    middle
}

/// Places relative to their mean.
pub(super) fn about_middle(places: &Markers) -> Markers {
    let middle = middle(places);
    places.map(|[x, y]| [x - middle[0], y - middle[1]])
}

/// Root mean square distance of places from their mean; `about` is relative to it.
pub(super) fn radius(about: &Markers) -> f32 {
    sqrt(square(about.as_flattened()) / about.len().max(1) as f32)
}

/// The complex number that maps `seen` to `own` with the smallest squared error.
fn similarity(seen: &Markers, own: &Markers) -> [f32; 2] {
    let (mut along, mut across, mut square) = (0.0, 0.0, 0.0);
    for ([x, y], [cx, cy]) in seen.iter().zip(own.iter()) {
        along += x * cx + y * cy;
        across += x * cy - y * cx;
        square += x * x + y * y;
    }
    // The markers of a sound rest position are not all in one place. If they were, the result is 0:
    // no motion.
    let square = if square > 0.0 { square } else { f32::MAX };
    [along / square, across / square]
}

/// How a camera moved over a film between two rest pictures, as a shift, a turn and a change of
/// scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraMotion {
    /// How far the markers' middle moved, px.
    pub shift_px: [f32; 2],
    /// The complex number that maps the markers back, relative to their middle. Its argument is
    /// minus the turn (x towards y), its absolute value one over the change of scale.
    pub back: [f32; 2],
    /// After mapping back: the largest difference of a coordinate from where it was, px.
    pub beside_px: f32,
    /// The pattern's radius before, px.
    radius_px: f32,
}

impl CameraMotion {
    /// The motion from `before` to `now`.
    pub fn between(before: &Rest, now: &Rest) -> CameraMotion {
        let places = [now, before].map(places_px);
        let [at, at_before] = places.each_ref().map(middle);
        let [seen, own] = places.each_ref().map(about_middle);
        let back = similarity(&seen, &own);
        let beside = |(seen, own): (&[f32; 2], &[f32; 2])| {
            let [x, y] = turned(back, *seen);
            (x - own[0]).abs().max((y - own[1]).abs())
        };
        let pairs = seen.iter().zip(own.iter());
        CameraMotion {
            shift_px: [at[0] - at_before[0], at[1] - at_before[1]],
            back,
            beside_px: pairs.map(beside).fold(0.0, f32::max),
            radius_px: radius(&own),
        }
    }

    /// The pattern's size relative to before.
    pub fn times(&self) -> f32 {
        let [along, across] = self.back;
        1.0 / sqrt(along * along + across * across)
    }

    /// Whether the motion is small enough for a unit's own camera that was mounted anew.
    fn is_remounting(&self) -> bool {
        let [along, across] = self.back;
        let [x, y] = self.shift_px.map(f32::abs);
        let scale = sqrt(along * along + across * across);
        x.max(y) <= LARGEST_SHIFT * self.radius_px
            && across.abs() <= LARGEST_TURN
            && (scale - 1.0).abs() <= LARGEST_SCALE
            && self.beside_px <= NEAR.to_f32()
    }
}

impl Mounting {
    /// The same film, seen as at `rest` by a camera that moved since `own`. Returns `None` for
    /// another unit's film, whose markers no small motion brings within [`NEAR`] of `own`. A small
    /// motion is a shift of an eighth of the pattern's radius, a turn of 3° and a change of scale
    /// of 1 %.
    pub fn remounted(&self, rest: &Rest, own: &Rest) -> Option<Mounting> {
        let motion = CameraMotion::between(own, rest);
        motion.is_remounting().then(|| Mounting {
            per_px: turned(self.per_px, motion.back),
            ..*self
        })
    }

    /// Converts the motion of a marker's image from px to focal lengths along the film's axes.
    pub fn moved(&self, px: [f32; 2]) -> [f32; 2] {
        turned(self.per_px, px)
    }

    /// The inverse of [`Mounting::moved`].
    pub fn px(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [a, b] = self.per_px;
        let square = (a * a + b * b).max(f32::MIN_POSITIVE);
        turned([a / square, -b / square], [x, y])
    }

    /// Focal lengths per px.
    pub fn scale(&self) -> f32 {
        let [a, b] = self.per_px;
        sqrt(a * a + b * b)
    }
}

/// (a + ib)·(x + iy).
fn turned([a, b]: [f32; 2], [x, y]: [f32; 2]) -> [f32; 2] {
    [a * x - b * y, b * x + a * y]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::features::Features;
    use hivtac_terms::units::Px;

    const CORNERS: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    const CORNER: f32 = 0.342;
    const STILL: [[f32; 2]; 4] = [[0.0; 2]; 4];

    fn rest_image() -> RestImage {
        RestImage {
            at: Markers::of(CORNERS.map(|place| place.map(|part| CORNER * part))),
            film_mm: Markers::filled(4, [12.76, 10.85]),
        }
    }

    /// Markers at the places of a nominal camera, each moved by `moved` focal lengths.
    fn rest(moved: [[f32; 2]; 4], per_focal: [f32; 2], middle: [f32; 2]) -> Rest {
        let at = rest_image().at;
        let seen = |k: usize| {
            let [x, y] = [0, 1].map(|i| at[k][i] + moved[k][i]);
            let [x, y] = turned(per_focal, [x, y]);
            let px = |part: f32| Px((65_536.0 * part) as i32);
            (px(x + middle[0]), px(y + middle[1]))
        };
        Rest {
            features: Features {
                centroids: List::from_fn(4, seen),
                ..Features::default()
            },
            areas: [200; 4].into(),
        }
    }

    /// A marker at 40° beside the axis is an ellipse of 0.83 by 0.59, one at 14° nearly round. The
    /// square's are alike.
    #[test]
    fn a_marker_beside_the_axis_is_seen_less_exactly() {
        assert_eq!(rest_image().grain(), Markers::filled(4, [1.0; 2]));
        let mut others = RestImage {
            at: Markers::defaults(5),
            film_mm: Markers::filled(5, [10.63, 10.2]),
        };
        others.film_mm[4] = [16.94, 12.0];
        let grain = others.grain();
        let near = |found: [f32; 2], expected: [f32; 2]| {
            let pairs = found.iter().zip(expected);
            assert!(
                pairs.into_iter().all(|(a, b)| (a - b).abs() < 0.01),
                "{found:?} {expected:?}"
            );
        };
        near(grain[0], [0.99, 1.03]);
        near(grain[4], [1.00, 1.41]);
    }

    #[test]
    fn a_camera_that_is_off_moves_no_marker() {
        // Rolled by 3°, 2 % longer, 5 px off the middle.
        let per_focal = [
            178.5 * 3f32.to_radians().cos(),
            178.5 * 3f32.to_radians().sin(),
        ];
        let mounting = rest_image().mounting(&rest(STILL, per_focal, [164.5, 115.0]));
        assert!(
            mounting
                .beside_mm
                .as_flattened()
                .iter()
                .all(|part| part.abs() < 1e-4)
        );
        assert!((mounting.scale() * 178.5 - 1.0).abs() < 1e-5);
        let [x, y] = mounting.moved(turned(per_focal, [0.01, 0.02]));
        assert!((x - 0.01).abs() < 1e-6 && (y - 0.02).abs() < 1e-6);
    }

    /// A taper is attributed to the markers alone. Its square makes the pattern slightly larger,
    /// too.
    #[test]
    fn gluing_that_no_camera_makes_is_found() {
        let taper = [[0.01, 0.0], [-0.01, 0.0], [0.01, 0.0], [-0.01, 0.0]];
        let mounting = rest_image().mounting(&rest(taper, [175.0, 0.0], [159.5, 119.5]));
        for (k, [x, y]) in mounting.beside_mm.iter().enumerate() {
            let [sx, sy] = CORNERS[k];
            // 0.01 along x: half of it away from the axis and half across.
            let (away, across) = (taper[k][0] * sx / 2.0, -taper[k][0] * sy / 2.0);
            let expected = [
                12.76 * away * sx - 10.85 * across * sy,
                12.76 * away * sy + 10.85 * across * sx,
            ];
            assert!((x - expected[0]).abs() < 3e-3, "{x} {expected:?}");
            assert!((y - expected[1]).abs() < 3e-3, "{y} {expected:?}");
        }
    }

    #[test]
    fn noise_is_along_and_across_what_leads_away() {
        let [xx, xy, yy] = rest_image().noise(1, [4.0, 1.0]);
        assert!((xx - 2.5).abs() < 1e-5 && (xy + 1.5).abs() < 1e-5 && (yy - 2.5).abs() < 1e-5);
        assert_eq!(rest_image().noise(4, [4.0, 1.0]), [4.0, 0.0, 1.0]);
    }

    /// Shifted by (2, −1) px, turned by 1°, 1 % larger; then one marker is 0.2 px off that.
    #[test]
    fn a_camera_that_moved_is_reported_by_shift_turn_and_scale() {
        let focal = [178.5, 0.0];
        let before = rest(STILL, focal, [160.0, 120.0]);
        let turn = 1f32.to_radians();
        let moved = focal.map(|_| 178.5 * 1.01);
        let moved = [moved[0] * turn.cos(), moved[1] * turn.sin()];
        let now = rest(STILL, moved, [162.0, 119.0]);
        let motion = CameraMotion::between(&before, &now);
        let [along, across] = motion.back;
        assert!((motion.shift_px[0] - 2.0).abs() < 1e-3 && (motion.shift_px[1] + 1.0).abs() < 1e-3);
        assert!((motion.times() - 1.01).abs() < 1e-5, "{motion:?}");
        assert!((-across.atan2(along) - turn).abs() < 1e-5, "{motion:?}");
        assert!(motion.beside_px < 1e-3, "{motion:?}");
        let mut pulled = now;
        pulled.features.centroids[1].0.0 += 13_107;
        let beside = CameraMotion::between(&before, &pulled).beside_px;
        assert!((0.05..0.2).contains(&beside), "{beside}");
    }

    #[test]
    fn markers_in_one_place_say_nothing() {
        let mounting = rest_image().mounting(&rest(STILL, [0.0; 2], [100.0, 100.0]));
        assert_eq!(mounting.per_px, [0.0; 2]);
        assert!(
            mounting
                .beside_mm
                .as_flattened()
                .iter()
                .all(|part| part.is_finite())
        );
    }
}
