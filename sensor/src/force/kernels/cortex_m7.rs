//! Implements kernels for Cortex-M4 and M7 in assembly, scheduled for the M7's two issues a cycle.
//!
//! All except that of two contacts lie in sections `.itcm.*`, which a linker script can put into
//! the memory nearest to the core. Cycles are those of LLVM's model of the core (`llvm-mca
//! -mtriple=thumbv7em-none-eabihf -mcpu=cortex-m7`, the block between a label and the branch back
//! to it), with weights and inputs in memory without wait states.
//!
//! All kernels use the stack only to save registers, have no paths that depend on data, and follow
//! the procedure call standard. They overwrite r0–r3, r12 and the flags, and may set the Q flag.

use core::arch::global_asm;

use super::{APART, Factors, Inputs, LOADED_AHEAD, Number, Parts, Sums};
use crate::force::layer::{Layer, MAX_WIDTH};
use crate::force::packing::{MAX_ACTIVATION8, MAX_WEIGHT8, WeightWidth};

global_asm!(include_str!("activate.s"), options(raw));
global_asm!(include_str!("dot8.s"), options(raw));
global_asm!(include_str!("dot16.s"), options(raw));
global_asm!(include_str!("products.s"), options(raw));
#[cfg(target_abi = "eabihf")]
global_asm!(include_str!("spline.s"), options(raw));

unsafe extern "C" {
    /// Equals `portable::multiply` for a layer of int8 weights, given inputs that [`hivtac_expand`]
    /// has prepared.
    ///
    /// *Composite lanes.* A word of weights holds two columns in each signed 16-bit half: 256·w₁ +
    /// w₀. The inputs are a₁ and x = 256·a₀ − a₁, and SXTB16 gives w₀ of both halves. Then
    /// `SMLAD(word, a₁) + SMLAD(SXTB16(word), x)` = Σ (256·w₁ + w₀)·a₁ + w₀·(256·a₀ − a₁) = 256·Σ
    /// (w₀·a₀ + w₁·a₁). That is four products in two multiplications and one extension, at the
    /// price of a shift by 8 at the end of a row.
    ///
    /// *No overflow.* Sums are modulo 2³², so only the last one of a row has to fit. |256·Σ w·a| <
    /// 2³¹ holds because |Σ w·a| ≤ 512 · 127 · 127 = 8,258,048 < 2²³ for every possible layer; see
    /// the assertion below. Lanes fit 16 bits: |256·w₁ + w₀| ≤ 32,639, and −127 ≤ x ≤ 32,512.
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

    /// As [`hivtac_dot16`] for up to 12 columns (the features are 11), laid out as 16, without the
    /// last four.
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

    /// Equals `portable::products`. It loads two numbers at once, at any address, and multiplies
    /// both in one SMLALD, which adds to 64 bits.
    ///
    /// *No overflow.* A product is at most 2³⁰, so 2³³ of them fit.
    ///
    /// *Contract.* `one`, up to `end`, which lies a positive multiple of eight numbers after it. As
    /// many numbers are readable at `four`, and [`APART`], twice and three times as far after it.
    /// Writes four `sums`.
    ///
    /// *Schedule.* A block of 8 numbers, 32 products: 40 instructions.
    fn hivtac_products(
        one: *const Number,
        four: *const Number,
        end: *const Number,
        sums: *mut [i64; 4],
    );

    /// Equals `portable::spline`. A pair of products is one SMUAD or SMLAD, a sum along y one
    /// SMLAWB or SMLAWT. While those of one term are computed, the previous term is multiplied with
    /// its factors.
    ///
    /// *No overflow.* As shown at `portable::spline`, for any coefficients.
    ///
    /// *Contract.* `factors`, up to `end`, which lies a positive number of terms after it; `line`:
    /// bytes to the next line; `back`: bytes from a term's last line to the next term's first one,
    /// modulo 2³². `steps`: eight bytes in each line of each term are readable, and so are those of
    /// one term more in the first line; they may lie at any address. Writes `sums`.
    ///
    /// *Schedule.* A term, 32 products along x, 12 along y and 6 with factors: 75 instructions in
    /// 42 cycles.
    #[cfg(target_abi = "eabihf")]
    fn hivtac_spline(
        steps: *const u8,
        line: usize,
        back: usize,
        parts: *const Parts,
        factors: *const Factors,
        end: *const Factors,
        sums: *mut [f32; 6],
    );
}

/// The proof of [`hivtac_dot8`] for the widest layer.
const _: () = assert!(MAX_WIDTH as i64 * MAX_WEIGHT8 as i64 * (MAX_ACTIVATION8 as i64) < 1 << 23);
/// Whole blocks and groups fit the arrays, including the bytes that are loaded ahead.
const _: () = assert!(MAX_WIDTH.is_multiple_of(32) && LOADED_AHEAD >= 4);

/// As [`portable::multiply`](super::portable::multiply), if the weights are word-aligned. Otherwise
/// returns false and does nothing.
pub fn multiply(layer: &Layer<'_>, inputs: &mut Inputs, sums: &mut Sums) -> bool {
    let weights = layer.weights_and_more().as_ptr();
    if !weights.cast::<u32>().is_aligned() {
        return false;
    }
    let rows = layer.padded_outputs();
    let columns = layer.padded_inputs();
    // The other half of the last pair, if the width is odd.
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

/// As [`portable::activate`](super::portable::activate) for the first rows. Returns their number:
/// all whole groups of four if the kernel supports the layer's scaling, otherwise 0.
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

/// The distance that `products.s` has, in bytes.
const _: () = assert!(2 * APART == 392);

/// As [`portable::products`](super::portable::products). Returns `None` unless `one` has whole
/// blocks of eight numbers, and each of the four as many.
pub fn products(one: &[Number], four: &[Number]) -> Option<[i64; 4]> {
    let is_whole = !one.is_empty() && one.len().is_multiple_of(8);
    if !is_whole || four.len() < 3 * APART + one.len() {
        return None;
    }
    let (range, mut sums) = (one.as_ptr_range(), [0; 4]);
    // SAFETY: the one has at least a block, all of its blocks are whole, and the last of the four
    // has as many numbers.
    unsafe { hivtac_products(range.start, four.as_ptr(), range.end, &raw mut sums) };
    Some(sums)
}

/// As [`portable::spline`](super::portable::spline). Returns `None` unless all coefficients are
/// inside `steps`.
#[cfg(target_abi = "eabihf")]
pub fn spline(
    steps: &[u8],
    line: usize,
    node: usize,
    parts: &Parts,
    factors: &[Factors],
) -> Option<[f32; 6]> {
    // What files may hold is far below 32 bits: `Table` has at most 24 terms and 20 nodes along
    // each axis.
    let last = factors.len().checked_sub(1)? * node + 3 * line + 8;
    if last > steps.len() || line < factors.len() * node {
        return None;
    }
    let (back, steps) = (node.wrapping_sub(3 * line), steps.as_ptr());
    let (range, mut sums) = (factors.as_ptr_range(), [0.0; 6]);
    // SAFETY: there is a term, and the last one's last line ends within the coefficients; a term
    // more in the first line ends before, as a line holds all terms.
    unsafe {
        hivtac_spline(
            steps,
            line,
            back,
            parts,
            range.start,
            range.end,
            &raw mut sums,
        )
    };
    Some(sums)
}
