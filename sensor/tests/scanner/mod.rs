//! Tests the scanner through its public interface: against a pixel-by-pixel reference, at the
//! limits, and with input that it refuses.

mod extremes;
mod random;
mod reference;
mod refusals;
