//! Makes the tables of the whole film from full solutions.

mod check;
mod fitted;
mod functions;
mod sampled;

pub use check::{Errors, WholeCheck, check_whole};
pub use fitted::whole;
pub use sampled::{Sampled, design, length, sample_place};
