//! Runs the hottest loops in the fastest way that this processor offers.
//!
//! Each function is either the definition of the same name in `portable`, or a kernel that gives
//! the same bits. Kernels exist for Cortex-M4 and M7 (targets `thumbv7em-*`), in `cortex_m7`, the
//! only file of `markers` that holds `unsafe`.

#[cfg(armv7em)]
#[allow(unsafe_code)]
mod cortex_m7;
#[cfg(armv7em)]
pub use cortex_m7::{any_set, dilate_edges, weigh_bytes, weigh_luma};
mod portable;
#[cfg(not(armv7em))]
pub use {
    crate::markers::mask::any_set,
    portable::{weigh_bytes, weigh_luma},
};

/// A square root, rounded to nearest.
#[inline(always)]
pub fn sqrt(square: f32) -> f32 {
    #[cfg(all(armv7em, target_abi = "eabihf"))]
    return cortex_m7::sqrt(square);
    #[cfg(not(all(armv7em, target_abi = "eabihf")))]
    libm::sqrtf(square)
}

/// Computes the mask of a row of pixels through a table of bytes, and returns whether any bit is
/// set. Defined by `portable::threshold_bytes`.
#[inline]
pub fn threshold_bytes(table: &[u8; 65_536], row: &[u16], mask: &mut [u32]) -> bool {
    #[cfg(armv7em)]
    if let Some(any) = cortex_m7::threshold_bytes(table, row, mask) {
        return any;
    }
    threshold_bytes_in_parts(table, row, mask)
}

#[inline(never)]
fn threshold_bytes_in_parts(table: &[u8; 65_536], row: &[u16], mask: &mut [u32]) -> bool {
    #[cfg(armv7em)]
    let done = cortex_m7::first_pairs(row, mask, |row, mask| {
        cortex_m7::threshold_bytes(table, row, mask)
    });
    #[cfg(not(armv7em))]
    let done = 0;
    portable::threshold_bytes(table, row, mask, done);
    any_set(mask)
}

/// Computes the mask of a row of YUV422 by its Cr, and returns whether any bit is set. Defined by
/// `portable::threshold_cr`.
#[inline]
pub fn threshold_cr(low: u8, row: &[u16], mask: &mut [u32]) -> bool {
    #[cfg(armv7em)]
    if let Some(any) = cortex_m7::threshold_cr(low, row, mask) {
        return any;
    }
    threshold_cr_in_parts(low, row, mask)
}

#[inline(never)]
fn threshold_cr_in_parts(low: u8, row: &[u16], mask: &mut [u32]) -> bool {
    #[cfg(armv7em)]
    let done = cortex_m7::first_pairs(row, mask, |row, mask| {
        cortex_m7::threshold_cr(low, row, mask)
    });
    #[cfg(not(armv7em))]
    let done = 0;
    portable::threshold_cr(low, row, mask, done);
    any_set(mask)
}

/// Computes the mask of a row of mono pixels, and returns whether any bit is set. Defined by
/// `portable::threshold_luma`.
pub fn threshold_luma(low: u8, span: u8, row: &[u16], mask: &mut [u32]) -> bool {
    #[cfg(armv7em)]
    let done = cortex_m7::threshold_luma(low, span, row, mask);
    #[cfg(not(armv7em))]
    let done = 0;
    if done < mask.len() {
        portable::threshold_luma(low, span, row, mask, done);
    }
    any_set(mask)
}
