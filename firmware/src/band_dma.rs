//! DMA1 stream 0: DCMI's data register into the ring of bands, without end.
//!
//! # Design
//! Double-buffer mode: while the stream fills one target, the handler of its interrupt sets the
//! other one to the slot after. Direct mode (no DMA FIFO), so that the count of missing words is
//! exact at any moment and nothing has to be flushed. One interrupt a band.
//!
//! # Note
//! The ring lies in AXI SRAM: this DMA reaches neither DTCM nor ITCM.

use crate::bands::{self, BAND_LENGTH};
use crate::seeded_bugs;
use embassy_stm32::pac::dma::{St, regs, vals};
use embassy_stm32::pac::{DMA1, DMAMUX1};
use embassy_stm32::{Peri, peripherals};

const STREAM: usize = 0;
/// Words of a band: DCMI packs four bytes into one.
const WORDS: u16 = (BAND_LENGTH / 2) as u16 / seeded_bugs::BAND_DIVISOR;

/// The stream.
pub struct BandDma {
    /// Holding it says that nobody else uses the stream.
    _stream: Peri<'static, peripherals::DMA1_CH0>,
}

impl BandDma {
    /// Takes the stream.
    pub fn new(stream: Peri<'static, peripherals::DMA1_CH0>) -> Self {
        Self { _stream: stream }
    }

    /// Starts anew: bands from the data register at `source` into slots `first`, `second`, and then
    /// where [`aim`](Self::aim) says.
    pub fn start(&mut self, source: *mut u32, first: u16, second: u16) {
        self.halt();
        DMAMUX1
            .ccr(STREAM)
            .write(|w| w.set_dmareq_id(seeded_bugs::DCMI_DMA_REQUEST));
        let stream = registers();
        stream.par().write_value(source as u32);
        stream.m0ar().write_value(bands::address(first));
        stream.m1ar().write_value(bands::address(second));
        stream.ndtr().write(|w| w.set_ndt(WORDS));
        stream.fcr().write_value(regs::Fcr(0));
        // What the core wrote to the ring at boot must not arrive after the DMA's words.
        cortex_m::asm::dmb();
        stream.cr().write(|w| {
            w.set_dir(vals::Dir::PERIPHERAL_TO_MEMORY);
            w.set_psize(vals::Size::BITS32);
            w.set_msize(vals::Size::BITS32);
            w.set_minc(true);
            w.set_pl(vals::Pl::VERY_HIGH);
            w.set_dbm(true);
            w.set_tcie(true);
            w.set_teie(true);
            w.set_en(true);
        });
    }

    /// Stops the stream and forgets its events; returns when its last write is done. That takes
    /// some bus cycles; if it should ever take longer, the watchdog ends it.
    pub fn halt(&mut self) {
        let control = registers().cr();
        control.modify(|w| w.set_en(false));
        while control.read().en() {}
        DMA1.ifcr(STREAM / 4).write(|w| {
            w.set_feif(STREAM % 4, true);
            w.set_dmeif(STREAM % 4, true);
            w.set_teif(STREAM % 4, true);
            w.set_htif(STREAM % 4, true);
            w.set_tcif(STREAM % 4, true);
        });
    }

    /// Makes `slot` the target after the one that is being filled.
    pub fn aim(&mut self, slot: u16) {
        let stream = registers();
        let address = bands::address(slot);
        match self.fills_second() {
            true => stream.m0ar().write_value(address),
            false => stream.m1ar().write_value(address),
        }
    }

    /// Whether the second target is being filled.
    pub fn fills_second(&self) -> bool {
        registers().cr().read().ct() == vals::Ct::MEMORY1
    }

    /// Whether a band was finished since this was asked last.
    pub fn take_finished(&mut self) -> bool {
        let finished = DMA1.isr(STREAM / 4).read().tcif(STREAM % 4);
        if finished {
            DMA1.ifcr(STREAM / 4)
                .write(|w| w.set_tcif(STREAM % 4, true));
        }
        finished
    }

    /// Whether the bus refused an access, which stopped the stream.
    pub fn failed(&self) -> bool {
        DMA1.isr(STREAM / 4).read().teif(STREAM % 4)
    }

    /// Whether a band was just finished, or none has begun.
    pub fn is_between_bands(&self) -> bool {
        let finished = DMA1.isr(STREAM / 4).read().tcif(STREAM % 4);
        finished || registers().ndtr().read().ndt() == WORDS
    }

    /// Whether words have come since the newest band that was [taken](Self::take_finished).
    pub fn has_begun_a_band(&self) -> bool {
        let finished = DMA1.isr(STREAM / 4).read().tcif(STREAM % 4);
        finished || registers().ndtr().read().ndt() != WORDS
    }
}

fn registers() -> St {
    DMA1.st(STREAM)
}
