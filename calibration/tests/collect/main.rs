//! `hivtac-calibrate collect` with a sensor and a gauge that are played by the tests.
#![cfg(unix)]

mod fake;
mod free;
mod from_file;
mod guided;
mod over_serial;
mod watched;
mod weights;
