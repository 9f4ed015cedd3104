//! Solves what objects do to the film, with the truth that belongs to it.

use anyhow::{Context, Result};
use hivtac_shell::{Equilibrium, Film};
use hivtac_terms::contact_shape::ContactShape;
use rayon::prelude::*;

use super::objects::{Drawn, KINDS, Kind, Object};

/// Which presses to solve.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Presses of each kind.
    pub of_each: u32,
    /// Seed of all draws.
    pub seed: u64,
    /// Whether they are beside dots only.
    pub near_dots: bool,
}

/// A press of an object.
#[derive(Clone, Debug)]
pub struct Press {
    /// The object's kind.
    pub kind: Kind,
    /// Its shape, if the sensor can be told.
    pub shape: Option<ContactShape>,
    /// The film under it.
    pub state: Equilibrium,
    /// The true force on the film, N, film frame.
    pub force_n: [f64; 3],
    /// The true centre of pressure, mm: the mean of the points of the mounted film that touch,
    /// weighted by the normal pressure.
    pub centre_mm: [f64; 2],
}

/// Solves presses of all kinds on a film, on all threads. They come by kind, in the order of
/// [`KINDS`], each kind in the order of its draws. A press is left out if the contact reaches too
/// far for the solver; it is told on stderr.
///
/// # Errors
/// If a draw is impossible.
pub fn presses(film: &Film, plan: Plan) -> Result<Vec<Press>> {
    let numbers = 0..plan.of_each;
    let draws = KINDS
        .iter()
        .flat_map(|kind| numbers.clone().map(move |number| (*kind, number)));
    let solved = draws
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(kind, number)| {
            let drawn = kind.draw(plan.seed, number, plan.near_dots)?;
            let name = drawn.name.clone();
            let solved = Press::solve(film, kind, drawn);
            Ok(solved
                .inspect_err(|why| eprintln!("left out: {name}: {why:#}"))
                .ok())
        });
    Ok(solved
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .flatten()
        .collect())
}

impl Press {
    /// Solves a press of an object.
    ///
    /// # Errors
    /// If the film finds no rest under it.
    pub fn solve(film: &Film, kind: Kind, drawn: Drawn) -> Result<Press> {
        let Drawn {
            object,
            shape,
            force_n,
            ..
        } = drawn;
        let (state, centre_mm) = match object {
            Object::Patch(patch) => {
                let state = film.press_patch(&patch, force_n, &film.rest());
                (state.context("a patch")?, patch.centre_mm())
            }
            Object::Body(body) => {
                let touch = film.press_body(&body, force_n, &film.rest())?;
                (touch.state, touch.patch.centre_mm())
            }
        };
        Ok(Press {
            kind,
            shape,
            state,
            force_n,
            centre_mm,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_shell::Design;

    #[test]
    fn presses_come_by_kind_with_their_truth() {
        let design = Design {
            fineness: 0.25,
            ..Design::default()
        };
        let film = Film::new(&design).unwrap();
        let plan = Plan {
            of_each: 1,
            seed: 3,
            near_dots: false,
        };
        let presses = presses(&film, plan).unwrap();
        let kinds: Vec<Kind> = presses.iter().map(|press| press.kind).collect();
        assert_eq!(kinds, KINDS);
        for press in presses {
            assert!(press.force_n[2] < -0.01);
            // A long cylinder bears most on its end beside a post.
            let out = press
                .centre_mm
                .iter()
                .fold(0.0, |most: f64, part| most.max(part.abs()));
            assert!(out < 9.0, "{:?} {out}", press.kind);
        }
    }
}
