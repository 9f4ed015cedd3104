//! Kernels for Cortex-M4 and M7, in assembly, scheduled for the M7's two issues a cycle.
//!
//! All of them lie in sections `.itcm.*`, which a linker script can put into the memory nearest to
//! the core. The cycles said here are those of LLVM's model of the core
//! (`llvm-mca -mtriple=thumbv7em-none-eabihf -mcpu=cortex-m7`, the block between a label and the
//! branch back to it), with weights and inputs in memory without wait states.
//!
//! None of them touches the stack but for what it saves, only `hivtac_dilate_edges` has paths that
//! depend on data, and all follow the procedure call standard: r0–r3, r12 and the flags are lost,
//! the Q flag may be set.

use core::arch::global_asm;

use super::{Inputs, LOADED_AHEAD, Parts, Sums};
use crate::dilate::Near;
use crate::mask::MAX_WIDTH as MAX_ROW_WIDTH;
use crate::model::{Layer, MAX_ACTIVATION8, MAX_WEIGHT8, MAX_WIDTH, WeightWidth};

global_asm!(include_str!("activate.s"), options(raw));
global_asm!(include_str!("any_set.s"), options(raw));
global_asm!(include_str!("dilate_edges.s"), options(raw));
global_asm!(include_str!("dot8.s"), options(raw));
global_asm!(include_str!("dot16.s"), options(raw));
#[cfg(target_abi = "eabihf")]
global_asm!(include_str!("spline.s"), options(raw));
global_asm!(include_str!("threshold_bytes.s"), options(raw));
global_asm!(include_str!("threshold_cr.s"), options(raw));
global_asm!(include_str!("threshold_luma.s"), options(raw));
global_asm!(include_str!("weigh_bytes.s"), options(raw));

