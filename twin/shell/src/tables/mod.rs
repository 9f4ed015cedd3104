//! Makes the tables of the reduced film from full solutions.

mod fit;
mod known;
mod symmetry;

use hivtac_twin::film::reduced::{Kind, Tables};

use crate::ShellError;
use crate::sweep::Solved;
pub(crate) use fit::{Known, inverse, nearest, splines};
use known::Sweeps;
pub(crate) use known::{poses, same, slopes};
pub(crate) use symmetry::Mirror;

/// Places nearer to each other than this are the same, mm.
const SAME_PLACE_MM: f64 = 1e-9;

/// Returns the tables of a film from two sweeps: with a tip of the nominal radius and of the
/// largest.
///
/// # Errors
/// If a place is missing in a sweep, or too few loads were solved there.
pub fn tables(nominal: &[Solved], largest: &[Solved]) -> Result<Tables, ShellError> {
    let sweeps = Sweeps { nominal, largest };
    let mut coefficients = Vec::new();
    for kind in Kind::ALL {
        coefficients.push(of_kind(&sweeps, kind)?);
    }
    Ok(Tables::new(|kind| coefficients[kind as usize].clone()))
}

/// Returns a table's coefficients by node along y, node along x, output and term.
fn of_kind(sweeps: &Sweeps, kind: Kind) -> Result<Vec<f64>, ShellError> {
    let (axis, terms) = (kind.axis(), kind.terms());
    let mut rows = Vec::new();
    for y in axis.nodes() {
        let mut line = Vec::new();
        for x in axis.nodes() {
            line.push(nearest(&terms, &sweeps.known(kind, [*x, *y])?)?);
        }
        rows.push(line);
    }
    Ok(splines(&axis, rows)
        .into_iter()
        .flatten()
        .flatten()
        .collect())
}
