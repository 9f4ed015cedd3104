//! Where the two fingers are in the frame of their grip, and how slippery the object is.

use super::matrix::{Matrix, Vector, add, dot, times, transposed};
use crate::failure::Failure;
use serde::Deserialize;
use std::path::Path;

/// Distance of the films of opposing fingers without a file, m.
const OPENING_M: f64 = 0.03;
/// Coefficient of friction without a file.
const FRICTION: f64 = 0.5;
/// Largest coefficient of friction that is one.
const LARGEST_FRICTION: f64 = 10.0;
/// Largest difference of a quaternion's length from 1.
const LENGTH_OFF: f64 = 1e-3;

/// Where a finger's film is in the frame of the grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Turns a vector of the film's frame into the grip's.
    pub turn: Matrix,
    /// The film's middle in the grip's frame, m.
    pub middle: Vector,
}

/// Two fingers and their friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    /// The first and the second finger.
    pub poses: [Pose; 2],
    /// From the first film's middle to the second's, of length 1, in the grip's frame.
    pub axis: Vector,
    /// Coefficient of friction between films and object.
    pub friction: f64,
}

impl Default for Geometry {
    /// Opposing fingers, 30 mm apart: z from the first to the second, x of all frames the same, the
    /// origin half way. Coefficient of friction 0.5.
    fn default() -> Geometry {
        let pose = |z: f64, side: f64| Pose {
            turn: [[1.0, 0.0, 0.0], [0.0, side, 0.0], [0.0, 0.0, side]],
            middle: [0.0, 0.0, z],
        };
        Geometry {
            poses: [pose(-OPENING_M / 2.0, 1.0), pose(OPENING_M / 2.0, -1.0)],
            axis: [0.0, 0.0, 1.0],
            friction: FRICTION,
        }
    }
}

/// A geometry as a file has it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GeometryFile {
    friction: Option<f64>,
    fingers: [FingerPose; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FingerPose {
    translation_m: Vector,
    rotation_xyzw: [f64; 4],
}

impl Geometry {
    /// Reads a file, JSON.
    ///
    /// # Errors
    /// When it cannot be read, or is no geometry: with what is wrong.
    pub fn read(path: &Path) -> Result<Geometry, Failure> {
        let name = path.display();
        let text = std::fs::read_to_string(path);
        let text = text.map_err(|error| Failure::input(format!("cannot read {name}: {error}")))?;
        Geometry::parse(&text).map_err(|why| Failure::input(format!("{name}: {why}")))
    }

    /// From JSON.
    ///
    /// # Errors
    /// What is wrong, for a person.
    pub fn parse(text: &str) -> Result<Geometry, String> {
        let file: GeometryFile = serde_json::from_str(text).map_err(|error| {
            format!("it is no geometry of a grip: {error} (docs/robots.md has an example)")
        })?;
        let friction = file.friction.unwrap_or(FRICTION);
        if !(friction > 0.0 && friction <= LARGEST_FRICTION) {
            return Err(format!(
                "friction is {friction}; a coefficient of friction is above 0, up to \
                 {LARGEST_FRICTION}"
            ));
        }
        let [first, second] = file.fingers;
        let poses = [first.pose("first")?, second.pose("second")?];
        let between = add(poses[1].middle, poses[0].middle.map(|part| -part));
        let distance = dot(between, between).sqrt();
        if !(distance.is_finite() && distance > 0.0) {
            return Err("both fingers are at the same place".to_owned());
        }
        Ok(Geometry {
            poses,
            axis: between.map(|part| part / distance),
            friction,
        })
    }
}

impl FingerPose {
    fn pose(&self, which: &str) -> Result<Pose, String> {
        let [x, y, z, w] = self.rotation_xyzw;
        let length = self
            .rotation_xyzw
            .map(|part| part * part)
            .iter()
            .sum::<f64>();
        if (length.sqrt() - 1.0).abs() > LENGTH_OFF || length.is_nan() {
            return Err(format!(
                "rotation_xyzw of the {which} finger is no unit quaternion: its length is {:.3}",
                length.sqrt()
            ));
        }
        let part = |product: f64| 2.0 * product / length;
        let turn = [
            [
                1.0 - part(y * y + z * z),
                part(x * y - z * w),
                part(x * z + y * w),
            ],
            [
                part(x * y + z * w),
                1.0 - part(x * x + z * z),
                part(y * z - x * w),
            ],
            [
                part(x * z - y * w),
                part(y * z + x * w),
                1.0 - part(x * x + y * y),
            ],
        ];
        Ok(Pose {
            turn,
            middle: self.translation_m,
        })
    }
}

impl Pose {
    /// A direction of the grip's frame, in the film's.
    pub fn to_film(&self, direction: Vector) -> Vector {
        times(&transposed(&self.turn), direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPPOSING: &str = r#"{"friction": 0.5, "fingers": [
        {"translation_m": [0, 0, -0.015], "rotation_xyzw": [0, 0, 0, 1]},
        {"translation_m": [0, 0, 0.015], "rotation_xyzw": [1, 0, 0, 0]}]}"#;

    #[test]
    fn the_file_of_opposing_fingers_is_the_default() {
        assert_eq!(Geometry::parse(OPPOSING).unwrap(), Geometry::default());
        let without = OPPOSING.replace(r#""friction": 0.5, "#, "");
        assert_eq!(Geometry::parse(&without).unwrap(), Geometry::default());
    }

    #[test]
    fn what_is_no_geometry_is_refused_with_the_reason() {
        for (from, to, words) in [
            (
                "0.5",
                "0",
                "friction is 0; a coefficient of friction is above 0",
            ),
            (
                "[1, 0, 0, 0]",
                "[1, 1, 0, 0]",
                "of the second finger is no unit quaternion",
            ),
            ("0.015]", "-0.015]", "both fingers are at the same place"),
            ("friction", "fricton", "unknown field `fricton`"),
            ("}]}", "}]", "it is no geometry of a grip: EOF"),
        ] {
            let text = match from {
                "0.015]" => OPPOSING.replacen(", 0.015]", ", -0.015]", 1),
                from => OPPOSING.replace(from, to),
            };
            let why = Geometry::parse(&text).unwrap_err();
            assert!(why.contains(words), "{why}");
        }
    }
}
