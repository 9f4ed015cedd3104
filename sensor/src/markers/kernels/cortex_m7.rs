//! Implements kernels for Cortex-M4 and M7 in assembly, scheduled for the M7's two issues a cycle.
//!
//! All of them lie in sections `.itcm.*`, which a linker script can put into the memory nearest to
//! the core. Cycles are those of LLVM's model of the core (`llvm-mca -mtriple=thumbv7em-none-eabihf
//! -mcpu=cortex-m7`, the block between a label and the branch back to it), with rows and tables in
//! memory without wait states.
//!
//! All kernels use the stack only to save registers, and follow the procedure call standard. Only
//! `hivtac_dilate_edges` has paths that depend on data. They overwrite r0–r3, r12 and the flags,
//! and may set the Q flag.

#[cfg(target_abi = "eabihf")]
use core::arch::asm;
use core::arch::global_asm;
use core::ops::Range;

use crate::markers::mask::{MAX_WIDTH, Near};

global_asm!(include_str!("any_set.s"), options(raw));
global_asm!(include_str!("dilate_edges.s"), options(raw));
global_asm!(include_str!("threshold_bytes.s"), options(raw));
global_asm!(include_str!("threshold_cr.s"), options(raw));
global_asm!(include_str!("threshold_dark.s"), options(raw));
global_asm!(include_str!("threshold_luma.s"), options(raw));
global_asm!(include_str!("weigh_bytes.s"), options(raw));
global_asm!(include_str!("weigh_luma.s"), options(raw));

unsafe extern "C" {
    /// Returns all words, or-ed. Equals [`any_set`](crate::markers::mask::any_set) if the result is
    /// compared with 0.
    ///
    /// *Contract.* `count`: a positive multiple of sixteen, of words.
    ///
    /// *Schedule.* Sixteen words: 35 instructions in 18 cycles.
    fn hivtac_dilate_any_set(words: *const u32, count: usize) -> u32;

    /// Equals `Dilation::edges` for one dilation: returns the edges of a dilated row, without one
    /// at the row's end.
    ///
    /// A word that is empty, like its neighbours, costs one test. In other words CLZ finds, in
    /// mirrored order from the left, the bits that differ from the previous bit.
    ///
    /// *Contract.* `rows`: `words` ≥ 1 words, the same of the row `stride` bytes behind, and of the
    /// one behind that; the words before and after them in these rows are empty. `column`: that of
    /// the first word. Writes at most 32 edges for each word, and returns where the next would go.
    /// `last`: the bits of the last word that are in the row.
    ///
    /// *Schedule.* 12 cycles for an empty word, about 20 for another, and 5 for each edge.
    fn hivtac_dilate_edges(
        rows: *const u32,
        stride: usize,
        words: usize,
        column: u32,
        edges: *mut u16,
        last: u32,
    ) -> *mut u16;

    /// Equals `portable::threshold_bytes` for whole words of the mask. Returns all of them, or-ed.
    ///
    /// BFI puts bit 0 of a pixel's byte into its place in the word and ignores the other bits.
    ///
    /// *Contract.* `pixels`: 32 for each of `words` words of the mask, a positive multiple of two.
    /// `table`: 65,536 bytes. Writes the words from `mask` on.
    ///
    /// *Schedule.* 64 pixels: 202 instructions in 104 cycles; 96 is the floor of two loads and
    /// one operation for each.
    fn hivtac_threshold_bytes(
        pixels: *const u16,
        table: *const u8,
        mask: *mut u32,
        words: usize,
    ) -> u32;

    /// Equals `portable::threshold_cr` for whole words of the mask. Returns all of them, or-ed.
    /// USUB8 compares the Cr of four pairs with the lowest, and SEL chooses the bits of those that
    /// are not below it.
    ///
    /// *Contract.* `row`: 32 pixels for each word of the mask, and no other loads. `low` is the
    /// lowest Cr in all four bytes. Writes `mask` up to `end`, which lies a positive multiple of
    /// two words after it.
    ///
    /// *Schedule.* 64 pixels: 87 instructions in 45 cycles, 0.70 a pixel; a load, a comparison and
    /// an addition with carry for each pair would be 0.75.
    fn hivtac_threshold_cr(row: *const u16, low: u32, mask: *mut u32, end: *const u32) -> u32;

    /// Equals `portable::threshold_luma` for whole words of the mask. USUB8 subtracts the lowest
    /// luma modulo 256; a second USUB8 compares the rest with `span`.
    ///
    /// *No overflow.* The bits of four pixels are 1, 2, 4 and 8, and those of the next four 16
    /// times that: their sum is at most 255.
    ///
    /// *Contract.* `row`: 16 `u16`, 32 pixels, for each word of the mask. They are loaded as words,
    /// which need not lie at a multiple of four (a core must not trap on that: as after reset) but
    /// are slower elsewhere. `low` and `span` are in all four bytes. Writes `mask` up to `end`,
    /// which lies a positive number of words after it.
    ///
    /// *Schedule.* 32 pixels: 47 instructions in 36 cycles, 1.13 a pixel. 28 of them cannot be
    /// paired with another in a cycle.
    fn hivtac_threshold_luma(row: *const u16, low: u32, mask: *mut u32, end: *const u32, span: u32);

    /// Equals `portable::threshold_luma` for whole words of the mask, for lumas from 0 to a largest
    /// one below 255. `limit` is the number of these lumas, 0 included, in all four bytes.
    ///
    /// *No overflow.* UHSUB8 halves a difference of nine bits, so that its top bit is the sign. The
    /// products that are added have bits 0 and 4 of a byte in different places of the word.
    ///
    /// *Contract.* As [`hivtac_threshold_luma`].
    ///
    /// *Schedule.* 32 pixels: 43 instructions in 24 cycles, 0.75 a pixel.
    fn hivtac_threshold_dark(row: *const u16, limit: u32, mask: *mut u32, end: *const u32);

    /// Equals `portable::weigh_bytes`: returns Σw in the low word, and in the high one the sum of
    /// all partial sums, from right to left.
    ///
    /// *No overflow.* As stated at [`Weights`](crate::markers::tables::Weights): pixels are at most
    /// 800.
    ///
    /// *Contract.* Reads the `count` pixels before `end`. `table`: 65,536 bytes.
    ///
    /// *Schedule.* Four pixels: 19 instructions in 11 cycles.
    fn hivtac_weigh_bytes(end: *const u16, table: *const u8, count: usize) -> u64;

    /// Equals `portable::weigh_luma`: returns Σw in the low word, and in the high one the sum of
    /// all partial sums, from right to left.
    ///
    /// *No overflow.* As stated at [`Weights`](crate::markers::tables::Weights): pixels are at most
    /// 800.
    ///
    /// *Contract.* Reads the `count` bytes before `end`. `table`: 256 bytes.
    ///
    /// *Schedule.* Four pixels: 19 instructions in 11 cycles.
    fn hivtac_weigh_luma(end: *const u8, table: *const u8, count: usize) -> u64;
}

