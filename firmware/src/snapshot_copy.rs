//! Copies the bands of one frame, as the sensing reads them, from DTCM into AXI SRAM by MDMA
//! channel 1.
//!
//! # Design
//! A frame is kept while it is scanned, band by band. The source is the buffer in which the core
//! reads that band (`band_copy`), so the copy equals the pixels that the sensing used. The core
//! starts a copy and scans the band meanwhile, which takes twice as long; the buffer stays until
//! the band after the next is fetched. A frame that is incomplete at its end is discarded, and the
//! next one is kept instead, until [`PATIENCE`] is over.
//!
//! # Note
//! It does not delay the camera. The camera's DMA waits at most for one burst of the MDMA, as
//! without a snapshot (`capture`), because the two channels take turns at one port.

use crate::bands::{BAND_BYTES, SHAPE};
use crate::block_move::{BlockMove, End};
use crate::camera::{HEIGHT, WIDTH};
use crate::outbox;
use crate::session::Origin;
use crate::snapshot::{self, FRAME_BYTES, Taken};
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Instant};
use hivtac_terms::threshold::Threshold;
use hivtac_wire::message::{Outcome, Snapshot};

const CHANNEL: usize = 1;
/// Longest wait for a whole frame: a silent camera is back by then, or does not come back.
const PATIENCE: Duration = Duration::from_secs(2);

/// The channel, and the requested snapshot.
pub struct SnapshotCopy {
    _channel: Peri<'static, peripherals::MDMA_CH1>,
    mover: BlockMove<CHANNEL>,
    wanted: Option<Wanted>,
}

struct Wanted {
    origin: Origin,
    deadline: Instant,
    /// Number of bands of the current frame that were kept, including the one being copied; `None`
    /// after a missed band.
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

    /// Keeps the next whole frame. A previous request is dropped.
    pub fn begin(&mut self, origin: Origin) {
        self.wanted = Some(Wanted {
            origin,
            deadline: Instant::now() + PATIENCE,
            kept: None,
        });
    }

    /// Returns the deadline for a whole frame.
    pub fn deadline(&self) -> Instant {
        let wanted = self.wanted.as_ref();
        wanted.map_or(Instant::MAX, |wanted| wanted.deadline)
    }

    /// Call when a band is scanned; `rows` is `None` if it could not be fetched.
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

    /// Call when a frame was measured: if it was kept whole, it is sent.
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
        let origin = wanted.origin;
        snapshot::send(Taken { origin, header });
    }

    /// Gives up after the deadline.
    pub fn give_up(&mut self) {
        let Some(Wanted { origin, .. }) = self.wanted.take() else {
            return;
        };
        snapshot::end(origin);
        if let Some(id) = origin.id() {
            outbox::reply(id, Outcome::NoGoodFrames);
        }
    }
}
