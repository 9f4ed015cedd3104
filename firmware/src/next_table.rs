//! A new threshold's table: made in parts beside the one in use, which serves until the new one is whole.
//!
//! A part is made whenever nothing else is to be done, between two bands as well as between two frames, and is short against
//! what a band may wait. The whole table then goes to DTCM between two frames, so that no frame is of two thresholds.

use crate::near_table::NearTable;
use hivtac_sensing::tables::{ByteTable, Table};
use hivtac_sensing::threshold::{ByteOrder, HsvBox, ThresholdError};
use static_cell::ConstStaticCell;

/// Values of a pixel that are dealt with at a time: some 29,000 instructions, 60 µs at most.
const PART: usize = 256;

/// SRAM that is zero at the start, which such a table is (`memory.x`).
#[unsafe(link_section = ".sram_zero.next_table")]
static TABLE: ConstStaticCell<ByteTable> = ConstStaticCell::new(ByteTable::CLOSED);

/// The table in the making.
pub struct NextTable {
    table: &'static mut ByteTable,
    order: ByteOrder,
    making: Option<Making>,
}

/// What it is made for.
struct Making {
    /// Of the command that asked for it.
    id: u16,
    threshold: HsvBox,
    /// Values that are done.
    done: usize,
}

impl NextTable {
    /// For pixels that lie so in memory. Once.
    pub fn take(order: ByteOrder) -> Self {
        Self {
            table: TABLE.take(),
            order,
            making: None,
        }
    }

    /// Whether a table is under way, or whole and not in use yet.
    pub fn is_wanted(&self) -> bool {
        self.making.is_some()
    }

    /// Whether there is something left to make.
    pub fn is_unfinished(&self) -> bool {
        let done = self.making.as_ref().map(|making| making.done);
        done.is_some_and(|done| done < ByteTable::VALUES)
    }

    /// Begins a table for the command `id`; what was under way is given up.
    ///
    /// # Errors
    /// A box that means nothing.
    pub fn begin(&mut self, id: u16, threshold: HsvBox) -> Result<(), ThresholdError> {
        threshold.check()?;
        self.making = Some(Making {
            id,
            threshold,
            done: 0,
        });
        Ok(())
    }

    /// Makes the next part.
    pub fn go_on(&mut self) {
        if let Some(making) = &mut self.making {
            let part = making.done..making.done + PART;
            making.done = part.end;
            self.table.set_part(&making.threshold, self.order, part);
        }
    }

    /// Whose it is, and for which threshold, once it is whole; it is then to be [`install`](Self::install)ed.
    pub fn finish(&mut self) -> Option<(u16, HsvBox)> {
        let whole = self
            .making
            .take_if(|making| making.done >= ByteTable::VALUES);
        whole.map(|making| (making.id, making.threshold))
    }

    /// Puts the table where the pixels are looked up.
    pub fn install(&self, near: &mut NearTable) {
        near.copy_from(self.table);
    }
}