unsafe extern "C" {
    /// Equals `portable::multiply` for a layer of int8 weights, given inputs that [`hivtac_expand`]
    /// has prepared.
    ///
    /// *Composite lanes.* A word of weights holds two columns in each signed 16-bit half: 256·w₁ +
    /// w₀. With the inputs as a₁ and x = 256·a₀ − a₁, and SXTB16 giving w₀ of both halves,
    /// `SMLAD(word, a₁) + SMLAD(SXTB16(word), x)` = Σ (256·w₁ + w₀)·a₁ + w₀·(256·a₀ − a₁) = 256·Σ
    /// (w₀·a₀ + w₁·a₁): four products in two multiplications and one extension, at the price of a
    /// shift by 8 at the end of a row.
    ///
    /// *No overflow.* Sums are modulo 2³², so only the last one of a row has to fit: |256·Σ w·a| <
    /// 2³¹ holds because |Σ w·a| ≤ 512 · 127 · 127 = 8,258,048 < 2²³ for every layer that a model
    /// may have; see the assertion below. Lanes fit 16 bits: |256·w₁ + w₀| ≤ 32,639, and −127 ≤ x ≤
    /// 32,512.
    ///
    /// *Contract.* `weights`: word-aligned, 32·`blocks` columns for each group of four rows, as
    /// `docs/model-file.md` lays them out, and eight readable bytes after them. `inputs`:
    /// word-aligned, 32·`blocks` and four more readable. `blocks` ≥ 1. Writes `sums` up to `end`,
    /// which lies a positive multiple of four sums after it.
    ///
    /// *Schedule.* A block of 32 columns and four rows, 128 products: 148 instructions in
    /// 74 cycles, 0.578 a product. A group of four rows adds about 12 cycles.
    fn hivtac_dot8(
        weights: *const u32,
        inputs: *const i16,
        blocks: usize,
        sums: *mut i32,
        end: *const i32,
    );

    /// Prepares inputs of 0 to 127 for [`hivtac_dot8`], in place: of each four a₀ a₁ a₂ a₃ it makes
    /// 256·a₀ − a₁, 256·a₂ − a₃, a₁, a₃. Pairs beyond a layer's width may be anything: their
    /// weights are zero. But a layer of odd width has half a pair there, which must be of 0 to 127
    /// as well, or x leaves its 16 bits.
    ///
    /// *Contract.* `inputs`: word-aligned, 8·`eights` of them. `eights` ≥ 1.
    fn hivtac_expand(inputs: *mut i16, eights: usize);

    /// Equals `portable::multiply` for a layer of int16 weights.
    ///
    /// *No overflow.* Every row is proven when the model is loaded: Σ|w|·X + |bias| ≤ 2³¹ − 1, with
    /// X the largest input, so that no partial sum in any order leaves 32 bits.
    ///
    /// *Contract.* As [`hivtac_dot8`], with 16·`blocks` columns, and 16 readable bytes after the
    /// weights.
    ///
    /// *Schedule.* A block of 16 columns and four rows, 64 products: 76 instructions in 38 cycles,
    /// 0.594 a product. A group of four rows adds about 11 cycles.
    fn hivtac_dot16(
        weights: *const u32,
        inputs: *const i16,
        blocks: usize,
        sums: *mut i32,
        end: *const i32,
    );

    /// As [`hivtac_dot16`] for up to 12 columns (the features are 11), laid out as 16, the last
    /// four of which it leaves out.
    ///
    /// *Contract.* As [`hivtac_dot16`]; it reads no more than the weights and 12 inputs.
    ///
    /// *Schedule.* A group of four rows, 48 products: 56 instructions in 31 cycles.
    fn hivtac_dot16_narrow(
        weights: *const u32,
        inputs: *const i16,
        sums: *mut i32,
        end: *const i32,
    );

    /// Equals `portable::activate` for rows whose shifts are all 33 to 62: then the high word of
    /// the product is enough (see `rescale.rs`). SMMUL gives it, USAT limits to 0…32,767 while it
    /// shifts by the last place, and a comparison of halves limits to the largest activation, which
    /// is no larger.
    ///
    /// *No overflow.* sum + bias fits 32 bits (proven when the model is loaded); the high word lies
    /// within ±2³⁰.
    ///
    /// *Contract.* All pointers word-aligned. Reads biases, multipliers, shifts and sums, and
    /// writes `activations` up to `end`, which lies a positive multiple of four activations after
    /// it. `largest` is the largest activation in both halves.
    ///
    /// *Schedule.* Four rows: 53 instructions in 33 cycles.
    fn hivtac_activate(
        biases: *const u8,
        multipliers: *const u8,
        shifts: *const u8,
        sums: *const i32,
        activations: *mut i16,
        end: *const i16,
        largest: u32,
    );

    /// Equals `portable::spline`. A pair of products is one SMUAD or SMLAD, a sum along y one
    /// SMLAWB or SMLAWT.
    ///
    /// *No overflow.* See there: whatever the coefficients are.
    ///
    /// *Contract.* `sums`, up to `end`, which lies a positive number of terms after it; `line`:
    /// bytes to the next line; `back`: bytes from a term's last line to the next term's first one,
    /// modulo 2³². `steps`: eight bytes in each line of each term are readable, and so are those of
    /// one term more in the first line; they may lie at any address.
    ///
    /// *Schedule.* A term, 32 products along x and 12 along y: 53 instructions in 36 cycles.
    #[cfg(target_abi = "eabihf")]
    fn hivtac_spline(
        sums: *mut [i32; 3],
        line: usize,
        back: usize,
        parts: *const Parts,
        end: *const [i32; 3],
        steps: *const u8,
    );

    /// Equals [`any_set`](crate::mask::any_set), when what it gives is compared with 0: all words,
    /// or-ed.
    ///
    /// *Contract.* `count`: a positive multiple of sixteen, of words.
    ///
    /// *Schedule.* Sixteen words: 35 instructions in 18 cycles.
    fn hivtac_dilate_any_set(words: *const u32, count: usize) -> u32;

    /// Equals `Dilation::edges` for one dilation: the edges of a dilated row, but for one at its
    /// end.
    ///
    /// Words that are empty, as are their neighbours, cost one test. In others the bits that differ
    /// from the one before are found from the left by CLZ, mirrored.
    ///
    /// *Contract.* `rows`: `words` ≥ 1 words, the same of the row `stride` bytes behind, and of the
    /// one behind that; the words beside them in these rows are empty. `column`: that of the first
    /// word. Writes at most 32 edges for each word, and gives where the next would go. `last`: the
    /// bits of the last word that are in the row.
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

    /// Equals `portable::threshold_bytes` for whole words of the mask.
    ///
    /// BFI puts bit 0 of a pixel's byte into its place in the word, whatever the other bits are.
    ///
    /// *Contract.* `pixels`: 32 for each of `words` ≥ 1 words of the mask. `table`: 65,536 bytes.
    /// Writes the words from `mask` on.
    ///
    /// *Schedule.* 32 pixels: 103 instructions in 53 cycles, 1.66 a pixel; 1.5 is the floor of two
    /// loads and one operation.
    fn hivtac_threshold_bytes(pixels: *const u16, table: *const u8, mask: *mut u32, words: usize);

    /// Equals `portable::threshold_cr` for whole words of the mask. USUB8 compares the Cr of four
    /// pairs with the lowest, and SEL chooses the bits of those that are not below it.
    ///
    /// *Contract.* `row`: 32 pixels for each word of the mask; it loads nothing else. `low` is the
    /// lowest Cr in all four bytes. Writes `mask` up to `end`, which lies a positive number of
    /// words after it.
    ///
    /// *Schedule.* 32 pixels: 43 instructions in 23 cycles, 0.72 a pixel; a load, a comparison and
    /// an addition with carry for each pair would be 0.75.
    fn hivtac_threshold_cr(row: *const u16, low: u32, mask: *mut u32, end: *const u32);

    /// Equals `portable::threshold_luma` for whole words of the mask. USUB8 subtracts the lowest
    /// luma modulo 256, another one compares what is left with `span`.
    ///
    /// *No overflow.* The bits of four pixels are 1, 2, 4 and 8, and those of the next four 16
    /// times that: their sum is at most 255.
    ///
    /// *Contract.* `row`: 16 `u16`, 32 pixels, for each word of the mask; they are loaded as words,
    /// which need not lie at a multiple of four (a core must not trap on that: as after reset) but
    /// are slower elsewhere. `low` and `span` are in all four bytes. Writes `mask` up to `end`,
    /// which lies a positive number of words after it.
    ///
    /// *Schedule.* 32 pixels: 47 instructions in 36 cycles, 1.13 a pixel. 28 of them only go one a
    /// cycle.
    fn hivtac_threshold_luma(row: *const u16, low: u32, mask: *mut u32, end: *const u32, span: u32);

    /// Equals `portable::weigh_bytes`: gives Σw in the low word, and in the high one the sum of all
    /// sums so far, from right to left.
    ///
    /// *No overflow.* As said of [`Weights`](crate::tables::Weights): pixels are at most 800.
    ///
    /// *Contract.* Reads the `count` pixels before `end`. `table`: 65,536 bytes.
    ///
    /// *Schedule.* Four pixels: 19 instructions in 11 cycles.
    fn hivtac_weigh_bytes(end: *const u16, table: *const u8, count: usize) -> u64;
}

