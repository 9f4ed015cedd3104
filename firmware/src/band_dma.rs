//! Writes DCMI's data register into the ring of bands, endlessly, by DMA1 stream 0.
//!
//! # Design
//! In double-buffer mode, while the stream fills one target, the handler of its interrupt sets the
//! other target to the slot after. Direct mode (no DMA FIFO) keeps the count of missing words exact
//! at any moment, and needs no flush. There is one interrupt for each band.
//!
//! # Note
//! The ring is in AXI SRAM, because this DMA reaches neither DTCM nor ITCM.

use crate::bands::{self, BAND_LENGTH};
use crate::seeded_bugs;
use embassy_stm32::pac::dma::{St, regs, vals};
use embassy_stm32::pac::{DMA1, DMAMUX1};
use embassy_stm32::{Peri, peripherals};

const STREAM: usize = 0;

/// Words of a band: DCMI packs four bytes into one.
fn words() -> u16 {
    (BAND_LENGTH / 2) as u16 / seeded_bugs::band_divisor()
}

/// The stream.
pub struct BandDma {
    /// Ownership proves that no other code uses the stream.
    _stream: Peri<'static, peripherals::DMA1_CH0>,
}

impl BandDma {
    /// Takes the stream.
    pub fn new(stream: Peri<'static, peripherals::DMA1_CH0>) -> Self {
        Self { _stream: stream }
    }

    /// Starts anew: bands from the data register at `source` go into slots `first` and `second`,
    /// and then into those of [`aim`](Self::aim).
    pub fn start(&mut self, source: *mut u32, first: u16, second: u16) {
        self.halt();
        DMAMUX1
            .ccr(STREAM)
            .write(|w| w.set_dmareq_id(seeded_bugs::dcmi_dma_request()));
        let stream = registers();
        stream.par().write_value(source as u32);
        stream.m0ar().write_value(bands::address(first));
        stream.m1ar().write_value(bands::address(second));
        stream.ndtr().write(|w| w.set_ndt(words()));
        stream.fcr().write_value(regs::Fcr(0));
        // The core's writes to the ring at boot must not arrive after the DMA's words.
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

    /// Stops the stream and discards its events. Returns when its last write is done, after some
    /// bus cycles; if that ever takes longer, the watchdog resets the program.
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

    /// Returns whether the second target is being filled.
    pub fn fills_second(&self) -> bool {
        registers().cr().read().ct() == vals::Ct::MEMORY1
    }

    /// Returns whether a band was finished since the previous call.
    pub fn take_finished(&mut self) -> bool {
        let finished = DMA1.isr(STREAM / 4).read().tcif(STREAM % 4);
        if finished {
            DMA1.ifcr(STREAM / 4)
                .write(|w| w.set_tcif(STREAM % 4, true));
        }
        finished
    }

    /// Returns whether the bus refused an access, which stops the stream.
    pub fn failed(&self) -> bool {
        DMA1.isr(STREAM / 4).read().teif(STREAM % 4)
    }

    /// Returns whether a band was just finished, or none has begun.
    pub fn is_between_bands(&self) -> bool {
        let finished = DMA1.isr(STREAM / 4).read().tcif(STREAM % 4);
        finished || registers().ndtr().read().ndt() == words()
    }

    /// Returns whether words have come since the last band that was [taken](Self::take_finished).
    pub fn has_begun_a_band(&self) -> bool {
        let finished = DMA1.isr(STREAM / 4).read().tcif(STREAM % 4);
        finished || registers().ndtr().read().ndt() != words()
    }
}

fn registers() -> St {
    DMA1.st(STREAM)
}
