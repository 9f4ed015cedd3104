//! The film of a HiVTac sensor as a geometrically nonlinear shell, by finite elements.
//!
//! Frame and units as in `docs/architecture.md`: x right and y down in the image, z away from the camera; mm, N, MPa.

#![expect(
    clippy::needless_range_loop,
    reason = "formulas in indices read best with indices"
)]

mod design;
mod error;
mod film;
mod grid;
mod newton;
mod point;
mod reduced;
mod shell;
mod sparse;
mod spline;
#[cfg(test)]
mod verification;
mod view;

pub use design::Design;
pub use error::FilmError;
pub use film::{Contact, Equilibrium, Film};
pub use point::Material;
pub use reduced::{Check, MAX_FORCE_N, MAX_OFFSET_MM, MAX_TILT_DEG, Pressed, Reduced, fit};
pub use view::{MARKER_MM, MARKERS_MM, Marker, markers, paper_camera};
