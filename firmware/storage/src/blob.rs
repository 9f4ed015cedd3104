//! Stores many bytes in a sector of their own. A blob has no checksum inside: the record that names
//! it has its length and checksum.

use crate::flash::{self, Failed, Flash, Place, Unreadable, WORD_BYTES, Word};

/// Erases a sector, writes the bytes into it, and reads each word back.
///
/// # Errors
/// [`Failed`]: the bytes do not fit the sector, or do not read back.
pub(crate) async fn write<F: Flash>(
    flash: &mut F,
    sector: u32,
    bytes: &[u8],
) -> Result<(), Failed> {
    if bytes.len() > F::SECTOR_WORDS as usize * WORD_BYTES {
        return Err(Failed);
    }
    flash.erase(sector).await?;
    for (word, part) in (0..).zip(bytes.chunks(WORD_BYTES)) {
        flash::program(flash, Place { sector, word }, &padded(part)).await?;
    }
    Ok(())
}

/// Reads a sector's first bytes, as many as `bytes` has.
///
/// # Errors
/// [`Unreadable`]: one of the words is unreadable, or the sector is shorter.
pub fn read<F: Flash>(flash: &mut F, sector: u32, bytes: &mut [u8]) -> Result<(), Unreadable> {
    if bytes.len() > F::SECTOR_WORDS as usize * WORD_BYTES {
        return Err(Unreadable);
    }
    for (word, part) in (0..).zip(bytes.chunks_mut(WORD_BYTES)) {
        let read = flash.read(Place { sector, word })?;
        for (byte, value) in part.iter_mut().zip(read) {
            *byte = value;
        }
    }
    Ok(())
}

fn padded(part: &[u8]) -> Word {
    let mut word = [0; WORD_BYTES];
    for (byte, value) in word.iter_mut().zip(part) {
        *byte = *value;
    }
    word
}
