//! Forces: direction, size and the Cartesian vector.
//!
//! Film frame, right-handed: x right and y down in the image, z = x × y out of the film, away from the camera.
//! F = |F| · (sin α cos β, sin β, −cos α cos β): β's stage carries α's. A press has F_z < 0.

use crate::units::{MicroNewtons, MilliDegrees};

/// A force with its standard uncertainty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Force {
    /// α.
    pub alpha: MilliDegrees,
    /// β.
    pub beta: MilliDegrees,
    /// |F| ≥ 0.
    pub magnitude: MicroNewtons,
    /// (Fx, Fy, Fz); `None` where the model's angles are not those of the force (`stick`, `slip`).
    pub cartesian: Option<[MicroNewtons; 3]>,
    /// Standard uncertainty of the direction (angle between vectors).
    pub direction_sigma: MilliDegrees,
    /// Standard uncertainty of |F|.
    pub magnitude_sigma: MicroNewtons,
}
