//! Turns pixels into a force: the `no_std`, allocation-free pipeline of the HiVTac sensor.
//!
//! ```text
//! rows ─markers→ 4 markers ─force→ force + status
//! ```
//!
//! | module | subject |
//! |---|---|
//! | [`markers`] | pixels to four markers |
//! | [`force`] | four markers to a force |
//! | [`pipeline`] | both, for frame after frame, and the rest position in use |
//! | [`tare`] | a rest position from frames of the untouched film, checked |
//! | [`temporal`] | contact, slip, filter and creep: from one frame to the next |
//! | [`motion`] | how far the film moves while a frame is exposed |
//! | [`known_answer`] | a question with a known answer, to check a model before use |
//!
//! Everything here gives the same bits on a microcontroller, in an emulator and on a host.
//! It does not depend on cameras, USB or files.
#![no_std]
// Allowed in two files only: the kernels in assembly.
#![deny(unsafe_code)]

#[cfg(any(test, feature = "encode"))]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod force;
pub mod known_answer;
pub mod markers;
pub mod motion;
pub mod pipeline;
mod rezero;
pub mod tare;
pub mod temporal;

#[cfg(test)]
mod picture;
