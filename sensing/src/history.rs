//! Pixel rows that are still to be weighed: a mask row leaves the dilation as many rows late as there are dilations.

use crate::{dilate::MAX_DILATIONS, mask::MAX_WIDTH};

/// Rows that the dilation holds back at most.
const ROWS: u16 = MAX_DILATIONS as u16;

/// The rows of a frame that came last: [`MAX_DILATIONS`] of them.
#[derive(Clone, Debug)]
pub struct History {
    rows: [[u16; MAX_WIDTH as usize]; ROWS as usize],
}

impl History {
    /// For no frame yet.
    pub const fn new() -> History {
        History {
            rows: [[0; MAX_WIDTH as usize]; ROWS as usize],
        }
    }

    /// Row `y`, which must be among the last rows kept; what lies beyond the frame's width is undefined.
    pub fn row(&self, y: u16) -> &[u16] {
        &self.rows[usize::from(y % ROWS)]
    }

    /// Keeps the last rows of a band that begins with row `first` of the frame; rows have at most 800 pixels.
    pub fn keep(&mut self, first: u16, band: &[u16], row_length: usize) {
        let count = (band.len() / row_length.max(1)) as u16;
        let skipped = count.saturating_sub(ROWS);
        let rows = band.chunks_exact(row_length.max(1));
        for (y, row) in (first + skipped..).zip(rows.skip(usize::from(skipped))) {
            let kept = &mut self.rows[usize::from(y % ROWS)];
            if let Some(kept) = kept.get_mut(..row.len()) {
                kept.copy_from_slice(row);
            }
        }
    }
}

/// Rows that arrived together, one after the other in memory.
#[derive(Clone, Copy, Debug)]
pub struct Band<'p> {
    /// Which row of the frame is its first.
    pub first: u16,
    /// `u16`s of a row, at least 1.
    pub row_length: usize,
    /// The rows; what is left at the end is no row.
    pub pixels: &'p [u16],
}

impl<'p> Band<'p> {
    /// Without rows.
    pub const EMPTY: Band<'static> = Band {
        first: u16::MAX,
        row_length: 1,
        pixels: &[],
    };

    /// Row `y` of the frame; `None` when it is not in the band.
    pub fn row(&self, y: u16) -> Option<&'p [u16]> {
        let start = usize::from(y.checked_sub(self.first)?) * self.row_length;
        self.pixels.get(start..start + self.row_length)
    }
}
