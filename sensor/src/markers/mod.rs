//! Turns pixels into four markers: in integers, and in single precision in `rules`.
//!
//! ```text
//! rows ─threshold→ bit rows ─dilate→ runs ─label→ blobs (moments) ─rules→ 4 markers
//! ```
//!
//! | module | subject |
//! |---|---|
//! | `tables`, `formats`, `screen` | which pixels pass the threshold, and their weights |
//! | `mask`, `dilate`, `history`, `runs` | rows of bits, and runs of them |
//! | `label`, `moments`, `blob` | 8-connected runs, summed up |
//! | `beside` | differences of the film on both sides of a blob |
//! | `scanner` | from rows to blobs, as rows arrive |
//! | `lost` | markers that a frame does not show |
//! | `majority` | removes specks and holes from rows of bits |
//! | `rules` | which four blobs are the markers, and whether to trust them |
//! | `settings` | what must be set before the first frame |
//! | `kernels` | the hottest loops, in assembly for Cortex-M4 and M7 |

pub mod beside;
pub mod blob;
pub mod formats;
pub mod lost;
pub mod rules;
pub mod scanner;
pub mod screen;
pub mod settings;
pub mod tables;

mod dilate;
mod history;
mod kernels;
mod label;
mod majority;
mod mask;
mod moments;
#[cfg(test)]
mod numerics;
mod runs;

pub use kernels::sqrt;
