//! The film of a HiVTac sensor: from a load to the displacements of tip and markers, for every
//! frame.
//!
//! The film is a nonlinear shell. Its finite elements (`hivtac-shell`) take more than half a second
//! for one press. A frame uses tables in `data/` instead, which a command of that package makes
//! from full solutions.
//!
//! The results have the same bits on every machine: transcendental functions come from `libm` only,
//! and no operations are fused. Frame and units are those of `docs/architecture.md`: x right and y
//! down in the image, z away from the camera; mm, N.
//!
//! | file | subject |
//! |---|---|
//! | `load` | the force on the film and its convention |
//! | `loaded` | the film of a unit, under a load |
//! | `label` | the force that a label of the paper's stage means |
//! | `markers`, `layout`, `dots` | where the markers are at rest, and one value for each |
//! | `disc_motion`, `field` | how the film moves at the markers, and roughly between them |
//! | [`reduced`] | the tables of four markers, and what they are made of |
//! | [`whole`] | the tables of the whole film |

mod disc_motion;
mod dots;
mod error;
mod field;
mod label;
mod layout;
mod load;
mod loaded;
mod markers;
pub mod reduced;
pub mod whole;

pub use disc_motion::DiscMotion;
pub use dots::{Dots, MOST_DOTS};
pub use error::FilmError;
pub use layout::Layout;
pub use load::{Contact, Load};
pub use loaded::{
    Film, HALF_SIDE_MM, MAX_FORCE_N, MAX_LABEL_N, MAX_OFFSET_MM, MAX_PLACE_MM, MAX_RATIO,
    MAX_TANGENT, Pressed,
};
pub use markers::{MARKER_CENTRES_MM, MARKER_RADIUS_MM, MARKER_REST_MM};