/// The proof of [`hivtac_dot8`] for the widest layer.
const _: () = assert!(MAX_WIDTH as i64 * MAX_WEIGHT8 as i64 * (MAX_ACTIVATION8 as i64) < 1 << 23);
/// Whole blocks and groups fit the arrays, with what is loaded ahead.
const _: () = assert!(MAX_WIDTH.is_multiple_of(32) && LOADED_AHEAD >= 4);

/// As [`portable::multiply`](super::portable::multiply), if the weights are aligned as words;
/// otherwise does nothing and gives false.
pub fn multiply(layer: &Layer<'_>, inputs: &mut Inputs, sums: &mut Sums) -> bool {
    let weights = layer.weights_and_more().as_ptr();
    if !weights.cast::<u32>().is_aligned() {
        return false;
    }
    let rows = layer.padded_outputs();
    let columns = layer.padded_inputs();
    // The other half of the last pair, when the width is odd.
    let (Some(sums), Some(half)) = (sums.get_mut(..rows), inputs.0.get_mut(layer.inputs())) else {
        return false;
    };
    *half = 0;
    let range = sums.as_mut_ptr_range();
    let inputs = inputs.0.as_mut_ptr();
    // SAFETY: weights, inputs and sums are aligned as words. A layer has at least one row and one
    // column, at most MAX_WIDTH of each, padded to whole groups and blocks; its bytes hold the
    // weights of all of them, and after them at least the 16 bytes that `weights_and_more`
    // promises; `Inputs` holds LOADED_AHEAD more than the widest layer.
    unsafe {
        match layer.weight_width() {
            WeightWidth::Int8 => {
                hivtac_expand(inputs, columns / 8);
                hivtac_dot8(weights.cast(), inputs, columns / 32, range.start, range.end);
            }
            WeightWidth::Int16 if layer.inputs() <= 12 => {
                hivtac_dot16_narrow(weights.cast(), inputs, range.start, range.end);
            }
            WeightWidth::Int16 => {
                hivtac_dot16(weights.cast(), inputs, columns / 16, range.start, range.end);
            }
        }
    }
    true
}

/// As [`portable::activate`](super::portable::activate) for the first rows, and says for how many:
/// whole groups of four if the layer's scaling is as the kernel needs it, otherwise none.
pub fn activate(layer: &Layer<'_>, sums: &Sums, inputs: &mut Inputs) -> usize {
    let rows = layer.outputs() & !3;
    let (biases, multipliers, shifts) = layer.scaling();
    if !layer.rescales_by_high_word() || !biases.as_ptr().cast::<u32>().is_aligned() {
        return 0;
    }
    let Some(activations) = inputs.0.get_mut(..rows).filter(|rows| !rows.is_empty()) else {
        return 0;
    };
    let range = activations.as_mut_ptr_range();
    // SAFETY: a layer has as many biases, multipliers and shifts as outputs, and not more than
    // there are sums; the first begin at a word, and so do the others, which come behind them in
    // words. `Inputs` begins at a word.
    unsafe {
        hivtac_activate(
            biases.as_ptr(),
            multipliers.as_ptr(),
            shifts.as_ptr(),
            sums.as_ptr(),
            range.start,
            range.end,
            u32::from(layer.largest_activation()) * 0x0001_0001,
        );
    }
    rows
}

