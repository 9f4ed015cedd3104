//! Tests of `hivtac-calibrate collect` with a fake sensor and a fake gauge.
#![cfg(unix)]

mod fake;
mod free;
mod from_file;
mod guided;
mod over_serial;
mod watched;
mod weights;
