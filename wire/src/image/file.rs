//! Images: made from an ELF, or read from a file that was made of one, and checked.

use crate::image::header::{
    CHIP, CRC_AT, FIRST_STAGE_MAGIC, Header, LAYOUT, Mark, PROGRAM_MAGIC, TEXT_BYTES, UNSEALED,
};
use crate::image::{
    FIRST_STAGE, FLASH, HEADER_AT, MARK_AT, PROGRAM, Refusal, SECTOR_BYTES, WORD_BYTES,
};
use crc32fast::Hasher;
use object::Endianness;
use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};

/// Blank flash.
const BLANK: u8 = 0xFF;
/// The header's place in an image.
const HEADER: usize = (PROGRAM - FIRST_STAGE + HEADER_AT) as usize;
/// The program's.
const BEGIN: usize = (PROGRAM - FIRST_STAGE) as usize;

/// A checked image: first stage and program, with the program's checksum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    bytes: Vec<u8>,
    mark: Mark,
    version: String,
}

impl Image {
    /// Reads a file: an ELF, to make the image from, or an image.
    ///
    /// # Errors
    /// If it is not whole, or not for this chip and layout.
    pub fn of_file(file: &[u8]) -> Result<Image, Refusal> {
        match file.starts_with(b"\x7fELF") {
            true => Image::of_elf(file),
            false => Image::of_bytes(file.to_vec()),
        }
    }

    /// Makes the image of an ELF: its bytes in flash, from the first stage on, gaps as blank flash,
    /// with length and checksums in the header.
    ///
    /// # Errors
    /// If it is not the firmware's ELF.
    pub fn of_elf(elf: &[u8]) -> Result<Image, Refusal> {
        Image::of_loaded(loaded(elf)?)
    }

    /// Puts length and checksums into the header of an ELF's bytes in flash.
    pub(crate) fn of_loaded(mut bytes: Vec<u8>) -> Result<Image, Refusal> {
        let length = bytes.len().next_multiple_of(WORD_BYTES as usize);
        bytes.resize(length, BLANK);
        mark(&bytes, HEADER, PROGRAM_MAGIC)?;
        if length < HEADER + size_of::<Header>() {
            return Err(Refusal::NoImage);
        }
        let first_stage_crc = crc32fast::hash(&bytes[..BEGIN]);
        put(&mut bytes, field(80), (length - BEGIN) as u32);
        put(&mut bytes, field(84), first_stage_crc);
        let crc = program_crc(&bytes[BEGIN..]);
        put(&mut bytes, field(92), crc);
        Image::of_bytes(bytes)
    }

    /// Reads an image.
    ///
    /// # Errors
    /// As [`Image::of_file`].
    fn of_bytes(bytes: Vec<u8>) -> Result<Image, Refusal> {
        mark(&bytes, MARK_AT as usize, FIRST_STAGE_MAGIC)?;
        if bytes.len() < HEADER + size_of::<Header>() {
            let (has, says) = (bytes.len(), HEADER + size_of::<Header>());
            return Err(Refusal::Length { has, says });
        }
        let mark = mark(&bytes, HEADER, PROGRAM_MAGIC)?;
        let [length, first_stage_crc, crc] = [80, 84, 92].map(|at| word(&bytes, field(at)));
        if (length, crc) == (0, UNSEALED) {
            return Err(Refusal::Unsealed);
        }
        let (has, says) = (bytes.len(), BEGIN.saturating_add(length as usize));
        if has != says || !length.is_multiple_of(WORD_BYTES) || has > FLASH.len() {
            return Err(Refusal::Length { has, says });
        }
        let (first_stage, program) = bytes.split_at(BEGIN);
        let parts = [
            ("first stage", first_stage_crc, crc32fast::hash(first_stage)),
            ("program", crc, program_crc(program)),
        ];
        for (part, says, has) in parts {
            if has != says {
                return Err(Refusal::Damaged { part, says, has });
            }
        }
        let version = text(&bytes[field(48)..field(80)]);
        Ok(Image {
            bytes,
            mark,
            version,
        })
    }

    /// All bytes, from [`FIRST_STAGE`] on.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The first stage, without the blank flash behind it; a whole number of flash words.
    pub fn first_stage(&self) -> &[u8] {
        let sector = &self.bytes[..SECTOR_BYTES as usize];
        let end = sector.iter().rposition(|byte| *byte != BLANK);
        let end = end.map_or(0, |at| at + 1);
        &sector[..end.next_multiple_of(WORD_BYTES as usize)]
    }

    /// The program, from [`PROGRAM`] on; a whole number of flash words.
    pub fn program(&self) -> &[u8] {
        &self.bytes[BEGIN..]
    }

    /// The name of the board that it is for.
    pub fn board(&self) -> String {
        text(&self.mark.board)
    }