/// As [`portable::threshold_bytes`](super::portable::threshold_bytes) for the first words of the
/// mask, and says for how many: all whole ones.
pub fn threshold_bytes(table: &[u8; 65_536], row: &[u16], mask: &mut [u32]) -> usize {
    let whole = whole_words(row, mask, 32);
    let (row, table, words) = (row.as_ptr(), table.as_ptr(), whole.len());
    if words > 0 {
        // SAFETY: the row has 32 pixels for each of the words, of which there is one at least.
        unsafe { hivtac_threshold_bytes(row, table, whole.as_mut_ptr(), words) };
    }
    words
}

/// As [`portable::threshold_cr`](super::portable::threshold_cr) for the first words of the mask,
/// and says for how many: all whole ones.
pub fn threshold_cr(low: u8, row: &[u16], mask: &mut [u32]) -> usize {
    let whole = whole_words(row, mask, 32);
    let range = whole.as_mut_ptr_range();
    if !whole.is_empty() {
        // SAFETY: the row has 32 pixels for each of the words, of which there is one at least.
        unsafe { hivtac_threshold_cr(row.as_ptr(), in_all_bytes(low), range.start, range.end) };
    }
    whole.len()
}

/// As [`portable::threshold_luma`](super::portable::threshold_luma) for the first words of the
/// mask, and says for how many: all whole ones.
pub fn threshold_luma(low: u8, span: u8, row: &[u16], mask: &mut [u32]) -> usize {
    let whole = whole_words(row, mask, 16);
    let range = whole.as_mut_ptr_range();
    let (low, span) = (in_all_bytes(low), in_all_bytes(span));
    if !whole.is_empty() {
        // SAFETY: the row has 32 pixels, two in a `u16`, for each of the words, of which there is
        // one at least.
        unsafe { hivtac_threshold_luma(row.as_ptr(), low, range.start, range.end, span) };
    }
    whole.len()
}

/// As [`portable::spline`](super::portable::spline), for coefficients that are all there; says
/// whether it did anything.
#[cfg(target_abi = "eabihf")]
pub fn spline(
    steps: &[u8],
    line: usize,
    node: usize,
    parts: &Parts,
    sums: &mut [[i32; 3]],
) -> bool {
    // What files may hold is far below 32 bits: `Table` has at most 88 terms and 16 nodes along
    // each axis.
    let last = sums
        .len()
        .checked_sub(1)
        .map(|last| last * node + 3 * line + 8);
    if last.is_none_or(|last| last > steps.len()) || line < sums.len() * node {
        return false;
    }
    let (back, end) = (node.wrapping_sub(3 * line), sums.as_mut_ptr_range().end);
    // SAFETY: there is a term, and the last one's last line ends within the coefficients; a term
    // more in the first line ends before, as a line holds all terms.
    unsafe { hivtac_spline(sums.as_mut_ptr(), line, back, parts, end, steps.as_ptr()) };
    true
}

/// Whether a word is not 0.
#[inline(always)]
pub fn any_set(words: &[u32]) -> bool {
    let (sixteens, rest) = words.as_chunks::<16>();
    let all = match sixteens.len() {
        0 => 0,
        // SAFETY: so many words are there.
        sixteens => unsafe { hivtac_dilate_any_set(words.as_ptr(), 16 * sixteens) },
    };
    all != 0 || crate::mask::any_set(rest)
}

/// As [`portable::weigh_bytes`](super::portable::weigh_bytes).
#[inline(always)]
pub fn weigh_bytes(table: &[u8; 65_536], run: &[u16]) -> [u32; 2] {
    let end = run.as_ptr_range().end;
    // SAFETY: the run's pixels lie before its end.
    let sums = unsafe { hivtac_weigh_bytes(end, table.as_ptr(), run.len()) };
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

/// The edges of a row of the mask, of `near` words of which `rows` begins with those of three rows
/// that lie `row_words` apart; their number. Zero when `rows` is too short for that, or there is no
/// room.
pub fn dilate_edges(
    rows: &[u32],
    row_words: usize,
    near: &Near,
    edges: &mut [u16; MAX_ROW_WIDTH as usize],
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
