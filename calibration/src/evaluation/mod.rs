//! Evaluates a model on a data set or on newly rendered frames: the errors of its forces, and
//! whether its uncertainties hold.
//!
//! | file | subject |
//! |---|---|
//! | `answer` | the chip's answer to a row of a data set |
//! | `judge` | its answers to a whole data set, compared with the truth |
//! | `numbers`, `figures`, `places`, `report` | their numbers and figures, as the paper's (7.1) |
//! | `bounds`, `coverage` | the 95 % bounds of stated uncertainties, and whether they hold |
//! | `check`, `errors` | newly rendered frames, through the whole pipeline |
//! | `plot` | SVG |

pub mod answer;
pub mod bounds;
pub mod check;
mod coverage;
pub mod errors;
mod figures;
mod judge;
mod numbers;
mod places;
pub mod plot;
mod report;

pub use coverage::{Coverage, Covered, coverage};
pub use judge::{Evaluation, Judged};
pub use numbers::{Interval, Numbers};
pub use places::{PlaceErrors, PlaceNumbers, by_place};
