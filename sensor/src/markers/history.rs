//! Keeps pixel rows that are still to be weighed. A mask row leaves the dilation late, by as many
//! rows as there are dilations.

use crate::markers::dilate::MAX_DILATIONS;
use crate::markers::mask::MAX_WIDTH;

/// Most rows that dilation and majority hold back.
const ROWS: u16 = MAX_DILATIONS as u16 + 1;

/// Copies of the frame's last rows, [`MAX_DILATIONS`] + 1 of them, whose originals may be gone.
#[derive(Clone, Debug)]
pub struct History {
    rows: [[u16; MAX_WIDTH as usize]; ROWS as usize],
    /// The row number in the frame of each of them.
    numbers: [u16; ROWS as usize],
}

/// Not a row of any frame.
const NONE: u16 = u16::MAX;

impl History {
    /// A history before its first frame.
    pub const fn new() -> History {
        History {
            rows: [[0; MAX_WIDTH as usize]; ROWS as usize],
            numbers: [NONE; ROWS as usize],
        }
    }

    /// Discards all rows.
    pub fn clear(&mut self) {
        self.numbers = [NONE; ROWS as usize];
    }

    /// Returns row `y` of the frame; `None` if it was not kept. Pixels beyond the frame's width are
    /// undefined.
    pub fn row(&self, y: u16) -> Option<&[u16]> {
        let place = usize::from(y % ROWS);
        let kept = self.numbers[place] == y;
        kept.then_some(&self.rows[place][..])
    }

    /// Keeps those of the last `count` ≤ [`MAX_DILATIONS`] + 1 rows before row `end` that are in
    /// memory. Rows have at most 800 pixels.
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

/// Rows that are together in memory, and the rows above them if these are still there, too.
#[derive(Clone, Copy, Debug)]
pub struct Band<'p> {
    /// The frame's row number of its first row.
    pub first: u16,
    /// Number of `u16`s of a row.
    pub row_length: usize,
    /// The rows, one after the other.
    pub pixels: &'p [u16],
    /// The rows above, one after the other, up to the one before the first.
    pub above: &'p [u16],
}

impl<'p> Band<'p> {
    /// All rows of a frame that arrives as masks: no pixels.
    pub const WITHOUT_PIXELS: Band<'static> = Band {
        first: 0,
        row_length: 0,
        pixels: &[],
        above: &[],
    };

    /// A band with no rows.
    pub const EMPTY: Band<'static> = Band {
        first: u16::MAX,
        row_length: 1,
        pixels: &[],
        above: &[],
    };

    /// Returns `rows` rows from the frame's row `y` on; the band must have all of them.
    pub fn part(&self, y: u16, rows: usize) -> &'p [u16] {
        let start = usize::from(y - self.first) * self.row_length;
        let end = start + rows * self.row_length;
        self.pixels.get(start..end).unwrap_or_default()
    }

    /// Returns row `y` of the frame; `None` if it is neither in the band nor above it in memory.
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
