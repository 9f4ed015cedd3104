//! Reasons why a firmware file is refused.

use crate::image::header::{CHIP, LAYOUT};
use std::fmt;

/// Why a file is no image for the device: the fault, its place, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// It has no mark of the sensor's firmware.
    NoImage,
    /// An ELF that cannot be read; the reason.
    BadElf(String),
    /// An ELF that loads something outside of the first bank, at this address.
    Outside(u32),
    /// It is for a chip with this DEV_ID.
    OtherChip(u32),
    /// It is for a flash laid out by this version.
    OtherLayout(u32),
    /// It has fewer bytes than its header says, or more.
    Length {
        /// Bytes of the file.
        has: usize,
        /// Bytes by its header.
        says: usize,
    },
    /// It has no checksum.
    Unsealed,
    /// Its bytes are not those that its checksum is of.
    Damaged {
        /// The part.
        part: &'static str,
        /// The checksum in the file.
        says: u32,
        /// That of the file's bytes.
        has: u32,
    },
    /// It is for another board.
    OtherBoard {
        /// The image's board.
        image: String,
        /// The device's.
        device: String,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Refusal::NoImage => f.write_str(
                "no firmware of this sensor: its mark is missing; give the .bin of a release, or \
                 the ELF that `cargo build -p hivtac-firmware` makes",
            ),
            Refusal::BadElf(why) => write!(f, "an ELF that cannot be read: {why}; build it again"),
            Refusal::Outside(address) => write!(
                f,
                "it loads something at {address:#010x}, outside of the flash for the program; it \
                 is no firmware of this sensor"
            ),
            Refusal::OtherChip(chip) => write!(
                f,
                "for another chip, with id {chip:#x}; the sensor's is {CHIP:#x} (STM32H743)"
            ),
            Refusal::OtherLayout(layout) => write!(
                f,
                "for flash that is laid out by version {layout}; this program knows version \
                 {LAYOUT}: take the `hivtac` of the firmware's release"
            ),
            Refusal::Length { has, says } if has < says => write!(
                f,
                "cut: it has {has} of its {says} bytes; fetch or make it again"
            ),
            Refusal::Length { has, says } => write!(
                f,
                "damaged: it has {has} bytes, and its header says {says}; fetch or make it again"
            ),
            Refusal::Unsealed => f.write_str(
                "it has no checksum, as `objcopy` leaves it; give the ELF itself, from which the \
                 image is made",
            ),
            Refusal::Damaged { part, says, has } => write!(
                f,
                "damaged: the checksum of its {part} is {has:08x}, and its header says \
                 {says:08x}; fetch or make it again"
            ),
            Refusal::OtherBoard { image, device } => write!(
                f,
                "for the board {image}, and the device is a {device}; give the firmware for \
                 {device}"
            ),
        }
    }
}

impl std::error::Error for Refusal {}
