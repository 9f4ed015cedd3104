//! The film of a HiVTac sensor as a geometrically nonlinear shell, by finite elements.
//!
//! Frame and units as in `docs/architecture.md`: x right and y down in the image, z away from the
//! camera; mm, N, MPa.

#![expect(
    clippy::needless_range_loop,
    reason = "formulas in indices read best with indices"
)]

mod answers;
mod body;
mod cell;
mod check;
mod design;
mod error;
mod film;
mod grid;
mod load;
mod newton;
pub mod parallel;
mod patch;
mod path;
mod point;
pub mod record;
mod sheet;
mod shell;
mod sparse;
mod spline;
pub mod sweep;
mod tables;
mod torsion;
#[cfg(test)]
mod verification;
mod view;
mod weight;
pub mod whole;

pub use answers::{Change, Response};
pub use body::{Body, Ends, RIGID_N_PER_MM3, Shape, Touch};
pub use check::{Check, Domain, check};
pub use design::Design;
pub use error::ShellError;
pub use film::{Contact, Equilibrium, Film};
pub use load::{Loaded, press_load};
pub use patch::Patch;
pub use path::halton;
pub use point::{DENSITY_KG_PER_M3, Law, Material};
pub use tables::tables;
pub use view::{Marker, markers, paper_camera, pressed};
pub use weight::weight;
