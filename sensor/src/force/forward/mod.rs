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
//! | `axis`, `terms`, `table` | splines over the place, polynomials in size and tilt, a marker's sums of both |
//! | `pose` | a load in the variables in which the film is nearly a polynomial |
//! | `predict` | where all images go, with slopes |
//! | `mounting` | where this unit's markers are glued, and how its camera sees them |
//! | `solve` | eight equations, five unknowns |
//! | `descent` | steps downhill from a guess |
//! | `covariance` | what is not known of the unit beside the noise |
//! | `weight` | what the film's own weight does |
//! | `estimate` | from guesses to a load, what is left over, standard uncertainties |

use covariance::between;
use pose::limited;

mod axis;
mod covariance;
mod descent;
mod drift;
mod estimate;
mod mounting;
mod pose;
mod predict;
mod solve;
mod table;
mod terms;
pub mod weight;

pub use axis::{Axis, NODES};
pub use covariance::{Covariance, CovarianceGrid, KNOTS, LARGEST_STEP, Unknown, Whitening};
pub use descent::Descent;
pub use drift::Drift;
pub use estimate::{Estimate, Observed, STEPS_AT_MOST, Sigma, UNEXPLAINED, stated};
pub use mounting::{CameraMotion, Mounting, RestImage};
pub use pose::{Pose, Stiffness};
pub use predict::{DOTS, MOST_FUNCTIONS, Markers, Prediction, Tables};
pub(crate) use solve::square;
pub use solve::{Column, EQUATIONS, Solved, UNKNOWNS, solve};
pub use table::{Answer, OUTPUTS, Place, Table};
#[cfg(any(test, feature = "encode"))]
pub use terms::{EVEN, ODD};
pub use terms::{Limits, MOST_TILTS, Powers, Sizes, Terms, Tilts};
pub use weight::{Gravity, Hanging, Turned, Weight};

/// Most steps that a model may ask for.
pub const MOST_STEPS: u8 = 3;

/// Sizes at which it is told how well other units' strength is known.
pub const RELATIVE: usize = 5;

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
    /// How the camera of the unit that it was made on sees the film, focal lengths per px
    /// ([`Mounting::per_px`]); `None` when nothing beside the rest picture tells it.
    pub per_px: Option<[f32; 2]>,
    /// How well markers are seen.
    pub noise: Noise,
    /// The film's tables.
    pub tables: Tables<'a>,
    /// What they leave of how the images move on the unit that it was made on; `None` when that is
    /// nothing beside noise.
    pub own: Option<CovarianceGrid<'a>>,
    /// Any other unit, of which there is a rest picture; `None` where the file does not say.
    pub other: Option<Others<'a>>,
    /// What the film's own weight does; `None` where the file does not say.
    pub weight: Option<Weight<'a>>,
}

/// What is known of units beside the one that a model was made on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Others<'a> {
    /// How strong the force of a size is on one without stretch.
    pub stiffness: Stiffness,
    /// Standard uncertainty of that, in parts of it, at the squares of even parts of the largest
    /// size.
    pub relative: [f32; RELATIVE],
    /// What the tables leave of how the images move, beside the size.
    pub covariance: CovarianceGrid<'a>,
}

/// How strong the force of a size is on a unit, and how well that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// How strong it is.
    pub stiffness: Stiffness,
    /// As [`Others::relative`].
    relative: [f32; RELATIVE],
    largest_size: f32,
}

impl Strength {
    /// Standard uncertainty of |F| of a size that is known as well as `size_sigma`, N.
    pub fn sigma_n(&self, size: f32, size_sigma: f32) -> f32 {
        let of_size = self.stiffness.per_size_n(size) * size_sigma;
        let root = libm::sqrtf(limited(size / self.largest_size, 0.0, 1.0));
        let mut relative = 0.0;
        for (knot, part) in between(root, RELATIVE) {
            relative += part * self.relative.get(knot).copied().unwrap_or_default();
        }
        let of_unit = relative * self.stiffness.magnitude_n(size);
        libm::sqrtf(of_size * of_size + of_unit * of_unit)
    }
}

impl<'a> Forward<'a> {
    /// What is not known of the unit that it was made on, or of another one.
    pub fn unknown(&self, is_own: bool) -> Unknown<'a> {
        match (is_own, self.own, self.other) {
            (true, None, _) => Unknown::Nothing,
            (true, Some(grid), _) => Unknown::Grid(grid),
            (false, _, Some(others)) => Unknown::Grid(others.covariance),
            (false, _, None) => Unknown::Unit,
        }
    }

    /// How strong forces are on the unit that it was made on, or on another one.
    pub fn strength(&self, is_own: bool) -> Strength {
        let others = self.other.as_ref().filter(|_| !is_own);
        Strength {
            stiffness: others.map_or(self.stiffness, |others| others.stiffness),
            relative: others.map_or([0.0; RELATIVE], |others| others.relative),
            largest_size: self.limits.size,
        }
    }
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
