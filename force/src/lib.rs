//! Four markers to a force: `no_std`, no allocation; integers, and single precision in [`forward`].
//!
//! ```text
//! 4 markers → 11 features → quantized MLP → (α, β, |F|) → force + status
//!                              └→ first guess → film run forwards → force, place + status
//! ```
//!
//! | module | subject |
//! |---|---|
//! | `features`, `rest` | the paper's eleven numbers, and those of the untouched film |
//! | `model`, `layer`, `packing` | the model file |
//! | `network`, `rescale` | the quantized network |
//! | `forward` | the film run forwards, and Gauss–Newton steps on it |
//! | `force` | what is told of the answer: force, uncertainty, status |
//! | `kernels` | the hottest loops, in assembly for Cortex-M4 and M7 |
#![no_std]
// Allowed in one file only: the kernels in assembly.
#![deny(unsafe_code)]

#[cfg(any(test, feature = "encode"))]
extern crate alloc;
#[cfg(test)]
extern crate std;

pub mod features;
pub mod force;
pub mod forward;
pub mod layer;
pub mod model;
pub mod network;
pub mod rest;

mod kernels;
#[cfg(test)]
mod numerics;
pub mod packing;
mod rescale;
