//! The mask of one row: bit i of word w is column 32·w + i.

use crate::threshold::ThresholdTable;

/// Widest row, in pixels.
pub const MAX_WIDTH: u16 = 800;
/// Words of the widest row.
pub const MAX_WORDS: usize = words_of(MAX_WIDTH);

/// The thresholded bits of one row. Bits from the row's width on are unset.
pub type MaskRow = [u32; MAX_WORDS];

/// An empty row.
pub const EMPTY_ROW: MaskRow = [0; MAX_WORDS];

/// Words that hold a row of `width` pixels.
pub const fn words_of(width: u16) -> usize {
    width.div_ceil(32) as usize
}

/// The bits of the last word that lie inside a row of `width` ≥ 1 pixels.
pub const fn last_word_bits(width: u16) -> u32 {
    u32::MAX >> ((32 - width % 32) % 32)
}

/// Thresholds a row of at most [`MAX_WIDTH`] pixels into `mask`; words beyond the row are left as they are.
pub(crate) fn threshold_row(table: &ThresholdTable, row: &[u16], mask: &mut MaskRow) {
    let (full, rest) = row.as_chunks::<32>();
    for (word, pixels) in mask.iter_mut().zip(full) {
        *word = table.mask(pixels);
    }
    if let Some(word) = mask.get_mut(full.len()).filter(|_| !rest.is_empty()) {
        *word = (0..).zip(rest).fold(0, |bits, (i, &raw)| {
            bits | u32::from(table.accepts(raw)) << i
        });
    }
}

/// Number of set bits.
pub(crate) fn count(words: &[u32]) -> u32 {
    words
        .iter()
        .filter(|word| **word != 0)
        .map(|word| word.count_ones())
        .sum()
}
