//! Pixels to force: the `no_std`, allocation-free pipeline of the HiVTac sensor, in integers but
//! for [`forward`].
//!
//! ```text
//! rows ─threshold→ bit rows ─dilate→ runs ─label→ blobs (moments)
//!    → 4 markers → 11 features → quantized MLP → (α, β, |F|) → force + status
//!                                   └→ first guess → film run forwards → force, place + status
//! ```
//!
//! Everything here gives the same bits on a microcontroller, in an emulator and on a host.
//! It knows nothing of cameras, USB or files.
#![no_std]
// Allowed in one file only: the kernels in assembly.
#![deny(unsafe_code)]

#[cfg(any(test, feature = "encode"))]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod status;
pub mod units;

pub mod blob;
pub mod features;
pub mod force;
pub mod formats;
pub mod forward;
pub mod geometry;
pub mod hsv;
pub mod markers;
pub mod model;
pub mod motion;
pub mod network;
pub mod pipeline;
pub mod scanner;
pub mod screen;
pub mod settings;
pub mod tables;
pub mod tare;
pub mod threshold;

mod angle;
mod cordic;
mod dilate;
mod division;
mod history;
mod kernels;
mod label;
mod mask;
mod moments;
#[cfg(test)]
mod numerics;
#[cfg(test)]
mod picture;
mod rescale;
mod root;
mod runs;
