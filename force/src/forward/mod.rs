//! Which force at which place explains where the markers are: a model of the film run forwards, and
//! Gauss–Newton steps on it.
//!
//! Four markers have eight coordinates, a contact five unknowns. The network's answer is the first
//! guess; each step evaluates the film at it, with its slopes, and solves the linearized problem.
//! What three redundant coordinates do not explain tells a load that the model does not know, and
//! the slopes tell how well the load is known.
//!
//! Single precision throughout, each operation rounded once and in a fixed order: additions,
//! multiplications, divisions and roots are IEEE 754's on every machine, so that the same numbers
//! come out on all of them.
//!
//! | file | subject |
//! |---|---|
//! | `axis`, `terms`, `table` | splines over the place, polynomials in size and tilt, sums of both |
//! | `pose` | a load in the variables in which the film is nearly a polynomial |
//! | `predict` | where the four images go, with slopes |
//! | `mounting` | where this unit's markers are glued, and how its camera sees them |
//! | `solve` | eight equations, five unknowns |
//! | `descent` | steps downhill from a guess |
//! | `systematic` | what is not known of the unit beside the noise |
//! | `estimate` | from guesses to a load, what is left over, standard uncertainties |

mod axis;
mod descent;
mod estimate;
mod mounting;
mod pose;
mod predict;
mod solve;
mod systematic;
mod table;
mod terms;

pub use axis::{Axis, NODES};
pub use descent::Descent;
pub use estimate::{Estimate, Observed, STEPS_AT_MOST, Sigma, UNEXPLAINED, stated};
pub use mounting::{Mounting, RestImage};
pub use pose::{Pose, Stiffness};
pub use predict::{Markers, Prediction, Tables};
pub(crate) use solve::square;
pub use solve::{Column, EQUATIONS, Solved, UNKNOWNS, solve};
pub use systematic::{KNOTS, PARTS, PLACES, SIZES, Systematic, SystematicGrid};
pub use table::{Answer, Place, Steps, Table};
pub use terms::{Limits, MOST_TILTS, Powers, Sizes, Terms, Tilts};

/// Most steps that a model may ask for.
pub const MOST_STEPS: u8 = 3;

/// A film run forwards, borrowed from a model file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward<'a> {
    /// Gauss–Newton steps from the network's guess, 0 to [`MOST_STEPS`]; with 0 the network stands
    /// alone.
    pub steps: u8,
    /// The largest loads.
    pub limits: Limits,
    /// How strong the force of a size is.
    pub stiffness: Stiffness,
    /// What a rest picture says of a unit.
    pub rest_image: RestImage,
    /// What is known of the unit that it was made on, beside its rest picture; `None` when nothing
    /// is.
    pub mounting: Option<Mounting>,
    /// How well markers are seen.
    pub noise: Noise,
    /// What is not known of the unit that it was made on.
    pub own: SystematicGrid<'a>,
    /// How far another unit may differ from what the model says of its own.
    pub other: Tolerance,
    /// The film's tables.
    pub tables: Tables<'a>,
}

/// How far a marker's coordinates in one frame are from where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// By the pixel grid at rest, where it is the same in every frame: what a tare takes for the
    /// rest position less where the markers rest, px.
    pub rest_px: Markers,
    /// Standard uncertainty of a marker as large as at rest, px, > 0: away from the pattern's
    /// middle, in which direction a disc's image is narrow, and across that.
    pub at_rest_px: [f32; 2],
    /// How many times that of one four times as large.
    pub at_four_areas: [f32; 2],
}

/// Standard uncertainties of what another unit differs in from what a model says of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// Of each coordinate of a marker's displacement, in parts of the displacement.
    pub shape: f32,
    /// Of the film's stiffness, in parts of it.
    pub stiffness: f32,
}
