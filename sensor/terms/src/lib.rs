//! The words that both ends share, each once: units, status, threshold, marker, force, and what a
//! frame is like; and the integer arithmetic that the sensing's parts share.
//!
//! Feature `wire` lets messages carry them (`docs/wire.md`).
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod camera;
pub mod conditions;
pub mod down;
pub mod force;
pub mod geometry;
pub mod hsv;
pub mod marker;
pub mod status;
pub mod temporal;
pub mod threshold;
pub mod units;

pub mod angle;
pub mod cordic;
pub mod division;
pub mod fixed;
pub mod root;
