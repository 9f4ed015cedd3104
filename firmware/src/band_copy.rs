//! MDMA channel 0: bands from AXI SRAM into DTCM, where the core reads them without waiting.
//!
//! # Design
//! Three buffers: while the core scans one band, the next one is copied when it is there already,
//! and the one before stays, as its last rows may have to be weighed yet. The core asks for a band
//! when it knows that it is finished, so it waits for a copy only when it had nothing to do: one
//! band of 320 × 8 pixels moves in about 6 µs (640 reads of 8 bytes and 1280 writes of 4 at the
//! 240 MHz of the bus; an estimate, not measured).

use crate::bands::{self, BAND_LENGTH, SHAPE};
use crate::block_move::{BlockMove, End};
use embassy_stm32::{Peri, peripherals};
use hivtac_capture::Band;
use static_cell::ConstStaticCell;

const CHANNEL: usize = 0;

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
    mover: BlockMove<CHANNEL>,
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
        Self {
            _channel: channel,
            mover: BlockMove::new(),
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
        let copied = self.mover.wait();
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

    /// Bands are fetched anew that were fetched before: none was copied ahead, and none lies above
    /// the next.
    pub fn rewind(&mut self) {
        (self.ahead, self.before) = (None, None);
    }

    /// Begins to copy a band into the next buffer. What was under way is given up.
    fn start(&mut self, sequence: u32) {
        let Some(buffer) = self.buffers.get_mut(self.next) else {
            return;
        };
        let source = bands::address(SHAPE.slot(sequence));
        let (from, to) = (End::Axi(source), End::Tcm(&raw mut *buffer as u32));
        self.mover.start(from, to, size_of::<Rows>());
    }
}
