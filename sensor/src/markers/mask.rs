//! Defines the mask of one row: bit i of word w is column 32·w + i.

/// Widest row, in pixels.
pub const MAX_WIDTH: u16 = 800;
/// Words of the widest row.
pub const MAX_WORDS: usize = words_of(MAX_WIDTH);

/// Words that hold a row of `width` pixels.
pub const fn words_of(width: u16) -> usize {
    width.div_ceil(32) as usize
}

/// The bits of the last word that lie inside a row of `width` ≥ 1 pixels.
pub const fn last_word_bits(width: u16) -> u32 {
    u32::MAX >> ((32 - width % 32) % 32)
}

/// Returns whether any word is not 0.
#[inline(always)]
pub fn any_set(words: &[u32]) -> bool {
    words.iter().fold(0, |all, word| all | word) != 0
}

/// A range of adjacent words of a row.
#[derive(Clone, Copy, Debug)]
pub struct Near {
    /// Index of the first word.
    pub first: usize,
    /// Number of words.
    pub words: usize,
    /// The bits of the last word that are inside the row.
    pub last: u32,
}
