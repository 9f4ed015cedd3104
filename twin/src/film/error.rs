//! What can be wrong with a load or a film.

use std::fmt;

/// A load or a film that the tables do not hold. The message says what, where and what is possible.
#[derive(Clone, Debug, PartialEq)]
pub enum FilmError {
    /// A load that is no number, pulls, or presses the film further than it can go; a film that is
    /// too unlike the nominal one.
    Load(String),
    /// Bytes do not hold a film's tables.
    Tables(String),
}

impl fmt::Display for FilmError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FilmError::Load(why) => write!(f, "load: {why}"),
            FilmError::Tables(why) => write!(f, "film's tables: {why}"),
        }
    }
}

impl std::error::Error for FilmError {}
