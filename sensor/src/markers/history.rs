//! Pixel rows that are still to be weighed: a mask row leaves the dilation as many rows late as
//! there are dilations.

use crate::markers::dilate::MAX_DILATIONS;
use crate::markers::mask::MAX_WIDTH;

/// Rows that the dilation and the majority hold back at most.
const ROWS: u16 = MAX_DILATIONS as u16 + 1;

/// The rows of a frame that came last, and that may no longer be where they were: one more than
/// [`MAX_DILATIONS`].
#[derive(Clone, Debug)]
pub struct History {
    rows: [[u16; MAX_WIDTH as usize]; ROWS as usize],
    /// Which row of the frame each of them is.
    numbers: [u16; ROWS as usize],
}

/// No row of any frame.
const NONE: u16 = u16::MAX;

impl History {
    /// For no frame yet.
    pub const fn new() -> History {
        History {
            rows: [[0; MAX_WIDTH as usize]; ROWS as usize],
            numbers: [NONE; ROWS as usize],
        }
    }

    /// Forgets all rows.
    pub fn clear(&mut self) {
        self.numbers = [NONE; ROWS as usize];
    }

    /// Row `y` of the frame, when it was kept; what lies beyond the frame's width is undefined.
    pub fn row(&self, y: u16) -> Option<&[u16]> {
        let place = usize::from(y % ROWS);
        let kept = self.numbers[place] == y;
        kept.then_some(&self.rows[place][..])
    }

    /// Keeps the last `count` ≤ [`MAX_DILATIONS`] + 1 rows before row `end` that are in memory;
    /// rows have at most 800 pixels.
    pub fn keep(&mut self, band: &Band<'_>, end: u16, count: u8) {
        for y in end.saturating_sub(u16::from(count))..end {
            let place = usize::from(y % ROWS);
            let Some(row) = band.row(y) else {
                continue;
            };
            if let Some(kept) = self.rows[place].get_mut(..row.len()) {
                kept.copy_from_slice(row);
                self.numbers[place] = y;
            }
        }
    }
}

/// Rows that are in memory together, and those right above them where these still are, too.
#[derive(Clone, Copy, Debug)]
pub struct Band<'p> {
    /// Which row of the frame is its first.
    pub first: u16,
    /// `u16`s of a row.
    pub row_length: usize,
    /// The rows, one after the other.
    pub pixels: &'p [u16],
    /// The rows above, which lie one after the other, to the one before the first.
    pub above: &'p [u16],
}

impl<'p> Band<'p> {
    /// All rows of a frame that comes as masks: without pixels.
    pub const WITHOUT_PIXELS: Band<'static> = Band {
        first: 0,
        row_length: 0,
        pixels: &[],
        above: &[],
    };

    /// Without rows.
    pub const EMPTY: Band<'static> = Band {
        first: u16::MAX,
        row_length: 1,
        pixels: &[],
        above: &[],
    };

    /// So many rows from row `y` of the frame on, all of which are in the band.
    pub fn part(&self, y: u16, rows: usize) -> &'p [u16] {
        let start = usize::from(y - self.first) * self.row_length;
        let end = start + rows * self.row_length;
        self.pixels.get(start..end).unwrap_or_default()
    }

    /// Row `y` of the frame; `None` when it is neither in the band nor right above it.
    pub fn row(&self, y: u16) -> Option<&'p [u16]> {
        match y.checked_sub(self.first) {
            Some(below) => {
                let start = usize::from(below) * self.row_length;
                self.pixels.get(start..start + self.row_length)
            }
            None => {
                let upwards = usize::from(self.first - y) * self.row_length;
                let start = self.above.len().checked_sub(upwards)?;
                self.above.get(start..start + self.row_length)
            }
        }
    }
}
