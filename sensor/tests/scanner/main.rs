//! The scanner through its public face: against a pixel-by-pixel reference, at the limits, and on
//! what it refuses.

mod extremes;
mod random;
mod reference;
mod refusals;