/// As [`portable::threshold_bytes`](super::portable::threshold_bytes). Returns whether any bit is
/// set; `None` unless the mask has an even number of words and the row 32 pixels for each.
#[inline(always)]
pub fn threshold_bytes(table: &[u8; 65_536], row: &[u16], mask: &mut [u32]) -> Option<bool> {
    let words = mask.len();
    if !is_of_pairs(row, words) {
        return None;
    }
    // SAFETY: the row has 32 pixels for each of the words, of which there are two at least.
    let all =
        unsafe { hivtac_threshold_bytes(row.as_ptr(), table.as_ptr(), mask.as_mut_ptr(), words) };
    Some(all != 0)
}

/// As [`portable::threshold_cr`](super::portable::threshold_cr). Returns whether any bit is set;
/// `None` unless the mask has an even number of words and the row 32 pixels for each.
#[inline(always)]
pub fn threshold_cr(low: u8, row: &[u16], mask: &mut [u32]) -> Option<bool> {
    if !is_of_pairs(row, mask.len()) {
        return None;
    }
    let range = mask.as_mut_ptr_range();
    // SAFETY: the row has 32 pixels for each of the words, of which there are two at least.
    let all =
        unsafe { hivtac_threshold_cr(row.as_ptr(), in_all_bytes(low), range.start, range.end) };
    Some(all != 0)
}

/// Whether a row has 32 pixels for each of `words` words, whose number is even and not 0.
#[inline(always)]
fn is_of_pairs(row: &[u16], words: usize) -> bool {
    words > 0 && words.is_multiple_of(2) && row.len() == 32 * words
}

/// Computes the first words of a mask with a kernel for pairs of words. Returns their number: all
/// pairs for which the row has 32 pixels for each word.
pub fn first_pairs(
    row: &[u16],
    mask: &mut [u32],
    kernel: impl FnOnce(&[u16], &mut [u32]) -> Option<bool>,
) -> usize {
    let words = whole_words(row, mask, 32).len() & !1;
    let part = row.get(..32 * words).zip(mask.get_mut(..words));
    match part.and_then(|(row, mask)| kernel(row, mask)) {
        Some(_) => words,
        None => 0,
    }
}

