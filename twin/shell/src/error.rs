//! The errors of making and pressing a film.

use std::fmt;

use hivtac_twin::SceneError;
use hivtac_twin::film::FilmError;

/// The reasons why a film cannot be made or pressed.
#[derive(Clone, Debug, PartialEq)]
pub enum ShellError {
    /// An impossible dimension, material or mesh.
    Design(String),
    /// An impossible contact.
    Contact(String),
    /// Newton's method ended without an equilibrium.
    NoEquilibrium {
        /// Steps taken.
        steps: usize,
        /// The largest unbalanced force, N.
        left_over_n: f64,
    },
    /// The sparse solver failed.
    Solver(String),
    /// An impossible camera or load.
    Scene(String),
}

impl fmt::Display for ShellError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ShellError::Design(why) => write!(f, "film: {why}"),
            ShellError::Contact(why) => write!(f, "contact: {why}"),
            ShellError::NoEquilibrium { steps, left_over_n } => write!(
                f,
                "no equilibrium after {steps} steps ({left_over_n:.1e} N left over): press less, \
                 or start from a state nearby"
            ),
            ShellError::Solver(why) => write!(f, "sparse solver: {why}"),
            ShellError::Scene(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for ShellError {}

impl From<FilmError> for ShellError {
    fn from(error: FilmError) -> ShellError {
        ShellError::Scene(error.to_string())
    }
}

impl From<SceneError> for ShellError {
    fn from(error: SceneError) -> ShellError {
        ShellError::Scene(error.to_string())
    }
}
