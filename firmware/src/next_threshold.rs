//! A new threshold on its way: its table is made, the camera is set to its pixel format, and it comes into use between two
//! frames. Until then the one before serves.
//!
//! RGB565 needs a table. It is made in parts beside the one in use: a part whenever nothing else is to be done, between two
//! bands as well as between two frames, and short against what a band may wait. Whole, it goes to DTCM between two frames.
//! Another pixel format then asks the capture task to set the camera; the first event of frames in that format brings
//! the threshold into use, so that no frame is of two thresholds or read as what it is not.

use crate::camera::Format;
use crate::capture_task;
use crate::near_table::NearTable;
use crate::pipeline_task::Sensor;
use crate::session::Asked;
use hivtac_sensing::tables::{ByteTable, Table};
use hivtac_sensing::threshold::{ByteOrder, HsvBox, Threshold};
use hivtac_wire::message::Outcome;
use static_cell::ConstStaticCell;

/// Values of a pixel that are dealt with at a time: some 29,000 instructions, 60 µs at most.
const PART: usize = 256;

/// SRAM that is zero at the start, which such a table is (`memory.x`).
#[unsafe(link_section = ".sram_zero.next_table")]
static TABLE: ConstStaticCell<ByteTable> = ConstStaticCell::new(ByteTable::CLOSED);

/// The threshold that is to come into use, if any, and the table in the making.
pub struct NextThreshold {
    table: &'static mut ByteTable,
    order: ByteOrder,
    wanted: Option<Wanted>,
}

/// What was asked for.
struct Wanted {
    asked: Asked,
    threshold: Threshold,
    /// What the camera must send for it.
    format: Format,
    /// Values of the table that are done; none are needed but for RGB565.
    done: usize,
    /// The camera was asked for its format.
    camera_asked: bool,
}

impl Wanted {
    fn table_is_whole(&self) -> bool {
        self.done >= ByteTable::VALUES
    }

    fn hsv_box(&self) -> Option<HsvBox> {
        match self.threshold {
            Threshold::Rgb565(hsv_box) => Some(hsv_box),
            Threshold::Yuv422(_) | Threshold::Mono(_) => None,
        }
    }
}

impl NextThreshold {
    /// For pixels of RGB565 that lie so in memory. Once.
    pub fn take(order: ByteOrder) -> Self {
        Self {
            table: TABLE.take(),
            order,
            wanted: None,
        }
    }

    /// Whether there is something left to make.
    pub fn is_unfinished(&self) -> bool {
        let wanted = self.wanted.as_ref();
        wanted.is_some_and(|wanted| !wanted.table_is_whole())
    }

    /// Begins with a threshold, as it came, for the command `id`.
    ///
    /// # Errors
    /// Why it is refused: another one is under way, it means nothing, or the camera does not send such pixels.
    pub fn begin(&mut self, id: u16, threshold: Threshold) -> Result<(), Outcome> {
        if self.wanted.is_some() {
            return Err(Outcome::Busy);
        }
        threshold.check().map_err(|_| Outcome::InvalidArgument)?;
        let format = Format::of(threshold.format()).ok_or(Outcome::Unsupported)?;
        self.wanted = Some(Wanted {
            asked: Asked::by(id),
            threshold,
            format,
            done: match format {
                Format::Rgb565 => 0,
                Format::Yuv422 => ByteTable::VALUES,
            },
            camera_asked: false,
        });
        Ok(())
    }

    /// Makes the next part of the table.
    pub fn go_on(&mut self) {
        let Some(wanted) = &mut self.wanted else {
            return;
        };
        if let Some(hsv_box) = wanted.hsv_box() {
            let part = wanted.done..wanted.done + PART;
            wanted.done = part.end;
            self.table.set_part(&hsv_box, self.order, part);
        }
    }

    /// Between two frames, of which the next one has pixels `sent`: brings the threshold into use if it can be, or asks the
    /// camera for its pixels. Tells who asked for it, once it is in use.
    pub fn come_into_use(&mut self, sensor: &mut Sensor, sent: Format) -> Option<Asked> {
        let wanted = self.wanted.as_mut().filter(|it| it.table_is_whole())?;
        if wanted.format != sent {
            if !core::mem::replace(&mut wanted.camera_asked, true) {
                capture_task::WANTED_FORMAT.signal(wanted.format);
            }
            return None;
        }
        let asked = wanted.asked;
        let install = |near: &mut NearTable| near.copy_from(self.table);
        // Both were checked when they came.
        let _ = match wanted.hsv_box() {
            Some(hsv_box) => sensor.set_made_threshold(hsv_box, install),
            None => sensor.set_threshold(wanted.threshold),
        };
        self.wanted = None;
        Some(asked)
    }
}