/// As [`portable::threshold_luma`](super::portable::threshold_luma) for the first words of the
/// mask. Returns their number: all whole words.
pub fn threshold_luma(low: u8, span: u8, row: &[u16], mask: &mut [u32]) -> usize {
    let whole = whole_words(row, mask, 16);
    let range = whole.as_mut_ptr_range();
    if whole.is_empty() {
        return 0;
    }
    let row = row.as_ptr();
    // SAFETY: the row has 32 pixels, two in a `u16`, for each of the words, of which there is one
    // at least.
    match (low, span.checked_add(1)) {
        (0, Some(limit)) => unsafe {
            hivtac_threshold_dark(row, in_all_bytes(limit), range.start, range.end);
        },
        _ => unsafe {
            let (low, span) = (in_all_bytes(low), in_all_bytes(span));
            hivtac_threshold_luma(row, low, range.start, range.end, span);
        },
    }
    whole.len()
}

/// Returns whether any word is not 0.
#[inline(always)]
pub fn any_set(words: &[u32]) -> bool {
    let (sixteens, rest) = words.as_chunks::<16>();
    let all = match sixteens.len() {
        0 => 0,
        // SAFETY: the slice has these words.
        sixteens => unsafe { hivtac_dilate_any_set(words.as_ptr(), 16 * sixteens) },
    };
    all != 0 || crate::markers::mask::any_set(rest)
}

/// As [`portable::weigh_bytes`](super::portable::weigh_bytes).
#[inline(always)]
pub fn weigh_bytes(table: &[u8; 65_536], run: &[u16]) -> [u32; 2] {
    let end = run.as_ptr_range().end;
    // SAFETY: the run's pixels lie before its end.
    let sums = unsafe { hivtac_weigh_bytes(end, table.as_ptr(), run.len()) };
    [sums as u32, (sums >> 32) as u32]
}

/// As [`portable::weigh_luma`](super::portable::weigh_luma).
#[inline(always)]
pub fn weigh_luma(table: &[u8; 256], row: &[u16], columns: Range<usize>) -> [u32; 2] {
    if columns.end > 2 * row.len() {
        return [0; 2];
    }
    // SAFETY: the row has these bytes, the left pixel of each two first, as memory is
    // little-endian.
    let sums = unsafe {
        let end = row.as_ptr().cast::<u8>().add(columns.end);
        hivtac_weigh_luma(end, table.as_ptr(), columns.len())
    };
    [sums as u32, (sums >> 32) as u32]
}

fn in_all_bytes(byte: u8) -> u32 {
    u32::from_le_bytes([byte; 4])
}

/// The words of the mask whose 32 pixels, `each` `u16`s, are all in the row.
fn whole_words<'m>(row: &[u16], mask: &'m mut [u32], each: usize) -> &'m mut [u32] {
    let count = (row.len() / each).min(mask.len());
    mask.split_at_mut(count).0
}

/// Writes the edges of the words `near` of a dilated row, and returns their number. `rows` begins
/// with these words of the first of three rows that lie `row_words` apart. Returns 0 if `rows` is
/// too short, or there is no room.
#[inline(always)]
pub fn dilate_edges(
    rows: &[u32],
    row_words: usize,
    near: &Near,
    edges: &mut [u16; MAX_WIDTH as usize],
) -> usize {
    let &Near { first, words, last } = near;
    let fits = rows.len() >= 2 * row_words + words && 32 * words <= edges.len();
    if words == 0 || !fits {
        return 0;
    }
    let begin = edges.as_mut_ptr();
    // SAFETY: the words of all three rows are in `rows`, and there is room for 32 edges for each.
    let end = unsafe {
        let (rows, stride, column) = (rows.as_ptr(), 4 * row_words, 32 * first as u32);
        hivtac_dilate_edges(rows, stride, words, column, begin, last)
    };
    (end as usize - begin as usize) / 2
}

/// As `libm::sqrtf`, which here computes it bit by bit. The compiler does not assign registers of
/// the floating-point unit to assembly, so the number is moved there and back.
#[cfg(target_abi = "eabihf")]
#[inline(always)]
pub fn sqrt(square: f32) -> f32 {
    let mut bits = square.to_bits();
    // SAFETY: it changes nothing but its result and a register that it says.
    unsafe {
        asm!(
            "vmov s0, {bits}",
            "vsqrt.f32 s0, s0",
            "vmov {bits}, s0",
            bits = inout(reg) bits,
            out("s0") _,
            options(pure, nomem, nostack, preserves_flags),
        );
    }
    f32::from_bits(bits)
}
