//! A unit's film and camera from known loads: least squares over the numbers in which units differ,
//! each drawn to its mean as strongly as units scatter, with the film solved by finite elements.
//!
//! | file | subject |
//! |---|---|
//! | `numbers` | the numbers, and what is known of them before there is a load |
//! | `load` | what is not known of a load |
//! | `view` | where a camera sees the dots of a solved film |
//! | `problem` | numbers and loads held against what is seen |
//! | `equations` | that linearized, as normal equations |
//! | `descent` | Gauss–Newton steps to what explains it best |
//! | `goodness_of_fit` | what χ² says of the loads, in words |
//! | `leave_one_out` | how good the fit is on loads left out of it |
//! | `field` | from few solved places of the tip to every place |
//! | `own_film` | the unit's tables and what is not known of them, for its model file |
//! | `weight` | what gravity does to the unit's film when it is turned |

mod descent;
mod equations;
mod field;
mod goodness_of_fit;
mod leave_one_out;
mod linear;
mod load;
mod numbers;
mod own_film;
mod problem;
mod view;
mod weight;

use std::fmt;

use anyhow::{Result, ensure};

use crate::loads::SeenLoad;
use goodness_of_fit::GoodnessOfFit;
pub use leave_one_out::LeaveOneOutError;
use numbers::Family;
pub use own_film::{FoundNumber, OwnFilm};
pub use problem::Bench;
use problem::{Problem, Trust};

/// How fine the film's mesh is: coarser ones do not show how the film bends between a tip and a dot
/// beside it.
const FINENESS: f64 = 0.5;

/// How fine a mesh is that tells how a film answers to its numbers.
const COARSE: f64 = 0.3;

/// χ² over the coordinates that are seen beyond which loads contradict each other: they are off by
/// some tenths of a pixel then, which no film in tolerance is.
const CONTRADICTED: f64 = 2_500.0;

/// What a fit found.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The unit's film, as a model file holds it.
    pub own: OwnFilm,
    /// χ² of what is seen and of what was known before, over the coordinates that are seen.
    pub chi_square: f64,
    /// Whether gravity was known under the loads.
    is_held: bool,
    /// The load that is explained worst.
    worst: SeenLoad,
    /// Each load, left out of the fit.
    pub left_out: Vec<LeaveOneOutError>,
}

/// Fits a unit to its rest position and to loads.
///
/// # Errors
/// When the film finds no equilibrium under a load, or the loads contradict each other.
pub fn fit(
    bench: &Bench,
    loads: &[SeenLoad],
    stage_mm: f64,
    from: Option<&OwnFilm>,
) -> Result<Fit> {
    let problem = |family| Problem {
        bench,
        loads,
        family,
        priors: numbers::priors(family, bench, stage_mm, from),
        trust: Trust::WHOLE,
    };
    let [nominal, real] = [Family::Nominal, Family::Real].map(problem);
    let (problem, found) = match nominal.explained()? {
        Some(found) => (nominal, found),
        None => {
            let found = real.found()?;
            (real, found)
        }
    };
    ensure!(
        found.chi_square() <= CONTRADICTED,
        "no unit explains these loads: what is seen of them is off by {:.1} px, root mean square, \
         most of all of load {}: check its force, its direction and its place, and that the film \
         was not touched otherwise",
        bench.noise_px * found.chi_square().sqrt(),
        found.worst() + 1
    );
    Ok(Fit {
        chi_square: found.chi_square(),
        worst: loads[found.worst()],
        is_held: bench.down.is_some(),
        left_out: found.left_out(&problem)?,
        own: OwnFilm::new(&problem, &found)?,
    })
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let goodness_of_fit = GoodnessOfFit {
            chi_square: self.chi_square,
            worst: &self.worst,
        };
        writeln!(f, "{goodness_of_fit}")?;
        for FoundNumber { name, value, sigma } in &self.own.numbers {
            writeln!(f, "{name:<46} {value:>9.4} ± {sigma:.4}")?;
        }
        let turned = match (self.own.knows_weight(), self.is_held) {
            (true, _) => "The model holds when the sensor is turned.",
            (false, true) => {
                "The film finds no equilibrium when it is turned: then the sensor says \
                 `weight_unknown`."
            }
            (false, false) => {
                "Nobody said which way the sensor was held (`hivtac settings set down`): when it \
                 is turned, it says `weight_unknown`."
            }
        };
        writeln!(f, "{turned}")
    }
}

#[cfg(test)]
mod tests;
