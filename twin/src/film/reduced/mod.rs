//! The film under a tip at any place, by tables made from full solutions.
//!
//! The tables of one marker serve all four. Mirroring the film at its axes puts every marker into
//! the corner (+, +). Mirroring it at the diagonal turns motion along x into motion along y.

mod axis;
mod pose;
mod table;
mod tables;
mod terms;
mod unit;
mod weight;

pub use axis::{Axis, SPAN};
pub use pose::{LARGEST_SIZE, LARGEST_TILT, LINEAR_N, Pose};
pub use table::Table;
pub use tables::{Kind, LARGEST_RADIUS_MM, NOMINAL_RADIUS_MM, SMALLEST_RADIUS_MM, Tables, rho};
pub use terms::Terms;
pub use unit::Unit;
pub use weight::{AS_A_PRESS_N, Pull, Weight};
