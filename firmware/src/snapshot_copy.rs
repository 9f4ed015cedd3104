//! MDMA channel 1: the bands of one frame as the sensing reads them, from DTCM into AXI SRAM.
//!
//! # Design
//! A frame is kept while it is scanned, band after band: the source is the buffer in which the core
//! reads that band (`band_copy`), so that the copy is what the sensing saw. The core starts a copy
//! and scans the band meanwhile, twice as long as the copy takes; the buffer stays until the band
//! after the next is fetched. A frame that is not whole at its end is forgotten, and the next one
//! is kept instead, until [`PATIENCE`] is over.
//!
//! # Note
//! It costs the camera nothing: its DMA waits for a burst of the MDMA at most, as it does without a
//! snapshot (`capture`), for the two channels take turns at one port.

use crate::bands::{BAND_BYTES, SHAPE};
use crate::block_move::{BlockMove, End};
use crate::camera::{HEIGHT, WIDTH};
use crate::outbox;
use crate::session::Asked;
use crate::snapshot::{self, FRAME_BYTES, Taken};
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Instant};
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::{Outcome, Snapshot};

const CHANNEL: usize = 1;
/// Longest wait for a whole frame: a camera that fell silent is back by then, or does not come.
const PATIENCE: Duration = Duration::from_secs(2);

/// The channel, and the snapshot that is wanted.
pub struct SnapshotCopy {
    _channel: Peri<'static, peripherals::MDMA_CH1>,
    mover: BlockMove<CHANNEL>,
    wanted: Option<Wanted>,
}

struct Wanted {
    asked: Asked,
    deadline: Instant,
    /// Bands of the frame under way that were kept, the one that is being copied, too; nothing once
    /// one was missed.
    kept: Option<u16>,
}

impl SnapshotCopy {
    /// Takes the channel. Call once.
    pub fn new(channel: Peri<'static, peripherals::MDMA_CH1>) -> Self {
        Self {
            _channel: channel,
            mover: BlockMove::new(),
            wanted: None,
        }
    }

    /// Keeps the next whole frame. One that was wanted before is no longer.
    pub fn begin(&mut self, asked: Asked) {
        self.wanted = Some(Wanted {
            asked,
            deadline: Instant::now() + PATIENCE,
            kept: None,
        });
    }

    /// When it is too late for a whole frame.
    pub fn deadline(&self) -> Instant {
        let wanted = self.wanted.as_ref();
        wanted.map_or(Instant::MAX, |wanted| wanted.deadline)
    }

    /// A band is being scanned; nothing when it could not be fetched.
    pub fn band(&mut self, index: u16, rows: Option<&[u16]>) {
        let Some(wanted) = &mut self.wanted else {
            return;
        };
        if index == 0 {
            wanted.kept = Some(0);
        }
        let in_order = wanted.kept == Some(index);
        let copied = in_order && (index == 0 || self.mover.wait());
        wanted.kept = match rows {
            Some(rows) if copied => {
                let to = End::Axi(snapshot::address(index));
                self.mover
                    .start(End::Tcm(rows.as_ptr() as u32), to, BAND_BYTES);
                Some(index + 1)
            }
            _ => None,
        };
    }

    /// A frame was measured: when it was kept whole it is sent.
    pub fn frame(&mut self, frame: u32, time_us: u64, threshold: Threshold) {
        let whole = |wanted: &mut Wanted| wanted.kept == Some(SHAPE.bands());
        let Some(wanted) = self.wanted.take_if(whole) else {
            return;
        };
        if !self.mover.wait() {
            self.wanted = Some(wanted);
            return;
        }
        let header = Snapshot {
            frame,
            time_us,
            width: WIDTH,
            height: HEIGHT,
            threshold,
            bytes: FRAME_BYTES as u32,
        };
        let asked = wanted.asked;
        snapshot::send(Taken { asked, header });
    }

    /// There was no whole frame in time.
    pub fn give_up(&mut self) {
        let Some(Wanted { asked, .. }) = self.wanted.take() else {
            return;
        };
        snapshot::end(asked);
        if let Some(id) = asked.id() {
            outbox::reply(id, Outcome::NoGoodFrames);
        }
    }
}
