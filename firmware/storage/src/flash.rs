//! The flash that bytes are kept in, one word at a time.

use core::future::Future;

/// Bytes of a word, which is programmed at once.
pub const WORD_BYTES: usize = 32;

/// A word.
pub type Word = [u8; WORD_BYTES];

/// A word that was erased and not programmed.
pub const BLANK: Word = [0xFF; WORD_BYTES];

/// Where a word lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The sector.
    pub sector: u32,
    /// The word in it.
    pub word: u32,
}

impl Place {
    /// So many words further on.
    pub(crate) fn behind(self, words: u32) -> Self {
        Self {
            word: self.word + words,
            ..self
        }
    }
}

/// The word's error correction found more wrong bits than it corrects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unreadable;

/// The flash did not do what it was told to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failed;

/// Some sectors of flash.
pub trait Flash {
    /// Words of a sector.
    const SECTOR_WORDS: u32;

    /// What a word reads as.
    ///
    /// # Errors
    /// [`Unreadable`]: its programming was cut off, or it is worn.
    fn read(&mut self, place: Place) -> Result<Word, Unreadable>;

    /// Programs a blank word.
    ///
    /// # Errors
    /// [`Failed`]: it may read as anything now.
    fn program(&mut self, place: Place, word: &Word) -> impl Future<Output = Result<(), Failed>>;

    /// Makes every word of a sector blank.
    ///
    /// # Errors
    /// [`Failed`]: it may read as anything now.
    fn erase(&mut self, sector: u32) -> impl Future<Output = Result<(), Failed>>;
}

/// Programs a word and reads it back.
///
/// # Errors
/// [`Failed`]: it does not read as it should.
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
