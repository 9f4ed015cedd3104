//! The errors of a load or a film.

use std::fmt;

/// A load or a film outside the tables' range. The message names the item, the cause and the
/// possible values.
#[derive(Clone, Debug, PartialEq)]
pub enum FilmError {
    /// A load that is not a number, pulls, or presses the film further than it can go; or a film
    /// that differs too much from the nominal one.
    Load(String),
    /// Dots that no film can have.
    Layout(String),
    /// The bytes are not the tables of a film.
    Tables(String),
}

impl fmt::Display for FilmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FilmError::Load(why) => write!(f, "load: {why}"),
            FilmError::Layout(why) => write!(f, "layout: {why}"),
            FilmError::Tables(why) => write!(f, "film's tables: {why}"),
        }
    }
}

impl std::error::Error for FilmError {}
