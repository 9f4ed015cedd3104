//! Finds the force and its place that explain the markers' positions, by Gauss–Newton steps on a
//! forward model of the film.
//!
//! N markers have 2·N coordinates, a contact has five unknowns. The network's answer is the first
//! guess. Each step evaluates the film and its slopes there, and solves the linearized problem. The
//! residual of the redundant coordinates, three of four markers, exposes a load that the model does
//! not know; the slopes give the uncertainty of the load.
//!
//! All of it is single precision, each operation rounded once and in a fixed order. Additions,
//! multiplications, divisions and roots follow IEEE 754 on every machine, so the results are the
//! same bits everywhere.
//!
//! | file | subject |
//! |---|---|
//! | `axis`, `terms`, `table` | splines over the place, polynomials in size and tilt, their sums |
//! | `pose` | a load in the variables in which the film is nearly a polynomial |
//! | `predict` | the positions of all images, with slopes |
//! | `mounting` | where this unit's markers are glued, and how its camera sees them |
//! | `solve` | 2·N equations, five unknowns |
//! | `descent` | steps of falling residual from a guess |
//! | `residual` | how large the residual of undisturbed frames is |
//! | `covariance` | uncertainty of the unit, in addition to the noise |
//! | `weight` | the effect of the film's own weight |
//! | `shapes` | the effect of the contact's shape on four markers |
//! | `motions` | tables of the images' motion by the place that is pressed |
//! | `widths` | the effect of the contact's width, which more markers show |
//! | `torsion` | the effect of a torque about the film's normal |
//! | `estimate` | from guesses to a load, its residual and standard uncertainties |
//! | `three` | the same while a marker is lost |
//! | `pair` | two contacts, where one does not explain the markers |

use pose::limited;

mod axis;
mod covariance;
mod descent;
mod drift;
mod estimate;
mod motions;
mod mounting;
pub mod pair;
mod pose;
mod predict;
pub(crate) mod residual;
mod shapes;
mod solve;
mod table;
mod terms;
mod three;
mod torsion;
pub mod weight;
mod widths;

pub use axis::{Axis, NODES};
pub use covariance::{
    Covariance, CovarianceGrid, KNOTS, LARGEST_STEP, Unknown, Whitening, between,
};
pub use descent::Descent;
pub use drift::Drift;
pub use estimate::{Estimate, Observed, STEPS_AT_MOST, Sigma, Start, stated};
pub use mounting::{CameraMotion, Mounting, RestImage};
pub use pose::{Pose, Stiffness};
pub use predict::{Dot, MOST_FUNCTIONS, Markers, Prediction, Tables};
pub use shapes::{COORDINATES as SHAPES_COORDINATES, Pressing, SHIFT_KNOT, SHIFTS, Shapes, span};
pub(crate) use solve::square;
pub use solve::{Column, MOST_DOTS, MOST_EQUATIONS, Solved, UNKNOWNS, solve};
pub use table::{Answer, OUTPUTS, Place, Table};
#[cfg(any(test, feature = "encode"))]
pub use terms::{EVEN, ODD};
pub use terms::{Limits, MOST_TILTS, Powers, Sizes, Terms, Tilts};
pub use torsion::{Arm, Torques, Turning};
pub use weight::{Gravity, Hanging, Turned, Weight};
pub use widths::{OF_FACE, PER_WIDTH_MM, TIP_MM, Wide, Widths, centre_mm};

/// Most steps that a model may ask for.
pub const MOST_STEPS: u8 = 3;

/// Number of sizes at which the uncertainty of other units' strength is given.
pub const RELATIVE: usize = 5;

