//! Pixels to force: the `no_std`, allocation-free pipeline of the HiVTac sensor.
//!
//! ```text
//! rows ─hivtac-markers→ 4 markers ─hivtac-force→ force + status
//! ```
//!
//! Everything here gives the same bits on a microcontroller, in an emulator and on a host.
//! It knows nothing of cameras, USB or files. What its users need of the parts that it joins is
//! here, too.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub use hivtac_force::{features, force, forward, layer, model, network, packing, rest};
pub use hivtac_markers::{blob, formats, rules, scanner, screen, settings, tables};

pub mod known_answer;
pub mod motion;
pub mod pipeline;
mod rezero;
pub mod tare;
pub mod temporal;

#[cfg(test)]
mod picture;
