//! Provides two places in SRAM for models that a host sends: one is in use while the other is
//! filled.
//!
//! # Design A model runs from SRAM, not from the flash that keeps it: a core that reads a flash
//! bank waits up to a second while that bank is erased. A slot is filled, then *lent*, as a file
//! that does not change until it is given back. The memory task gives it back if the model is
//! refused, the pipeline when a different model is in use.

use core::sync::atomic::{AtomicBool, Ordering};
use hivtac_wire::message::MODEL_BYTES;

/// Number of slots.
const COUNT: usize = 2;

/// Slots that must not be written. Set at boot and by the memory task; cleared by them and the
/// pipeline.
static LENT: [AtomicBool; COUNT] = [const { AtomicBool::new(false) }; _];

/// A file begins at a multiple of four, so that kernels can run it, and of a data cache line.
#[repr(C, align(32))]
struct File([u8; MODEL_BYTES]);

/// The slots, one in each of two memories: neither has room for both.
#[unsafe(link_section = ".sram_zero.model")]
static mut FIRST: File = File([0; MODEL_BYTES]);
#[unsafe(link_section = ".axisram_cached.model")]
static mut SECOND: File = File([0; MODEL_BYTES]);

/// Returns a slot that is not lent; `None` if both are.
pub fn free() -> Option<u8> {
    (0..)
        .zip(&LENT)
        .find_map(|(slot, lent)| (!lent.load(Ordering::Acquire)).then_some(slot))
}

/// Calls `fill` to write into a slot. Returns `None` if the slot is lent or does not exist. Only
/// for the USB executor, and for the start before that: of these one runs at a time, to its end.
pub fn fill<T>(slot: u8, fill: impl FnOnce(&mut [u8; MODEL_BYTES]) -> T) -> Option<T> {
    let lent = LENT.get(usize::from(slot))?;
    if lent.load(Ordering::Acquire) {
        return None;
    }
    // SAFETY: the slot exists. It is not lent, so there is no other reference to it: those of
    // `fill` end with it, and no two run at once.
    let file = unsafe { &mut *file(slot)? };
    Some(fill(file))
}

/// Lends a slot's first bytes, until it is given back. Returns `None` if the slot is lent or does
/// not exist.
pub fn lend(slot: u8, bytes: u32) -> Option<&'static [u8]> {
    let lent = LENT.get(usize::from(slot))?;
    if lent.swap(true, Ordering::AcqRel) {
        return None;
    }
    // SAFETY: the slot exists, and is not written while it is lent.
    let file = unsafe { &*file(slot)? };
    file.get(..bytes as usize)
}

/// Gives a slot back: its lent bytes must no longer be used.
pub fn give_back(slot: u8) {
    if let Some(lent) = LENT.get(usize::from(slot)) {
        lent.store(false, Ordering::Release);
    }
}

/// Returns the address of a slot; `None` if it does not exist.
fn file(slot: u8) -> Option<*mut [u8; MODEL_BYTES]> {
    let file = match slot {
        0 => &raw mut FIRST,
        1 => &raw mut SECOND,
        _ => return None,
    };
    Some(file.cast())
}
