//! The pattern of four points: where its centre is, how large, turned and distorted it is.
//!
//! Four points have eight coordinates: centre (2), size and turn (2), *strain* (2: stretched along
//! x against y, or sheared) and *taper* (2: one side longer than the opposite one). For a square
//! film, a force at its middle changes strain only to second order, wherever it points: a straight
//! press changes the size, a sideways one shifts and tapers. One marker displaced by δ changes
//! strain by δ/4r whatever the direction, r being the markers' distance from the centre. That makes
//! strain the test for a thing that stands in for a marker.

use super::shape::Shape;
use hivtac_terms::angle::atan2;
use hivtac_terms::division::Reciprocal;
use hivtac_terms::root::rough_root;
use hivtac_terms::units::{MilliDegrees, Px};

/// What four points in the order of the identities make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pattern {
    /// Their mean.
    pub center: (Px, Px),
    /// Half the side of the square that fits best, px in Q16.16.
    pub half_side: i32,
    /// How far that square is turned, x towards y.
    pub turn: MilliDegrees,
    /// Stretch and shear, in parts of the square's size, of 65,536.
    pub strain: [i32; 2],
    /// Taper along x and y, in parts of the square's half side, of 65,536.
    pub taper: [i32; 2],
}

/// Limits of a pattern before there is a rest position: lens, mounting and punched film are as they
/// come. Turned by at most 20°.
const LARGEST_TURN: MilliDegrees = MilliDegrees(20_000);
/// Strain of at most 0.075, of 65,536 (seen: 0.065, under a tip 4 mm off the middle).
const LARGEST_STRAIN: i32 = 4_915;
/// Taper of at most 0.15, of 65,536.
const LARGEST_TAPER: i32 = 9_830;
/// Centre at most 0.8 of the half side at rest away from the picture's middle; of 256.
const LARGEST_SHIFT: i64 = 205;
/// 0.75 to 2.2 times as large as at rest, of 256: a film pulled outwards, and one that nearly
/// touches the lens.
const SCALE: (i64, i64) = (192, 563);

/// √½ of 256: a square's half side over its half diagonal.
const SQRT_HALF: i64 = 181;

/// (Sign of x, sign of y) of markers 0–3 around their centre.
const SIGNS: [(i32, i32); 4] = [(-1, -1), (1, -1), (1, 1), (-1, 1)];

/// Puts four shapes in the order of the identities: by the quadrant around their own centre. `None`
/// unless there is one in each.
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
    /// Of four points in the order of the identities.
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
        // Eight half sides.
        let size = length([xx + yy, yx - xy]).max(1);
        let by_size = Reciprocal::of(size as u32);
        Pattern {
            center: (Px(sum_x >> 2), Px(sum_y >> 2)),
            half_side: size / 8,
            turn: atan2(i64::from(yx - xy), i64::from(xx + yy)),
            strain: [xx - yy, xy + yx].map(|part| by_size.part(part)),
            taper: [taper_x, taper_y].map(|part| by_size.part(2 * part)),
        }
    }

    /// Whether it can be the markers of a sensor in any state, from geometry alone: `center` is the
    /// picture's, and at rest they are `rest_distance` from it.
    pub fn is_plausible(&self, center: (Px, Px), rest_distance: Px) -> bool {
        let rest = i64::from(rest_distance.0) * SQRT_HALF / 256;
        let shift = i64::from(distance(self.center, center).0);
        self.turn.0.abs() <= LARGEST_TURN.0
            && length(self.strain) <= LARGEST_STRAIN
            && length(self.taper) <= LARGEST_TAPER
            && shift * 256 <= rest * LARGEST_SHIFT
            && (rest * SCALE.0..=rest * SCALE.1).contains(&(i64::from(self.half_side) * 256))
    }
}

/// Distance of two points, both in a picture, to 2⁻¹⁵ of it.
pub fn distance(a: (Px, Px), b: (Px, Px)) -> Px {
    let (dx, dy) = (a.0 - b.0, a.1 - b.1);
    Px(length([dx.0, dy.0]))
}

/// Length of a vector, to 2⁻¹⁵ of it, limited to 32 bits.
#[inline(never)]
pub fn length(vector: [i32; 2]) -> i32 {
    let [x, y] = vector.map(|part| (i64::from(part) * i64::from(part)) as u64);
    rough_root(x + y).min(i32::MAX as u32) as i32
}
