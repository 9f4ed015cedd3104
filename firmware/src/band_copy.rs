//! Copies bands by MDMA channel 0 from AXI SRAM into DTCM, where the core reads them without
//! waiting.
//!
//! # Design
//! There are three buffers. While the core scans one band, the next one is copied if it has already
//! arrived; the previous one stays, because its last rows may still have to be weighed. The core
//! asks for a band once the band is finished, so it waits for a copy only if it was idle. One band
//! of 320 × 8 pixels takes about 6 µs. That is 640 reads of 8 bytes and 1280 writes of 4 at the 240
//! MHz of the bus; an estimate, not measured.

use crate::bands::{self, BAND_LENGTH, SHAPE};
use crate::block_move::{BlockMove, End};
use embassy_stm32::{Peri, peripherals};
use hivtac_portable::capture::Band;
use static_cell::ConstStaticCell;

const CHANNEL: usize = 0;

#[derive(Clone, Copy)]
#[repr(C, align(128))]
struct Rows([u16; BAND_LENGTH]);

/// The current band, the previous one, and the next.
const COUNT: usize = 3;

static BUFFERS: ConstStaticCell<[Rows; COUNT]> =
    ConstStaticCell::new([Rows([0; BAND_LENGTH]); COUNT]);

/// The channel and its buffers.
pub struct BandCopy {
    _channel: Peri<'static, peripherals::MDMA_CH0>,
    mover: BlockMove<CHANNEL>,
    buffers: &'static mut [Rows; COUNT],
    /// Index of the buffer of the active copy, or of the next one.
    next: usize,
    /// The band that is being copied, or was copied, ahead.
    ahead: Option<u32>,
    /// The last band that was fetched, if it was intact.
    before: Option<u32>,
}

/// A band in memory, row by row.
pub struct Fetched<'b> {
    /// Its pixels.
    pub rows: &'b [u16],
    /// The pixels of the band before it; empty if that is no longer in memory.
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

    /// Returns a finished band. `finished` returns how many bands are finished by now; if the next
    /// band is among them, its copy begins. Returns `None` if the band was overwritten meanwhile,
    /// or could not be copied.
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

    /// Call before bands are fetched a second time: none counts as copied ahead, and none as above
    /// the next.
    pub fn rewind(&mut self) {
        (self.ahead, self.before) = (None, None);
    }

    /// Begins to copy a band into the next buffer. An active copy is aborted.
    fn start(&mut self, sequence: u32) {
        let Some(buffer) = self.buffers.get_mut(self.next) else {
            return;
        };
        let source = bands::address(SHAPE.slot(sequence));
        let (from, to) = (End::Axi(source), End::Tcm(&raw mut *buffer as u32));
        self.mover.start(from, to, size_of::<Rows>());
    }
}
