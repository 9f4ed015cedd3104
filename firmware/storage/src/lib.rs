//! What a device keeps in its flash, through power cuts at any time: the logic alone, without a
//! register.
//!
//! Two ways to keep bytes, in sectors of their own. A [`Log`] has one small record, which is
//! written anew as a whole each time: after a cut at any operation it reads as it was before or as
//! it was to be. A [`blob`] has a sector and is large; what tells whether it is whole is a record
//! of the log that names it, written once the blob was read back.
//!
//! The flash is one whose words have an error correcting code of their own, as those of 256 bits of
//! an STM32H7: a word is programmed once between two erases, and one whose programming was cut off
//! may read as an error, or once so and once otherwise.
#![no_std]
#![forbid(unsafe_code)]

pub mod blob;
pub mod flash;
mod log;
mod record;

#[cfg(test)]
extern crate std;

pub use log::{Log, PAYLOAD_LIMIT, SaveError};
