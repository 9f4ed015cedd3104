//! Pixels to force: the `no_std`, allocation-free, integer-only pipeline of the HiVTac sensor.
//!
//! ```text
//! rows ─threshold→ bit rows ─dilate→ runs ─label→ blobs (moments)
//!    → 4 markers → 11 features → quantized MLP → (α, β, |F|) → force + status
//! ```
//!
//! Everything here gives the same bits on a microcontroller, in an emulator and on a host.
//! It knows nothing of cameras, USB or files.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(any(test, feature = "encode"))]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod status;
pub mod units;

pub mod blob;
pub mod features;
pub mod force;
pub mod geometry;
pub mod hsv;
pub mod markers;
pub mod model;
pub mod network;
pub mod pipeline;
pub mod scanner;
pub mod settings;
pub mod tare;
pub mod threshold;

mod cordic;
mod dilate;
mod label;
mod mask;
#[cfg(test)]
mod picture;
mod runs;
