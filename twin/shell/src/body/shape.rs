//! The shapes of bodies: how far a point is from their surface.

use crate::ShellError;
use crate::point::{V3, cross, dot};

/// Half the length of a face's peg, mm: longer than the film can be pressed.
const PEG_MM: f64 = 100.0;
/// The least and the largest distance of the points that feel a body, mm.
const FINE_MM: f64 = 0.07;
const COARSE_MM: f64 = 0.2;
/// How far beyond a body the film is checked, in parts of the body's radius.
const WRAP: f64 = 1.6;
/// The same of a pad: how much of its height the film may wrap, mm, and the largest reach, mm.
const PAD_HEIGHT_MM: f64 = 3.0;
const MOST_REACH_MM: f64 = 11.0;

/// The ends of a lying cylinder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Half balls. The length includes them.
    Rounded,
    /// Plain, with a sharp edge.
    Plain,
}

/// The shape of a body. Its foot is the point of it that is nearest to the film as long as it is
/// not tilted; of a face, the middle. All lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Its radius, > 0.
        radius_mm: f64,
    },
    /// A cylinder that lies on the film, along the body's first axis.
    Cylinder {
        /// Its radius, > 0.
        radius_mm: f64,
        /// Its length, > 0; with rounded ends at least twice the radius.
        length_mm: f64,
        /// Its ends.
        ends: Ends,
    },
    /// The round flat end of a peg, with a sharp rim.
    Face {
        /// Its radius, > 0.
        radius_mm: f64,
    },
    /// A paraboloid.
    Pad {
        /// The radii of its curvature along the body's first and second axis, > 0.
        radii_mm: [f64; 2],
    },
}

/// A function of a place that is 0 on a body's surface and its distance close to it.
#[derive(Clone, Copy, Debug)]
pub struct Gap {
    /// Its value, mm; less than 0 within the body.
    pub mm: f64,
    /// Its gradient.
    pub normal: V3,
    /// Its second derivatives, 1/mm.
    pub bend: [V3; 3],
}

impl Shape {
    /// Checks its sizes.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ShellError> {
        let refused = |why: &str| Err(ShellError::Contact(format!("{self:?}: {why}")));
        let sizes = match *self {
            Shape::Sphere { radius_mm } | Shape::Face { radius_mm } => [radius_mm; 2],
            Shape::Cylinder {
                radius_mm,
                length_mm,
                ..
            } => [radius_mm, length_mm],
            Shape::Pad { radii_mm } => radii_mm,
        };
        if !sizes.iter().all(|size| size.is_finite() && *size > 0.0) {
            return refused("use sizes of more than 0 mm");
        }
        match self {
            Shape::Cylinder {
                ends: Ends::Rounded,
                ..
            } if sizes[1] < 2.0 * sizes[0] => refused("its ends are longer than all of it"),
            _ => Ok(()),
        }
    }

    /// Returns how far from its foot the film may touch it, mm.
    pub fn reach_mm(&self) -> f64 {
        let reach = match *self {
            Shape::Sphere { radius_mm } => WRAP * radius_mm + 0.5,
            Shape::Cylinder {
                radius_mm,
                length_mm,
                ..
            } => length_mm / 2.0 + WRAP * radius_mm + 0.5,
            Shape::Face { radius_mm } => radius_mm + 1.0,
            Shape::Pad { radii_mm: [a, b] } => (2.0 * a.max(b) * PAD_HEIGHT_MM).sqrt(),
        };
        reach.min(MOST_REACH_MM)
    }

    /// Returns the largest distance of the points that feel it, mm. The pressure of an edge changes
    /// over a short distance.
    pub fn spacing_mm(&self) -> f64 {
        let radius = match *self {
            Shape::Sphere { radius_mm } => radius_mm,
            Shape::Pad { radii_mm: [a, b] } => a.min(b),
            Shape::Cylinder { .. } | Shape::Face { .. } => 0.0,
        };
        (0.015 * radius).clamp(FINE_MM, COARSE_MM)
    }

    /// Returns the gap at a place relative to the foot, mm, in the body's axes. The third points
    /// away from the film.
    pub fn gap(&self, at: &V3) -> Gap {
        let [x, y, z] = *at;
        match *self {
            Shape::Sphere { radius_mm } => round([x, y, z - radius_mm], radius_mm, None),
            Shape::Cylinder {
                radius_mm,
                length_mm,
                ends: Ends::Rounded,
            } => {
                let half = length_mm / 2.0 - radius_mm;
                let axis = (x.abs() < half).then_some([1.0, 0.0, 0.0]);
                let from = [x - x.clamp(-half, half), y, z - radius_mm];
                round(from, radius_mm, axis)
            }
            Shape::Cylinder {
                radius_mm,
                length_mm,
                ends: Ends::Plain,
            } => {
                let from = [x, y, z - radius_mm];
                solid(from, [1.0, 0.0, 0.0], [radius_mm, length_mm / 2.0], true)
            }
            Shape::Face { radius_mm } => solid(
                [x, y, z - PEG_MM],
                [0.0, 0.0, 1.0],
                [radius_mm, PEG_MM],
                false,
            ),
            Shape::Pad { radii_mm: [a, b] } => Gap {
                mm: x * x / (2.0 * a) + y * y / (2.0 * b) - z,
                normal: [x / a, y / b, -1.0],
                bend: [[1.0 / a, 0.0, 0.0], [0.0, 1.0 / b, 0.0], [0.0; 3]],
            },
        }
    }
}

