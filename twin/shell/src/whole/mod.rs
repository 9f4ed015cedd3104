//! Makes the tables of the whole film from full solutions.

mod check;
mod differences;
mod fitted;
mod functions;
mod sampled;

pub use check::{Errors, WholeCheck, WholeDomain, check_whole};
pub use differences::{Samples, differences};
pub use fitted::whole;
pub use sampled::{Sampled, design, length, sample_place};
