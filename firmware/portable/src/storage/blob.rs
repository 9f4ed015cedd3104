//! Stores many bytes in sectors of their own. A blob has no checksum inside: the record that names
//! it has its length and checksum.

use crate::storage::flash::{self, Failed, Flash, Place, Unreadable, WORD_BYTES, Word};
use core::ops::Range;

/// Erases as many of the sectors as the bytes need, writes them, and reads each word back.
///
/// # Errors
/// [`Failed`]: the bytes do not fit the sectors, or do not read back.
pub(crate) async fn write<F: Flash>(
    flash: &mut F,
    sectors: Range<u32>,
    bytes: &[u8],
) -> Result<(), Failed> {
    if !fits::<F>(&sectors, bytes) {
        return Err(Failed);
    }
    for (sector, part) in sectors.zip(bytes.chunks(sector_bytes::<F>())) {
        flash.erase(sector).await?;
        for (word, part) in (0..).zip(part.chunks(WORD_BYTES)) {
            flash::program(flash, Place { sector, word }, &padded(part)).await?;
        }
    }
    Ok(())
}

/// Reads the first bytes of the sectors, as many as `bytes` has.
///
/// # Errors
/// [`Unreadable`]: one of the words is unreadable, or the sectors are shorter.
pub fn read<F: Flash>(
    flash: &mut F,
    sectors: Range<u32>,
    bytes: &mut [u8],
) -> Result<(), Unreadable> {
    if !fits::<F>(&sectors, bytes) {
        return Err(Unreadable);
    }
    for (sector, part) in sectors.zip(bytes.chunks_mut(sector_bytes::<F>())) {
        read_sector(flash, sector, part)?;
    }
    Ok(())
}

fn read_sector<F: Flash>(flash: &mut F, sector: u32, bytes: &mut [u8]) -> Result<(), Unreadable> {
    for (word, part) in (0..).zip(bytes.chunks_mut(WORD_BYTES)) {
        let read = flash.read(Place { sector, word })?;
        for (byte, value) in part.iter_mut().zip(read) {
            *byte = value;
        }
    }
    Ok(())
}

fn sector_bytes<F: Flash>() -> usize {
    F::SECTOR_WORDS as usize * WORD_BYTES
}

fn fits<F: Flash>(sectors: &Range<u32>, bytes: &[u8]) -> bool {
    bytes.len() <= sectors.len() * sector_bytes::<F>()
}

fn padded(part: &[u8]) -> Word {
    let mut word = [0; WORD_BYTES];
    for (byte, value) in word.iter_mut().zip(part) {
        *byte = *value;
    }
    word
}
