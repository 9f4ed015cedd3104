//! A unit's film and camera from known loads: least squares over the numbers in which units differ,
//! each drawn to its mean as strongly as units scatter, with the film solved by finite elements.

pub mod descent;
pub mod field;
pub mod linear;
pub mod load;
pub mod numbers;
pub mod own;
pub mod problem;
pub mod seen;
