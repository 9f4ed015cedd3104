//! Keeps data in the flash of a device, through power cuts at any time: the logic alone, without
//! registers.
//!
//! There are two ways to keep bytes, in separate sectors. A [`Log`] has one small record, which is
//! rewritten as a whole each time. After a power cut at any operation it reads as the old or as the
//! new record. A [`blob`] has sectors of its own and is large. A record of the log names it,
//! written after the blob was read back; this record proves that the blob is whole.
//!
//! The words of the flash have an error correcting code of their own, as the 256-bit words of an
//! STM32H7. A word is programmed once between two erases. If its programming was cut off, it may
//! read as an error, or differently each time.

pub mod blob;
pub mod flash;
mod log;
mod record;

pub use log::{Log, PAYLOAD_LIMIT, SaveError};
