//! Fits a unit's film and camera to known loads, with the film solved by finite elements. Least
//! squares over the numbers in which units differ; each is drawn to its mean as strongly as units
//! scatter.
//!
//! | file | subject |
//! |---|---|
//! | `numbers` | the numbers, and their priors |
//! | `load` | the unknowns of a load |
//! | `view` | where a camera sees the dots of a solved film |
//! | `problem` | residuals of numbers and loads, and their rates |
//! | `equations` | the linearized problem as normal equations |
//! | `descent` | Gauss–Newton steps to the least χ² |
//! | `goodness_of_fit` | the meaning of χ², in words |
//! | `leave_one_out` | the fit's errors on loads left out of it |
//! | `field` | from few solved places of the tip to every place |
//! | `own_film` | the unit's tables and their uncertainty, for its model file |
//! | `weight` | the effect of gravity on the unit's film when it is turned |

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
use descent::{EXPLAINED, Found};
use goodness_of_fit::GoodnessOfFit;
pub use leave_one_out::LeaveOneOutError;
use numbers::Family;
pub use own_film::{FoundNumber, OwnFilm};
pub use problem::Bench;
use problem::{Problem, Trust};

/// Fineness of a unit's mesh. Coarser meshes do not resolve how the film bends between a tip and a
/// dot near it.
pub const FINENESS: f64 = 0.5;

/// Fineness of the mesh on which rates by the numbers are computed.
const COARSE: f64 = 0.3;

/// χ² over the number of seen coordinates above which loads contradict each other. Coordinates are
/// then some tenths of a pixel from the fit, which no film in tolerance reaches.
const CONTRADICTED: f64 = 2_500.0;

/// χ² over the number of seen coordinates falls by more than this, if not by chance, when a wrong
/// direction of gravity is left out.
const LESS: f64 = 0.4;

/// The result of a fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The unit's film, as a model file holds it.
    pub own: OwnFilm,
    /// χ² of the seen coordinates and of the priors, over the number of seen coordinates.
    pub chi_square: f64,
    held: Held,
    /// The load that the fit explains worst.
    worst: SeenLoad,
    /// The error of each load when it is left out of the fit.
    pub left_out: Vec<LeaveOneOutError>,
}

/// What is known of gravity under the loads.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Held {
    /// Nothing.
    Unstated,
    /// Its direction, as stated.
    AsStated,
    /// It is not as stated, in parts of g: only without that, one film explains the loads.
    Otherwise([f64; 3]),
}

/// Fits a unit to its rest position and to loads. `stage_mm` is the standard uncertainty of the
/// stage's zero; `from` is the fit of the unit's old film. A direction of gravity that contradicts
/// the loads is left out.
///
/// # Errors
/// When the film finds no equilibrium under a load, or the loads contradict each other.
pub fn fit(
    bench: &Bench,
    loads: &[SeenLoad],
    stage_mm: f64,
    from: Option<&OwnFilm>,
) -> Result<Fit> {
    let unstated = Bench {
        down: None,
        ..bench.clone()
    };
    let (mut problem, mut found) = unit_of(bench, loads, stage_mm, from)?;
    let mut held = bench.down.map_or(Held::Unstated, |_| Held::AsStated);
    if let Some(down) = bench.down.filter(|_| found.chi_square() >= EXPLAINED) {
        let without = unit_of(&unstated, loads, stage_mm, from)?;
        if without.1.chi_square() < EXPLAINED.min(found.chi_square() - LESS) {
            (problem, found) = without;
            held = Held::Otherwise(down);
        }
    }
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
        held,
        left_out: found.left_out(&problem)?,
        own: OwnFilm::new(&problem, &found)?,
    })
}

/// Finds the unit that explains the loads: one of the nominal family if there is one, else any.
/// Arguments as for [`fit`].
///
/// # Errors
/// When the film finds no equilibrium under a load.
fn unit_of<'a>(
    bench: &'a Bench,
    loads: &'a [SeenLoad],
    stage_mm: f64,
    from: Option<&OwnFilm>,
) -> Result<(Problem<'a>, Found)> {
    let problem = |family| Problem {
        bench,
        loads,
        family,
        priors: numbers::priors(family, bench, stage_mm, from),
        trust: Trust::WHOLE,
    };
    let [nominal, real] = [Family::Nominal, Family::Real].map(problem);
    match nominal.explained()? {
        Some(found) => Ok((nominal, found)),
        None => {
            let found = real.found()?;
            Ok((real, found))
        }
    }
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
        if let Held::Otherwise([x, y, z]) = self.held {
            writeln!(
                f,
                "The sensor was not held as was stated: gravity along {x:.2}, {y:.2}, {z:.2} \
                 contradicts the loads, and without it one film explains them. So the fit leaves \
                 it out. Correct `hivtac settings set down`."
            )?;
        }
        let turned = match (self.own.knows_weight(), self.held) {
            (true, _) => "The model holds when the sensor is turned.",
            (false, Held::AsStated) => {
                "The film finds no equilibrium when it is turned: then the sensor says \
                 `weight_unknown`."
            }
            (false, Held::Otherwise(_)) => "When it is turned, it says `weight_unknown`.",
            (false, Held::Unstated) => {
                "Nobody said which way the sensor was held (`hivtac settings set down`): when it \
                 is turned, it says `weight_unknown`."
            }
        };
        writeln!(f, "{turned}")
    }
}

#[cfg(test)]
mod tests;
