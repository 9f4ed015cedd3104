//! Describes the pattern of four points: its centre, size, turn and distortion.
//!
//! Four points have eight coordinates: centre (2), size and turn (2), *strain* (2: stretched along
//! x against y, or sheared) and *taper* (2: one side longer than the opposite one). On a square
//! film, a force at its middle changes strain only to second order, in any direction: a straight
//! press changes the size, a sideways one shifts and tapers. One marker displaced by δ changes
//! strain by δ/4r in any direction, r being the markers' distance from the centre. So strain
//! reveals a false marker.

use super::shape::Shape;
use crate::markers::kernels::sqrt;
use hivtac_terms::units::Px;

/// The pattern of four points in the order of the identities.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// Their mean.
    pub center: (Px, Px),
    /// Half the side of the square that fits best, px.
    pub half_side: f32,
    /// Turn of that square, x towards y: cosine and sine.
    pub turn: [f32; 2],
    /// Stretch and shear, relative to the square's size.
    pub strain: [f32; 2],
    /// Taper along x and y, relative to the square's half side.
    pub taper: [f32; 2],
}

/// Limits of a pattern without a rest position, for any lens, mounting and punched film. The
/// tangent of the largest turn, 20°.
pub const LARGEST_TURN: f32 = 0.363_97;
/// Strain (largest seen: 0.065, under a tip 4 mm off the middle).
pub const LARGEST_STRAIN: f32 = 0.075;
const LARGEST_TAPER: f32 = 0.15;
/// Distance of the centre from the picture's middle, relative to the half side at rest.
const LARGEST_SHIFT: f32 = 0.801;
/// Size relative to rest: from a film pulled outwards to one that nearly touches the lens.
pub const SCALE: (f32, f32) = (0.75, 2.2);

/// A square's half side over its half diagonal.
const SQRT_HALF: f32 = core::f32::consts::FRAC_1_SQRT_2;

/// (Sign of x, sign of y) of markers 0–3 around their centre.
const SIGNS: [(i32, i32); 4] = [(-1, -1), (1, -1), (1, 1), (-1, 1)];

/// Sorts four shapes by identity, which is the quadrant around their own centre. Returns `None`
/// unless there is one in each quadrant.
pub fn identify(shapes: [&Shape; 4]) -> Option<[&Shape; 4]> {
    let sum = |value: fn(&Shape) -> Px| shapes.iter().map(|s| i64::from(value(s).0)).sum::<i64>();
    let (sum_x, sum_y) = (sum(|s| s.x), sum(|s| s.y));
    let mut ordered = [None; 4];
    for shape in shapes {
        let right = 4 * i64::from(shape.x.0) > sum_x;
        let lower = 4 * i64::from(shape.y.0) > sum_y;
        let identity = match (right, lower) {
            (false, false) => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, true) => 3,
        };
        ordered[identity] = Some(shape);
    }
    let [a, b, c, d] = ordered;
    Some([a?, b?, c?, d?])
}

impl Pattern {
    /// The pattern of four points in the order of the identities.
    pub fn of_centroids(centroids: [(Px, Px); 4]) -> Pattern {
        // Four times the coefficient of a sign pattern in x and in y: below 2²⁹, as positions are
        // below 2²⁶.
        let project = |weight: fn((i32, i32)) -> i32| {
            let terms = centroids.iter().zip(SIGNS);
            terms.fold((0, 0), |(x, y), (point, signs)| {
                let weight = weight(signs);
                (x + weight * point.0.0, y + weight * point.1.0)
            })
        };
        let (sum_x, sum_y) = project(|_| 1);
        let (xx, yx) = project(|(x, _)| x);
        let (xy, yy) = project(|(_, y)| y);
        let (taper_x, taper_y) = project(|(x, y)| x * y);
        // Eight half sides, turned; four equal points give a small square.
        let turned = [xx + yy, yx - xy].map(|part| part as f32);
        let size = larger(length(turned), 1.0);
        let by_size = 1.0 / size;
        let parts = |parts: [i32; 2]| parts.map(|part| part as f32 * by_size);
        Pattern {
            center: (Px(sum_x >> 2), Px(sum_y >> 2)),
            half_side: size * (1.0 / 8.0 / 65_536.0),
            turn: turned.map(|part| part * by_size),
            strain: parts([xx - yy, xy + yx]),
            taper: parts([2 * taper_x, 2 * taper_y]),
        }
    }

    /// Returns whether the pattern is possible for a sensor in any state, by geometry alone.
    /// `center` is the picture's middle, `rest_distance` the markers' distance from it at rest, px.
    pub fn is_plausible(&self, center: (Px, Px), rest_distance: f32) -> bool {
        let rest = rest_distance * SQRT_HALF;
        let [cos, sin] = self.turn;
        sin.abs() <= cos * LARGEST_TURN
            && is_within(self.strain, LARGEST_STRAIN)
            && is_within(self.taper, LARGEST_TAPER)
            && is_within(offset(self.center, center), rest * LARGEST_SHIFT)
            && (rest * SCALE.0..=rest * SCALE.1).contains(&self.half_side)
    }
}

/// Vector from point b to point a, both in a picture, px.
pub fn offset(a: (Px, Px), b: (Px, Px)) -> [f32; 2] {
    [(a.0 - b.0).to_f32(), (a.1 - b.1).to_f32()]
}

/// Distance of two points, both in a picture, px.
pub fn distance(a: (Px, Px), b: (Px, Px)) -> f32 {
    length(offset(a, b))
}

/// The larger of two numbers. `f32::max` is a library call if the processor has no instruction for
/// it.
#[inline(always)]
pub fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Length of a vector.
#[inline(always)]
pub fn length([x, y]: [f32; 2]) -> f32 {
    sqrt(x * x + y * y)
}

/// Whether a vector's length is at most `limit`, which is at least 0.
#[inline(always)]
pub fn is_within([x, y]: [f32; 2], limit: f32) -> bool {
    x * x + y * y <= limit * limit
}
