//! The header of a program in flash, and the first stage's mark. Numbers are little-endian.

use crate::image::HEADER_AT;

/// Version of the flash's layout: the places of first stage, program, settings and models, and of
/// these fields. An update between versions is refused.
pub const LAYOUT: u32 = 1;
/// DBGMCU_IDC's DEV_ID of the STM32H743.
pub const CHIP: u32 = 0x450;
/// Bytes of a name or a version, the rest zero.
pub const TEXT_BYTES: usize = 32;
/// In place of the checksum in an ELF, together with a length of zero. Neither blank flash nor a
/// word whose programming was cut off reads so.
pub const UNSEALED: u32 = 0x756E_7365;
/// Begins a first stage's mark.
pub const FIRST_STAGE_MAGIC: [u8; 8] = *b"HiVTac 1";
/// Begins a program's header.
pub const PROGRAM_MAGIC: [u8; 8] = *b"HiVTacFW";

/// The layout, chip and board of a part of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Mark {
    /// [`FIRST_STAGE_MAGIC`] or [`PROGRAM_MAGIC`].
    pub magic: [u8; 8],
    /// [`LAYOUT`].
    pub layout: u32,
    /// [`CHIP`].
    pub chip: u32,
    /// The board's name, as in the device's hello.
    pub board: [u8; TEXT_BYTES],
}

impl Mark {
    /// The mark of a first stage for this board.
    ///
    /// # Panics
    /// If the name is longer than [`TEXT_BYTES`]; in a constant, that does not compile.
    pub const fn of_first_stage(board: &str) -> Mark {
        Mark::new(FIRST_STAGE_MAGIC, board)
    }

    const fn new(magic: [u8; 8], board: &str) -> Mark {
        Mark {
            magic,
            layout: LAYOUT,
            chip: CHIP,
            board: padded(board),
        }
    }
}

/// The program's header, at [`HEADER_AT`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Header {
    /// The program's layout, chip and board.
    pub mark: Mark,
    /// The program's version.
    pub version: [u8; TEXT_BYTES],
    /// Bytes of the program, a multiple of the flash's word; 0 in an ELF.
    pub length: u32,
    /// CRC-32 of the first sector, blank flash as 0xFF, in the image that the program came with; 0
    /// in an ELF. The device does not use it.
    pub first_stage_crc: u32,
    /// Zero.
    pub reserved: u32,
    /// CRC-32 (as of zip) of the program's bytes without these four; [`UNSEALED`] in an ELF.
    pub crc: u32,
}

/// Bytes from the program's begin to its checksum.
pub const CRC_AT: u32 = HEADER_AT + size_of::<Header>() as u32 - 4;

impl Header {
    /// The header in an ELF, whose length and checksum are not known yet.
    ///
    /// # Panics
    /// If a text is longer than [`TEXT_BYTES`]; in a constant, that does not compile.
    pub const fn unsealed(board: &str, version: &str) -> Header {
        Header {
            mark: Mark::new(PROGRAM_MAGIC, board),
            version: padded(version),
            length: 0,
            first_stage_crc: 0,
            reserved: 0,
            crc: UNSEALED,
        }
    }
}

const fn padded(text: &str) -> [u8; TEXT_BYTES] {
    let (from, mut to) = (text.as_bytes(), [0; TEXT_BYTES]);
    let mut at = 0;
    while at < from.len() {
        to[at] = from[at];
        at += 1;
    }
    to
}

// `first_stage.s` reads these places.
const _: () = assert!(size_of::<Mark>() == 48 && size_of::<Header>() == 96 && CRC_AT == 0x45C);
