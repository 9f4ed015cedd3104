//! Runs the hottest loops in the fastest way that this processor offers.
//!
//! Each function is either the definition of the same name in `portable`, or a kernel that gives
//! the same bits. Kernels exist for Cortex-M4 and M7 (targets `thumbv7em-*`), in `cortex_m7`, the
//! only file of `force` that holds `unsafe`.

#[cfg(armv7em)]
#[allow(unsafe_code)]
mod cortex_m7;
mod portable;

pub use crate::markers::sqrt;

use crate::force::layer::{Layer, MAX_WIDTH};
use hivtac_terms::fixed::Q;

/// Number of inputs beyond the widest layer's that a kernel may read: it loads ahead.
const LOADED_AHEAD: usize = 4;

/// The inputs of a layer. Values beyond the layer's width are multiplied by zero weights, so they
/// may be anything.
#[derive(Clone, Debug)]
#[repr(C, align(4))]
pub struct Inputs([i16; MAX_WIDTH + LOADED_AHEAD]);

/// The sums of a layer's rows, before bias and rescaling. The last group of four rows is written in
/// full.
pub type Sums = [i32; MAX_WIDTH];

impl Inputs {
    /// All zero.
    pub const fn new() -> Inputs {
        Inputs([0; MAX_WIDTH + LOADED_AHEAD])
    }

    /// The inputs, to be written.
    pub fn values_mut(&mut self) -> &mut [i16; MAX_WIDTH] {
        let [values @ .., _, _, _, _] = &mut self.0;
        values
    }
}

/// Σ w_ji·x_i of every row j of a layer. Afterwards the inputs are undefined.
pub fn multiply(layer: &Layer<'_>, inputs: &mut Inputs, sums: &mut Sums) {
    #[cfg(armv7em)]
    if cortex_m7::multiply(layer, inputs, sums) {
        return;
    }
    portable::multiply(layer, inputs.values_mut(), sums);
}

/// clamp(rescale(acc_j, m_j, s_j), 0, A) of every row j of a hidden layer, as inputs of the next
/// layer.
pub fn activate(layer: &Layer<'_>, sums: &Sums, inputs: &mut Inputs) {
    #[cfg(armv7em)]
    let done = cortex_m7::activate(layer, sums, inputs);
    #[cfg(not(armv7em))]
    let done = 0;
    portable::activate(layer, sums, inputs.values_mut(), done);
}

/// Weights of coefficients at four by four nodes, for the value and for the slope along each axis.
/// The absolute values of each set add up to at most one and four roundings.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(4))]
pub struct Parts {
    /// Along y, for each line: weight of the value and of the slope.
    pub y: [[Q<15, i16>; 2]; 4],
    /// Along x: weights of the value, weights of the slope.
    pub x: [[Q<15, i16>; 4]; 2],
}

/// Factors of a term's coefficient in an output, and in its slopes by size and by tilt along x and
/// y.
pub type Factors = [f32; 4];

/// Returns an output at a place, and its slopes by size, by tilt along x and y, and along x and y.
/// Defined by `portable::spline`.
pub fn spline(
    steps: &[u8],
    line: usize,
    node: usize,
    parts: &Parts,
    factors: &[Factors],
) -> [f32; 6] {
    #[cfg(all(armv7em, target_abi = "eabihf"))]
    if let Some(sums) = cortex_m7::spline(steps, line, node, parts, factors) {
        return sums;
    }
    portable::spline(steps, line, node, parts, factors)
}

/// An i16, little-endian.
pub type Number = [u8; 2];

/// The distance at which [`products`] takes vectors: 192 numbers, and room for two f32.
pub const APART: usize = 196;

/// The sums of the products of one vector's numbers with those of four others. Defined by
/// `portable::products`.
#[inline(always)]
pub fn products(one: &[Number], four: &[Number]) -> [i64; 4] {
    #[cfg(armv7em)]
    if let Some(sums) = cortex_m7::products(one, four) {
        return sums;
    }
    portable::products(one, four)
}
