//! DMA1 stream 0: DCMI's data register into a frame buffer, word by word.
//!
//! # Design
//! One transfer is one frame. Direct mode (no DMA FIFO), so that the count of missing words is exact at any moment
//! and nothing has to be flushed. No DMA interrupt: DCMI says when the frame has ended.
//!
//! # Note
//! The buffers lie in AXI SRAM: this DMA reaches neither DTCM nor ITCM.
//!
//! # Limitations
//! The stream counts to 65,535 words, so a frame has at most 262,140 bytes.

use crate::frame::{Frame, PIXELS};
use crate::seeded_bugs;
use core::sync::atomic::{Ordering, compiler_fence};
use embassy_stm32::pac::dma::{regs, vals};
use embassy_stm32::pac::{DMA1, DMAMUX1};
use embassy_stm32::{Peri, peripherals};

const STREAM: usize = 0;
/// Words of a frame: DCMI packs four bytes into each.
const WORDS: u16 = {
    let words = PIXELS / 2 / seeded_bugs::FRAME_DIVISOR;
    assert!(words <= u16::MAX as usize, "a frame is one DMA transfer");
    words as u16
};

/// The stream, at rest.
pub struct FrameDma {
    /// Holding it says that nobody else uses the stream.
    _stream: Peri<'static, peripherals::DMA1_CH0>,
}

impl FrameDma {
    /// Takes the stream.
    pub fn new(stream: Peri<'static, peripherals::DMA1_CH0>) -> Self {
        Self { _stream: stream }
    }

    /// Starts a transfer of one frame from the data register at `source` into `frame`.
    pub fn start<'a>(&'a mut self, source: *mut u32, frame: &'a mut Frame) -> Running<'a> {
        halt();
        clear_flags();
        DMAMUX1
            .ccr(STREAM)
            .write(|w| w.set_dmareq_id(seeded_bugs::DCMI_DMA_REQUEST));
        let stream = DMA1.st(STREAM);
        stream.par().write_value(source as u32);
        stream.m0ar().write_value(frame.words() as u32);
        stream.ndtr().write(|w| w.set_ndt(WORDS));
        stream.fcr().write_value(regs::Fcr(0));
        // What the core wrote to the buffer must not arrive after the DMA's words.
        cortex_m::asm::dmb();
        stream.cr().write(|w| {
            w.set_dir(vals::Dir::PERIPHERAL_TO_MEMORY);
            w.set_psize(vals::Size::BITS32);
            w.set_msize(vals::Size::BITS32);
            w.set_minc(true);
            w.set_pl(vals::Pl::VERY_HIGH);
            w.set_en(true);
        });
        Running {
            _dma: self,
            _frame: frame,
        }
    }
}

/// A running transfer. It borrows its buffer; dropping it stops the stream first.
pub struct Running<'a> {
    _dma: &'a mut FrameDma,
    _frame: &'a mut Frame,
}

impl Running<'_> {
    /// Words that have not come yet.
    pub fn missing(&self) -> u16 {
        DMA1.st(STREAM).ndtr().read().ndt()
    }
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        halt();
        // No read of the buffer may move up before this point.
        cortex_m::asm::dmb();
        compiler_fence(Ordering::SeqCst);
    }
}

/// Stops the stream; returns when its last write is done. That takes some bus cycles; if it should ever take
/// longer, the watchdog ends it.
fn halt() {
    let control = DMA1.st(STREAM).cr();
    control.modify(|w| w.set_en(false));
    while control.read().en() {}
}

fn clear_flags() {
    DMA1.ifcr(STREAM / 4).write(|w| {
        w.set_feif(STREAM % 4, true);
        w.set_dmeif(STREAM % 4, true);
        w.set_teif(STREAM % 4, true);
        w.set_htif(STREAM % 4, true);
        w.set_tcif(STREAM % 4, true);
    });
}
