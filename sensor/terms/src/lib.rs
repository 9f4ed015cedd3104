//! Defines the terms that device and host share, each once: units, status, threshold, marker,
//! force, and properties of a frame. Also holds the integer arithmetic that the sensing's parts
//! share.
//!
//! Feature `wire` makes them part of messages (`docs/wire.md`).
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod camera;
pub mod conditions;
pub mod contact_shape;
pub mod down;
pub mod force;
pub mod geometry;
pub mod hsv;
pub mod layout;
pub mod list;
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