    /// The program's version.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// The parts to write into a device, one for each sector, in this order. `found` is how its
    /// flash begins ([`FIRST_LOOK`](super::FIRST_LOOK) bytes). An existing first stage stays: until
    /// the last byte is written it finds a wrong checksum, and starts the loader again. A missing
    /// one is written first.
    ///
    /// # Errors [`Refusal::OtherBoard`] if the existing first stage is another board's.
    pub fn parts(&self, found: &[u8]) -> Result<Vec<Part<'_>>, Refusal> {
        let mut parts = Vec::new();
        match board_of(found) {
            Some(board) => self.fits(&board)?,
            None => parts.push(Part {
                address: FIRST_STAGE,
                bytes: self.first_stage(),
            }),
        }
        let sectors = self.program().chunks(SECTOR_BYTES as usize);
        parts.extend(sectors.zip(0..).map(|(bytes, nth)| Part {
            address: PROGRAM + nth * SECTOR_BYTES,
            bytes,
        }));
        Ok(parts)
    }

    /// Checks that it is for this board.
    ///
    /// # Errors
    /// [`Refusal::OtherBoard`].
    pub fn fits(&self, device: &str) -> Result<(), Refusal> {
        let image = self.board();
        let device = device.to_owned();
        match image == device {
            true => Ok(()),
            false => Err(Refusal::OtherBoard { image, device }),
        }
    }
}

/// The bytes of an erased sector, from its start on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part<'a> {
    /// Address of the sector.
    pub address: u32,
    /// Whole flash words.
    pub bytes: &'a [u8],
}

/// The board of flash that begins with a first stage; `None` if it does not, or if the layout is
/// another.
pub fn board_of(flash: &[u8]) -> Option<String> {
    let mark = mark(flash, MARK_AT as usize, FIRST_STAGE_MAGIC).ok()?;
    Some(text(&mark.board))
}

/// The version in the header of a program, from its begin on; `None` without one.
pub fn version_of(program: &[u8]) -> Option<String> {
    mark(program, HEADER_AT as usize, PROGRAM_MAGIC).ok()?;
    let at = HEADER_AT as usize + 48;
    Some(text(program.get(at..at + TEXT_BYTES)?))
}

/// An ELF's bytes in flash.
fn loaded(elf: &[u8]) -> Result<Vec<u8>, Refusal> {
    let bad = |why: String| Refusal::BadElf(why);
    let file = ElfFile32::<Endianness>::parse(elf).map_err(|error| bad(error.to_string()))?;
    let (endian, mut image) = (file.endian(), Vec::new());
    for segment in file.elf_program_headers() {
        let bytes = segment.data(endian, elf);
        let bytes = bytes.map_err(|()| bad("it is cut".to_owned()))?;
        if segment.p_type(endian) != PT_LOAD || bytes.is_empty() {
            continue;
        }
        let address = segment.p_paddr(endian);
        let end = u64::from(address) + bytes.len() as u64;
        if !FLASH.contains(&address) || end > u64::from(FLASH.end) {
            return Err(Refusal::Outside(address));
        }
        let at = (address - FLASH.start) as usize;
        let needed = at + bytes.len();
        if image.len() < needed {
            image.resize(needed, BLANK);
        }
        image[at..needed].copy_from_slice(bytes);
    }
    Ok(image)
}

/// Reads and checks a mark.
fn mark(bytes: &[u8], at: usize, magic: [u8; 8]) -> Result<Mark, Refusal> {
    let found = bytes.get(at..at + size_of::<Mark>());
    let found = found.ok_or(Refusal::NoImage)?;
    let (begin, board) = found.split_at(16);
    if begin[..8] != magic {
        return Err(Refusal::NoImage);
    }
    let (layout, chip) = (word(begin, 8), word(begin, 12));
    match () {
        () if chip != CHIP => Err(Refusal::OtherChip(chip)),
        () if layout != LAYOUT => Err(Refusal::OtherLayout(layout)),
        () => Ok(Mark {
            magic,
            layout,
            chip,
            board: board.try_into().map_err(|_| Refusal::NoImage)?,
        }),
    }
}

/// The checksum that a program's header should have.
fn program_crc(program: &[u8]) -> u32 {
    let (before, rest) = program.split_at(CRC_AT as usize);
    let mut hasher = Hasher::new();
    hasher.update(before);
    hasher.update(&rest[4..]);
    hasher.finalize()
}

/// The place in an image of the header's byte `at`.
fn field(at: usize) -> usize {
    HEADER + at
}

fn word(bytes: &[u8], at: usize) -> u32 {
    let four = bytes[at..at + 4].try_into();
    u32::from_le_bytes(four.expect("four bytes"))
}

fn put(bytes: &mut [u8], at: usize, word: u32) {
    bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
}

/// A text padded with zeros; characters other than printable ASCII become `?`.
fn text(padded: &[u8]) -> String {
    let bytes = padded.iter().take_while(|byte| **byte != 0);
    let shown = bytes.map(|byte| match byte {
        b' '..=b'~' => char::from(*byte),
        _ => '?',
    });
    shown.collect()
}

#[cfg(test)]
mod tests;
