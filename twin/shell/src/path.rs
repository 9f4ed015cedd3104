//! Paths of states, each found from the ones before, and evenly spread loads.

use crate::{Contact, Equilibrium, Film, ShellError};

/// Number of known states from which a start is predicted.
const FORETOLD_FROM: usize = 4;

/// States found one after the other; the start of each is predicted from the latest.
pub struct Path(Vec<(f64, Equilibrium)>);

impl Path {
    pub fn from_rest(film: &Film) -> Path {
        Path(vec![(0.0, film.rest())])
    }

    /// Returns the state of the next place.
    pub fn go(
        &mut self,
        film: &Film,
        contact: Contact,
        place: f64,
    ) -> Result<Equilibrium, ShellError> {
        let latest = &self.0[self.0.len().saturating_sub(FORETOLD_FROM)..];
        let known: Vec<_> = latest.iter().map(|(at, state)| (*at, state)).collect();
        let last = &self.0[self.0.len() - 1].1;
        let state = Equilibrium::extrapolated(&known, place)
            .and_then(|start| film.press(contact, &start).ok())
            .map_or_else(|| film.press(contact, last), Ok)?;
        self.0.push((place, state.clone()));
        Ok(state)
    }
}

/// Returns a number of Halton's sequence: the digits of `index` in `base`, reversed behind the
/// point.
pub fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= base as f64;
        value += place * (index % base) as f64;
        index /= base;
    }
    value
}
