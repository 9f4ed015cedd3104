//! The firmware's image: how it lies in flash, its header, and the checks of a file before it is
//! written.
//!
//! The first sector has the *first stage* alone: it starts the program if the checksum in the
//! program's [`header`] is right, and the microcontroller's own loader if not. An update does not
//! write that sector, so a power cut at any time leaves a device that can be updated again.
//!
//! With the feature `images`: [`Image`], from an ELF or from a file that was made of one.

#[cfg(feature = "images")]
mod dfuse;
#[cfg(feature = "images")]
pub mod examples;
#[cfg(feature = "images")]
mod file;
pub mod header;
#[cfg(feature = "images")]
mod refusal;

use core::ops::Range;
#[cfg(feature = "images")]
pub use file::{Image, Part, board_of, version_of};
#[cfg(feature = "images")]
pub use refusal::Refusal;

/// Addresses of the flash's first bank, which an image may fill. Data that outlive an update are in
/// the second one.
pub const FLASH: Range<u32> = 0x0800_0000..0x0810_0000;
/// Bytes of a sector, the smallest unit of an erase.
pub const SECTOR_BYTES: u32 = 128 << 10;
/// Bytes of a flash word: an image's length is a multiple.
pub const WORD_BYTES: u32 = 32;
/// Address of the first stage, which has the first sector.
pub const FIRST_STAGE: u32 = FLASH.start;
/// Address of the program, in the sector behind it.
pub const PROGRAM: u32 = FIRST_STAGE + SECTOR_BYTES;
/// Bytes from the first stage's begin to its [`header::Mark`], behind its vectors.
pub const MARK_AT: u32 = 0x40;
/// Bytes of the flash, from its begin on, that say which first stage it has.
pub const FIRST_LOOK: usize = MARK_AT as usize + size_of::<header::Mark>();
/// Bytes from the program's begin to its [`header::Header`], behind its vectors.
pub const HEADER_AT: u32 = 0x400;