/// Returns the gap at a place relative to the nearest point of a ball's middle or of a round bar's
/// axis. The axis has no part in the place.
fn round(from: V3, radius_mm: f64, axis: Option<V3>) -> Gap {
    let far = dot(&from, &from).sqrt().max(f64::MIN_POSITIVE);
    let normal = from.map(|part| part / far);
    let along = axis.unwrap_or_default();
    let bend = |i: usize, j: usize| {
        let same = if i == j { 1.0 } else { 0.0 };
        (same - normal[i] * normal[j] - along[i] * along[j]) / far
    };
    Gap {
        mm: far - radius_mm,
        normal,
        bend: std::array::from_fn(|i| std::array::from_fn(|j| bend(i, j))),
    }
}

/// Returns the gap at a place relative to the middle of a solid cylinder around an axis. Within it
/// only that of mantle and ends counts through which a film comes in.
fn solid(from: V3, axis: V3, [radius_mm, half_mm]: [f64; 2], through_mantle: bool) -> Gap {
    let along = dot(&from, &axis);
    let end = if along < 0.0 { -1.0 } else { 1.0 };
    let aside: V3 = std::array::from_fn(|c| from[c] - along * axis[c]);
    let far = dot(&aside, &aside).sqrt().max(f64::MIN_POSITIVE);
    let out = aside.map(|part| part / far);
    let around = cross(&axis, &out);
    let (side, beyond) = (far - radius_mm, along.abs() - half_mm);
    let (mm, [p, q], edge) = match (side > 0.0, beyond > 0.0) {
        (true, true) => {
            let mm = side.hypot(beyond);
            (mm, [side / mm, beyond / mm], 1.0 / mm)
        }
        (false, true) => (beyond, [0.0, 1.0], 0.0),
        (true, false) => (side, [1.0, 0.0], 0.0),
        (false, false) if through_mantle => (side, [1.0, 0.0], 0.0),
        (false, false) => (beyond, [0.0, 1.0], 0.0),
    };
    let normal = std::array::from_fn(|c| p * out[c] + q * end * axis[c]);
    let over: V3 = std::array::from_fn(|c| p * end * axis[c] - q * out[c]);
    let bend = |i: usize, j: usize| edge * over[i] * over[j] + p / far * around[i] * around[j];
    Gap {
        mm,
        normal,
        bend: std::array::from_fn(|i| std::array::from_fn(|j| bend(i, j))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODIES: [Shape; 5] = [
        Shape::Sphere { radius_mm: 5.0 },
        Shape::Cylinder {
            radius_mm: 0.8,
            length_mm: 6.0,
            ends: Ends::Rounded,
        },
        Shape::Cylinder {
            radius_mm: 0.8,
            length_mm: 6.0,
            ends: Ends::Plain,
        },
        Shape::Face { radius_mm: 2.0 },
        Shape::Pad {
            radii_mm: [40.0, 15.0],
        },
    ];

    #[test]
    fn gaps_have_their_derivatives() {
        let places = [
            [0.3, 0.2, -0.25],
            [2.5, 0.4, -0.1],
            [2.1, 0.4, -0.1],
            [3.1, 0.3, 0.3],
            [-3.2, 0.9, 0.7],
            [1.9, -1.2, -0.2],
            [0.4, 2.2, -0.1],
        ];
        const STEP: f64 = 1e-5;
        for (shape, place) in BODIES.iter().flat_map(|s| places.map(|place| (s, place))) {
            let here = shape.gap(&place);
            for c in 0..3 {
                let [back, forth] = [-STEP, STEP].map(|step| {
                    let mut there = place;
                    there[c] += step;
                    shape.gap(&there)
                });
                let slope = (forth.mm - back.mm) / (2.0 * STEP);
                assert!((slope - here.normal[c]).abs() < 1e-8, "{shape:?} {place:?}");
                for d in 0..3 {
                    let bend = (forth.normal[d] - back.normal[d]) / (2.0 * STEP);
                    assert!((bend - here.bend[c][d]).abs() < 1e-6, "{shape:?} {place:?}");
                }
            }
        }
    }

    #[test]
    fn gaps_are_distances() {
        for shape in BODIES {
            assert!(shape.gap(&[0.0; 3]).mm.abs() < 1e-12, "its foot: {shape:?}");
            let below = shape.gap(&[0.0, 0.0, -0.4]);
            assert!((below.mm - 0.4).abs() < 1e-12 && below.normal[2] < -0.999);
            assert!(shape.gap(&[0.0, 0.0, 0.1]).mm < 0.0, "within: {shape:?}");
        }
        let rim = BODIES[3].gap(&[2.3, 0.0, -0.4]);
        assert!((rim.mm - 0.5).abs() < 1e-12);
    }

    #[test]
    fn impossible_shapes_are_refused() {
        assert!(BODIES.iter().all(|shape| shape.check().is_ok()));
        let short = Shape::Cylinder {
            radius_mm: 1.0,
            length_mm: 1.5,
            ends: Ends::Rounded,
        };
        assert!(short.check().is_err());
        assert!(Shape::Sphere { radius_mm: 0.0 }.check().is_err());
        let flat = Shape::Pad {
            radii_mm: [1.0, f64::INFINITY],
        };
        assert!(flat.check().is_err());
    }
}
