//! Defines the result of a frame: a force on the film, and where it touches.

use crate::units::{
    MicroNewtons, Micrometres, MilliDegrees, SignedMicrometres, UnsignedMicroNewtons,
    UnsignedMilliDegrees,
};

/// A force with its standard uncertainty. Film frame, right-handed: x right and y down in the
/// image, z = x × y out of the film, away from the camera. F = |F| · (sin α cos β, sin β, −cos α
/// cos β): a press has F_z < 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Force {
    /// α.
    pub alpha: MilliDegrees,
    /// β.
    pub beta: MilliDegrees,
    /// |F| ≥ 0.
    pub magnitude: MicroNewtons,
    /// (Fx, Fy, Fz): |F| in the direction of α and β. If a model's angles are those of the pressing
    /// direction (`stick`, `slip`), the vector points along that.
    pub cartesian: [MicroNewtons; 3],
    /// Standard uncertainty of the direction, at most 180°: 95 of 100 true directions are within
    /// 1.731 times this angle of the one found.
    pub direction_sigma: UnsignedMilliDegrees,
    /// Standard uncertainty of |F|: 95 of 100 true values are within 1.960 times this.
    pub magnitude_sigma: UnsignedMicroNewtons,
    /// Where the tip touches the film; `None` if the model has no place outputs.
    pub place: Option<Place>,
}

/// The point of the film under the tip, named by its position at rest in the film frame; (0, 0) is
/// the film's middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Place {
    /// Coordinate to the right in the image.
    pub x: SignedMicrometres,
    /// Coordinate down in the image.
    pub y: SignedMicrometres,
    /// Standard uncertainty of each coordinate: the root of half the trace of their 2×2 covariance.
    /// If the covariance is the same in all directions, 95 of 100 true places are within 2.448
    /// times this distance of the one found.
    pub sigma: Micrometres,
}
