//! Defines every kernel, in portable Rust.

#[cfg(not(armv7em))]
use core::ops::Range;

/// Computes the mask of a row: bit i of word w is bit 0 of the byte that `table` has for pixel 32·w
/// + i. `mask` has ⌈pixels / 32⌉ words; bits beyond the row are cleared. Starts with word `first`.
pub fn threshold_bytes(table: &[u8; 65_536], row: &[u16], mask: &mut [u32], first: usize) {
    // Each bit is shifted in from the top; a shorter last word is moved down.
    let shift_in = |bits: u32, raw: &u16| bits >> 1 | u32::from(table[usize::from(*raw)]) << 31;
    let (full, rest) = row.as_chunks::<32>();
    for (word, pixels) in mask.iter_mut().zip(full).skip(first) {
        *word = pixels.iter().fold(0, shift_in);
    }
    if let Some(last) = mask.get_mut(full.len()).filter(|_| !rest.is_empty()) {
        *last = rest.iter().fold(0, shift_in) >> (32 - rest.len());
    }
}

/// Bits 1–7 of a pixel's byte in `table` are its weight. Returns the sum of the weights of a run,
/// and the sum of all partial sums from right to left. The latter counts each weight once for its
/// own column, and once for each column of the run to the left.
#[cfg(not(armv7em))]
pub fn weigh_bytes(table: &[u8; 65_536], run: &[u16]) -> [u32; 2] {
    let weights = run.iter().rev().map(|raw| table[usize::from(*raw)] >> 1);
    weights.fold([0, 0], |[sum, sums], weight| {
        let sum = sum + u32::from(weight);
        [sum, sums + sum]
    })
}

/// As [`weigh_bytes`], with the weights that `table` has for mono pixels, two in a `u16`. The run
/// is `columns`; both sums are 0 if it is not wholly in the row.
#[cfg(not(armv7em))]
pub fn weigh_luma(table: &[u8; 256], row: &[u16], columns: Range<usize>) -> [u32; 2] {
    if columns.end > 2 * row.len() {
        return [0; 2];
    }
    let luma = |column: usize| row[column / 2].to_le_bytes()[column % 2];
    let weights = columns.rev().map(|column| table[usize::from(luma(column))]);
    weights.fold([0, 0], |[sum, sums], weight| {
        let sum = sum + u32::from(weight);
        [sum, sums + sum]
    })
}

/// Computes the mask of a row of YUV422 (Y0 Cb Y1 Cr): bits 2·i and 2·i + 1 of a word are set if Cr
/// of its pair i is at least `low`. `mask` has ⌈pixels / 32⌉ words; bits beyond the row, and of a
/// pixel without its pair, are cleared. Starts with word `first`.
pub fn threshold_cr(low: u8, row: &[u16], mask: &mut [u32], first: usize) {
    for (word, pixels) in mask.iter_mut().zip(row.chunks(32)).skip(first) {
        let pairs = (0..).zip(pixels.chunks_exact(2));
        *word = pairs.fold(0, |bits, (i, pair)| {
            let inside = (pair[1] >> 8) as u8 >= low;
            bits | (3 * u32::from(inside)) << (2 * i)
        });
    }
}

/// Computes the mask of a row of mono pixels, two in a `u16`: a bit is set if its pixel is within
/// `low` and `low + span`, modulo 256. `mask` has ⌈pixels / 32⌉ words; bits beyond the row are
/// cleared. Starts with word `first`.
pub fn threshold_luma(low: u8, span: u8, row: &[u16], mask: &mut [u32], first: usize) {
    for (word, pairs) in mask.iter_mut().zip(row.chunks(16)).skip(first) {
        *word = (0..).zip(pairs).fold(0, |bits, (i, pair)| {
            let inside = pair
                .to_le_bytes()
                .map(|luma| luma.wrapping_sub(low) <= span);
            let [left, right] = inside.map(u32::from);
            bits | (left | right << 1) << (2 * i)
        });
    }
}
