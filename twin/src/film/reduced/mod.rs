//! The film under a tip anywhere, by tables made from full solutions.
//!
//! One marker's tables serve all four: mirroring the film at its axes puts every marker into the
//! corner (+, +), and mirroring it at the diagonal makes of what moves along x what moves along y.

mod axis;
mod pose;
mod table;
mod tables;
mod terms;
mod unit;
mod weight;

pub use axis::Axis;
pub use pose::{LARGEST_SIZE, LARGEST_TILT, LINEAR_N, Pose};
pub use table::Table;
pub use tables::{Kind, LARGEST_RADIUS_MM, NOMINAL_RADIUS_MM, SMALLEST_RADIUS_MM, Tables, rho};
pub use terms::Terms;
pub use unit::Unit;
pub use weight::{AS_A_PRESS_N, Pull, Weight};
