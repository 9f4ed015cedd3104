//! The two frame buffers: where they lie, and who owns them when.
//!
//! A buffer is always in exactly one place: free, being captured into, waiting to be processed, or being
//! processed. The `&'static mut` moves from one to the next, so the DMA never writes to what someone reads.

use crate::camera::{HEIGHT, WIDTH};
use crate::vsync::Edge;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;

/// Pixels of a frame.
pub const PIXELS: usize = WIDTH as usize * HEIGHT as usize;
/// One buffer fills while the other is processed.
pub const BUFFERS: usize = 2;

/// One frame as DCMI leaves it: rows top to bottom, each pixel's two bytes in the order the camera sent them.
#[repr(C, align(32))]
pub struct Frame {
    pixels: [u16; PIXELS],
}

impl Frame {
    /// The rows, top first, [`WIDTH`] pixels each.
    pub fn rows(&self) -> impl Iterator<Item = &[u16]> {
        self.pixels.chunks_exact(usize::from(WIDTH))
    }

    /// Where the DMA writes to: [`PIXELS`] / 2 words.
    pub fn words(&mut self) -> *mut u32 {
        self.pixels.as_mut_ptr().cast()
    }
}

/// A whole frame on its way to the pipeline.
pub struct Captured {
    /// The pixels. Goes back to [`FREE`].
    pub frame: &'static mut Frame,
    /// Number and time of the VSYNC edge that began it.
    pub edge: Edge,
    /// The camera interface overran since the frame before.
    pub after_overrun: bool,
    /// The camera was started again since the frame before.
    pub after_restart: bool,
}

/// Buffers that wait to be captured into.
pub static FREE: Channel<CriticalSectionRawMutex, &'static mut Frame, BUFFERS> = Channel::new();
/// Frames that wait to be processed, oldest first.
pub static CAPTURED: Channel<CriticalSectionRawMutex, Captured, BUFFERS> = Channel::new();

#[unsafe(link_section = ".axisram.frames")]
static mut MEMORY: MaybeUninit<[Frame; BUFFERS]> = MaybeUninit::uninit();

/// Clears both buffers and puts them into [`FREE`]. Does nothing when called again.
pub fn provide_buffers() {
    static DONE: AtomicBool = AtomicBool::new(false);
    if DONE.swap(true, Ordering::AcqRel) {
        return;
    }
    let memory = &raw mut MEMORY;
    // SAFETY: only the first call comes here, so this is the only reference ever made. Zero is a valid frame, and
    // writing every word once also gives the memory's error correction codes a defined start.
    let frames = unsafe {
        memory.write_bytes(0, 1);
        (*memory).assume_init_mut()
    };
    for frame in frames {
        // There is room: the channel holds as many as there are.
        let _ = FREE.try_send(frame);
    }
}