/// A forward model, borrowed from a model file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forward<'a> {
    /// Gauss–Newton steps from the network's guess, 0 to [`MOST_STEPS`]. With 0 the network's
    /// answer is final.
    pub steps: u8,
    /// The largest loads.
    pub limits: Limits,
    /// The force of each size.
    pub stiffness: Stiffness,
    /// How to read a unit's mounting from its rest picture.
    pub rest_image: RestImage,
    /// Focal lengths per px of the camera of the model's own unit ([`Mounting::per_px`]); `None` if
    /// its rest picture determines them.
    pub per_px: Option<[f32; 2]>,
    /// How well markers are seen.
    pub noise: Noise,
    /// The film's tables.
    pub tables: Tables<'a>,
    /// The covariance that the tables leave on the model's own unit; `None` if it is negligible
    /// compared with noise.
    pub own: Option<CovarianceGrid<'a>>,
    /// Properties of any other unit with a rest picture; `None` if the file has no such section.
    pub other: Option<Others<'a>>,
    /// The effect of the film's own weight; `None` if the file has no such section.
    pub weight: Option<Weight<'a>>,
    /// The effect of the shape of what presses; `None` if it is unknown.
    pub shapes: Option<Shapes<'a>>,
    /// The effect of how wide the contact is; `None` if it is unknown.
    pub widths: Option<Widths<'a>>,
    /// The effect of a torque about the normal; `None` if it is unknown.
    pub torques: Option<Torques<'a>>,
}

/// Properties of units other than the one that a model was made on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Others<'a> {
    /// The force of each size on a unit without stretch.
    pub stiffness: Stiffness,
    /// Relative standard uncertainty of the force. Knot k of n+1 is at (k/n)² of the largest size.
    pub relative: [f32; RELATIVE],
    /// The covariance that the tables leave in the images' motion, apart from the size's.
    pub covariance: CovarianceGrid<'a>,
}

/// The force of each size on a unit, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strength {
    /// The force of each size.
    pub stiffness: Stiffness,
    /// As [`Others::relative`].
    relative: [f32; RELATIVE],
    largest_size: f32,
}

/// No |F| is known better than to this part of it. How much of a marker's rim counts depends on the
/// brightness of the film next to it: 0.14 % of |F| behind a film that lets a room through
/// (`hivtac-studies scene effects`).
const OF_RIMS: f32 = 8e-4;

impl Strength {
    /// Standard uncertainty, N, of |F| at a size with the standard uncertainty `size_sigma`.
    pub fn sigma_n(&self, size: f32, size_sigma: f32) -> f32 {
        let of_size = self.stiffness.per_size_n(size) * size_sigma;
        let root = libm::sqrtf(limited(size / self.largest_size, 0.0, 1.0));
        let mut relative = 0.0;
        for (knot, part) in between(root, RELATIVE) {
            relative += part * self.relative.get(knot).copied().unwrap_or_default();
        }
        let magnitude_n = self.stiffness.magnitude_n(size);
        let [of_unit, of_rims] = [relative, OF_RIMS].map(|part| part * magnitude_n);
        libm::sqrtf(of_size * of_size + of_unit * of_unit + of_rims * of_rims)
    }
}

impl<'a> Forward<'a> {
    /// The uncertainty about the model's own unit (`is_own`), or about any other.
    pub fn unknown(&self, is_own: bool) -> Unknown<'a> {
        match (is_own, self.own, self.other) {
            (true, None, _) => Unknown::Nothing,
            (true, Some(grid), _) => Unknown::Grid(grid),
            (false, _, Some(others)) => Unknown::Grid(others.covariance),
            (false, _, None) => Unknown::Unit,
        }
    }

    /// The strength of the model's own unit (`is_own`), or of any other.
    pub fn strength(&self, is_own: bool) -> Strength {
        let others = self.other.as_ref().filter(|_| !is_own);
        Strength {
            stiffness: others.map_or(self.stiffness, |others| others.stiffness),
            relative: others.map_or([0.0; RELATIVE], |others| others.relative),
            largest_size: self.limits.size,
        }
    }
}

/// The error of a marker's coordinates in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Error by the pixel grid at rest, equal in every frame: a tare's rest position minus the
    /// markers' true rest positions, px.
    pub rest_px: Markers,
    /// Standard uncertainty of a marker that is as large as at rest, px, > 0: away from the
    /// pattern's middle, in which direction a disc's image is narrow, and across that.
    pub at_rest_px: [f32; 2],
    /// The factor on that for a marker of four times the area.
    pub at_four_areas: [f32; 2],
}
