//! What a model makes of a data set, or of frames rendered anew: how far its forces are from the
//! truth, and whether its uncertainties hold.
//!
//! | file | subject |
//! |---|---|
//! | `answer` | what the chip says of a row of a data set |
//! | `judge` | its answers to a whole data set, beside the truth |
//! | `numbers`, `figures`, `places`, `report` | of these, the paper's numbers and figures (Section 7.1), with confidence intervals, as one HTML file |
//! | `bounds`, `coverage` | what stated uncertainties promise, and whether they keep it |
//! | `check`, `errors` | frames rendered anew, through the whole pipeline |
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
