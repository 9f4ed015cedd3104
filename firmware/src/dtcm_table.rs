//! Places the threshold's table of 64 KiB in DTCM, wherever the rest of the pipeline is.

use hivtac_sensor::markers::tables::{ByteTable, Pixels, Run, Table, Weights};
use hivtac_sensor::pipeline;
use hivtac_terms::threshold::{ByteOrder, HsvBox, ThresholdError};
use static_cell::ConstStaticCell;

/// The table lies in `.bss`, which is in DTCM.
static TABLE: ConstStaticCell<ByteTable> = ConstStaticCell::new(ByteTable::CLOSED);

/// The pipeline, its threshold table in DTCM.
pub type Sensor = pipeline::Sensor<'static, 64, DtcmTable>;

/// The threshold table in DTCM. One instance can own it; others reject every pixel.
pub struct DtcmTable(Option<&'static mut ByteTable>);

impl DtcmTable {
    /// Returns the table, which is taken at its first use: only with RGB565 pixels.
    fn table(&mut self) -> Option<&mut ByteTable> {
        if self.0.is_none() {
            self.0 = TABLE.try_take();
        }
        self.0.as_deref_mut()
    }
}

impl Table for DtcmTable {
    const CLOSED: Self = DtcmTable(None);

    fn set(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> Result<(), ThresholdError> {
        match self.table() {
            Some(table) => table.set(hsv_box, order),
            None => hsv_box.check(),
        }
    }

    fn accepts(&self, raw: u16) -> bool {
        self.0.as_ref().is_some_and(|table| table.accepts(raw))
    }
}

impl Pixels for DtcmTable {
    fn row_length(&self, width: u16) -> usize {
        usize::from(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool {
        match &self.0 {
            Some(table) => table.mask_row(row, mask),
            None => {
                mask.fill(0);
                false
            }
        }
    }

    fn mask_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) -> bool {
        match &self.0 {
            Some(table) => table.mask_rows(rows, width, mask),
            None => {
                mask.fill(0);
                false
            }
        }
    }

    fn mask_covered_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) {
        match &self.0 {
            Some(table) => table.mask_covered_rows(rows, width, mask),
            None => mask.fill(0),
        }
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        self.0.as_ref().map_or(0, |table| table.weight(row, column))
    }

    fn weigh(&self, row: &[u16], run: Run) -> Weights {
        match &self.0 {
            Some(table) => table.weigh(row, run),
            None => Weights::NONE,
        }
    }
}
