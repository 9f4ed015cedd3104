//! MDMA channel 0: bands from AXI SRAM into DTCM, where the core reads them without waiting.
//!
//! # Design
//! Three buffers: while the core scans one band, the next one is copied when it is there already,
//! and the one before stays, as its last rows may have to be weighed yet. The core asks for a band
//! when it knows that it is finished, so it waits for a copy only when it had nothing to do: one
//! band of 320 × 8 pixels moves in about 6 µs (640 reads of 8 bytes and 1280 writes of 4 at the
//! 240 MHz of the bus; an estimate, not measured).
//!
//! # Note
//! Coherence: the MDMA reads AXI SRAM past the caches, where the camera's DMA has written past
//! them; it writes DTCM, which is never cached. A barrier keeps the core from reading ahead of the
//! end of a copy.

use crate::bands::{self, BAND_LENGTH, SHAPE};
use embassy_stm32::pac::mdma::{Ch, regs, vals};
use embassy_stm32::pac::{MDMA, RCC};
use embassy_stm32::{Peri, peripherals};
use hivtac_capture::Band;
use static_cell::ConstStaticCell;

const CHANNEL: usize = 0;
/// Bytes that the MDMA reads and then writes at once: its whole buffer. Every band is a multiple of
/// it.
const BUFFER_BYTES: u8 = 128;
/// Looks at a copy under way before it counts as failed: a few milliseconds.
const PATIENCE: u32 = 100_000;

#[derive(Clone, Copy)]
#[repr(C, align(128))]
struct Rows([u16; BAND_LENGTH]);

/// The one being scanned, the one before it, and the next.
const COUNT: usize = 3;

static BUFFERS: ConstStaticCell<[Rows; COUNT]> =
    ConstStaticCell::new([Rows([0; BAND_LENGTH]); COUNT]);

/// The channel and its buffers.
pub struct BandCopy {
    _channel: Peri<'static, peripherals::MDMA_CH0>,
    buffers: &'static mut [Rows; COUNT],
    /// The buffer of the copy under way, or the next one.
    next: usize,
    /// The band that is being copied, or was copied ahead.
    ahead: Option<u32>,
    /// The band that was fetched last, when it was intact.
    before: Option<u32>,
}

/// A band in memory, row by row.
pub struct Fetched<'b> {
    /// Its pixels.
    pub rows: &'b [u16],
    /// Those of the band before it; none when that is not there.
    pub above: &'b [u16],
}

impl BandCopy {
    /// Takes the channel. Call once.
    pub fn new(channel: Peri<'static, peripherals::MDMA_CH0>) -> Self {
        RCC.ahb3enr().modify(|w| w.set_mdmaen(true));
        Self {
            _channel: channel,
            buffers: BUFFERS.take(),
            next: 0,
            ahead: None,
            before: None,
        }
    }

    /// A finished band. `finished` tells how many bands are finished by now; when there is one more
    /// already, its copy begins. `None` when the band was overwritten meanwhile, or could not be
    /// copied.
    pub fn fetch(&mut self, band: &Band, finished: impl Fn() -> u32) -> Option<Fetched<'_>> {
        if self.ahead.take() != Some(band.sequence) {
            self.start(band.sequence);
        }
        let copied = wait();
        let finished = finished();
        let (buffer, buffer_before) = (self.next, (self.next + COUNT - 1) % COUNT);
        self.next = (self.next + 1) % COUNT;
        let following = band.sequence.wrapping_add(1);
        if following != finished {
            self.start(following);
            self.ahead = Some(following);
        }
        let intact = copied && SHAPE.intact(band.sequence, finished);
        let before = self.before.take();
        if !intact {
            return None;
        }
        self.before = Some(band.sequence);
        let follows = before.is_some_and(|before| before.wrapping_add(1) == band.sequence);
        let above = self.buffers.get(buffer_before).filter(|_| follows);
        Some(Fetched {
            rows: &self.buffers.get(buffer)?.0,
            above: above.map_or(&[], |rows| &rows.0),
        })
    }

    /// Begins to copy a band into the next buffer. What was under way is given up.
    fn start(&mut self, sequence: u32) {
        let Some(buffer) = self.buffers.get_mut(self.next) else {
            return;
        };
        let channel = registers();
        channel.cr().write_value(regs::Cr(0));
        while channel.cr().read().en() {}
        channel.ifcr().write_value(regs::Ifcr(ALL_FLAGS));
        channel.tcr().write(set_up_transfer);
        channel
            .bndtr()
            .write(|w| w.set_bndt(size_of::<Rows>() as u32));
        let source = bands::address(SHAPE.slot(sequence));
        channel.sar().write_value(regs::Sar(source));
        channel
            .dar()
            .write_value(regs::Dar(&raw mut *buffer as u32));
        channel.tbr().write(|w| {
            w.set_sbus(vals::Bus::SYSTEM);
            w.set_dbus(vals::Bus::AHB);
        });
        channel.mar().write_value(regs::Mar(0));
        // The core's last reads of this buffer come before the MDMA's writes.
        cortex_m::asm::dmb();
        channel.cr().write(|w| w.set_en(true));
        channel.cr().write(|w| {
            w.set_en(true);
            w.set_swrq(true);
        });
    }
}

/// TEIF to TCIF of IFCR.
const ALL_FLAGS: u32 = 0x1F;

/// One software request moves one block: read as words of 8 bytes over AXI, written as words of
/// 4 bytes into DTCM (more is not allowed there: RM0433, MDMA_CxTCR).
fn set_up_transfer(w: &mut regs::Tcr) {
    w.set_sinc(vals::Incmode::INCREMENT);
    w.set_ssize(vals::Wordsize::DOUBLE_WORD);
    w.set_sincos(vals::Wordsize::DOUBLE_WORD);
    w.set_sburst(vals::Burst::INCR16);
    w.set_dinc(vals::Incmode::INCREMENT);
    w.set_dsize(vals::Wordsize::WORD);
    w.set_dincos(vals::Wordsize::WORD);
    w.set_dburst(vals::Burst::INCR16);
    w.set_tlen(BUFFER_BYTES - 1);
    w.set_pke(true);
    w.set_trgm(vals::Trgm::BLOCK);
    w.set_swrm(true);
}

/// Waits for the copy's end; says whether it went well.
fn wait() -> bool {
    for _ in 0..PATIENCE {
        let state = registers().isr().read();
        if state.teif() {
            return false;
        }
        if state.ctcif() {
            cortex_m::asm::dmb();
            return true;
        }
    }
    false
}

fn registers() -> Ch {
    MDMA.ch(CHANNEL)
}
