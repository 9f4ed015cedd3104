//! How exactly units are built: standard deviations of their numbers.

/// ln of the film's Young's modulus.
pub const STIFFNESS: f64 = 0.2;
/// ln of its thickness.
pub const THICKNESS: f64 = 0.1;
/// A post's place along each axis, mm.
pub const POST_MM: f64 = 0.3;
/// A marker's place along each axis, mm.
pub const MARKER_MM: f64 = 0.15;
/// The camera's roll, degrees.
pub const ROLL_DEG: f64 = 2.0;
/// ln of its focal length.
pub const FOCAL: f64 = 0.02;
/// Where its axis meets the picture along each side, px.
pub const MIDDLE_PX: f64 = 3.0;
