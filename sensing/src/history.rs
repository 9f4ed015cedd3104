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

    /// Keeps the last `count` ≤ [`MAX_DILATIONS`] rows before row `end` that are in the band; rows have at most 800 pixels.
    pub fn keep(&mut self, band: &Band<'_>, end: u16, count: u8) {
        for y in end.saturating_sub(u16::from(count))..end {
            let kept = &mut self.rows[usize::from(y % ROWS)];
            let Some(row) = band.row(y) else {
                continue;
            };
            if let Some(kept) = kept.get_mut(..row.len()) {
                kept.copy_from_slice(row);
            }
        }
    }
}

/// Rows that are in memory together.
#[derive(Clone, Copy, Debug)]
pub struct Band<'p> {
    /// Which row of the frame is its first.
    pub first: u16,
    /// `u16`s of a row.
    pub row_length: usize,
    /// From where one row begins to where the next does.
    pub stride: usize,
    /// The rows.
    pub pixels: &'p [u16],
}

impl<'p> Band<'p> {
    /// Without rows.
    pub const EMPTY: Band<'static> = Band {
        first: u16::MAX,
        row_length: 1,
        stride: 1,
        pixels: &[],
    };

    /// So many rows ≥ 1 from row `y` of the frame on, all of which are in the band.
    pub fn part(&self, y: u16, rows: usize) -> &'p [u16] {
        let start = usize::from(y - self.first) * self.stride;
        let end = start + (rows - 1) * self.stride + self.row_length;
        self.pixels.get(start..end).unwrap_or_default()
    }

    /// Row `y` of the frame; `None` when it is not in the band.
    pub fn row(&self, y: u16) -> Option<&'p [u16]> {
        let start = usize::from(y.checked_sub(self.first)?) * self.stride;
        self.pixels.get(start..start + self.row_length)
    }
}
