//! What a model makes of a data set: the paper's figures and numbers (Section 7.1), with confidence
//! intervals.

mod coverage;
mod figures;
mod judge;
mod numbers;
mod places;
mod report;

pub use coverage::{Coverage, Covered, coverage};
pub use judge::{Evaluation, Judged};
pub use numbers::{Interval, Numbers};
pub use places::{PlaceErrors, PlaceNumbers, by_place};
