//! Defines the flash in which bytes are kept, one word at a time.

use core::future::Future;

/// Bytes of a word, the unit of programming.
pub const WORD_BYTES: usize = 32;

/// A word.
pub type Word = [u8; WORD_BYTES];

/// An erased word.
pub const BLANK: Word = [0xFF; WORD_BYTES];

/// The place of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The sector.
    pub sector: u32,
    /// The word's number in it.
    pub word: u32,
}

impl Place {
    /// The place `words` words further on.
    pub(crate) fn behind(self, words: u32) -> Self {
        Self {
            word: self.word + words,
            ..self
        }
    }
}

/// The word's error correction found more wrong bits than it can correct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unreadable;

/// The flash operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failed;

/// Some sectors of flash.
pub trait Flash {
    /// Words of a sector.
    const SECTOR_WORDS: u32;

    /// Reads a word.
    ///
    /// # Errors
    /// [`Unreadable`]: its programming was cut off, or it is worn.
    fn read(&mut self, place: Place) -> Result<Word, Unreadable>;

    /// Programs a blank word.
    ///
    /// # Errors
    /// [`Failed`]: its content is now undefined.
    fn program(&mut self, place: Place, word: &Word) -> impl Future<Output = Result<(), Failed>>;

    /// Makes every word of a sector blank.
    ///
    /// # Errors
    /// [`Failed`]: its content is now undefined.
    fn erase(&mut self, sector: u32) -> impl Future<Output = Result<(), Failed>>;
}

/// Programs a word and reads it back.
///
/// # Errors
/// [`Failed`]: it does not read back as programmed.
pub(crate) async fn program<F: Flash>(
    flash: &mut F,
    place: Place,
    word: &Word,
) -> Result<(), Failed> {
    flash.program(place, word).await?;
    match flash.read(place) {
        Ok(read) if read == *word => Ok(()),
        _ => Err(Failed),
    }
}
