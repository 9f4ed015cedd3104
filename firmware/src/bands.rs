//! Defines the ring of bands in AXI SRAM that the camera's DMA fills.
//!
//! The DMA writes it and the MDMA reads it; the core touches it once, at boot.

use crate::block_move::BUFFER_BYTES;
use crate::camera::{HEIGHT, USUAL_FORMAT, WIDTH};
use core::mem::MaybeUninit;
use hivtac_portable::capture::Shape;

/// Rows of a band: as many as the sensing takes at a time, because each call costs some hundred
/// cycles.
pub const ROWS: u16 = 8;
/// Number of bands in the ring: at 320 × 240 slightly more than a frame.
pub const SLOTS: u16 = 32;
/// How frames, bands and slots relate.
pub const SHAPE: Shape = Shape::new(HEIGHT / ROWS, SLOTS);
/// `u16`s of a band, in any pixel format: the size of a slot. All formats of a camera have rows of
/// the same length.
pub const BAND_LENGTH: usize = USUAL_FORMAT.pixels().row_length(WIDTH) * ROWS as usize;
/// Bytes of a band.
pub const BAND_BYTES: usize = BAND_LENGTH * size_of::<u16>();

const _: () = {
    assert!(HEIGHT.is_multiple_of(ROWS));
    assert!(BAND_BYTES.is_multiple_of(BUFFER_BYTES as usize));
};

#[repr(C, align(128))]
struct Ring(MaybeUninit<[[u16; BAND_LENGTH]; SLOTS as usize]>);

#[unsafe(link_section = ".axisram.bands")]
static mut RING: Ring = Ring(MaybeUninit::uninit());

/// Address of a slot.
pub fn address(slot: u16) -> u32 {
    let base = &raw const RING as u32;
    base + u32::from(slot % SLOTS) * BAND_BYTES as u32
}

/// Writes every word once, so that the memory's error correction codes are defined. Call before the
/// DMA runs.
pub fn clear() {
    // SAFETY: no reference to the ring is ever made, and nothing else writes to it yet.
    unsafe { (&raw mut RING).write_bytes(0, 1) };
}
