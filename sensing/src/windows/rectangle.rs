//! A part of a frame.

use crate::blob::Blob;

/// What is read begins at a multiple of so many columns: no pixel shares its `u16` with one outside, in any format.
const PAIR: u16 = 2;
/// What a camera is asked for begins and ends at multiples of so many columns: pixels there begin a word of memory.
const COLUMNS: u16 = 4;

/// Columns of a word of the mask.
pub(super) const WORD: u16 = 32;

/// Columns `x0..x1` of rows `y0..y1`, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Rectangle {
    /// First column.
    pub x0: u16,
    /// First row.
    pub y0: u16,
    /// Behind the last column.
    pub x1: u16,
    /// Behind the last row.
    pub y1: u16,
}

impl Rectangle {
    /// All of a frame.
    pub(crate) const fn of_frame(width: u16, height: u16) -> Rectangle {
        Rectangle {
            x0: 0,
            y0: 0,
            x1: width,
            y1: height,
        }
    }

    /// The bounding box of a blob.
    pub(crate) fn of_blob(blob: &Blob) -> Rectangle {
        Rectangle {
            x0: blob.x0,
            y0: blob.y0,
            x1: blob.x1 + 1,
            y1: blob.y1 + 1,
        }
    }

    /// Columns.
    pub fn width(&self) -> u16 {
        self.x1 - self.x0
    }

    /// Rows.
    pub fn height(&self) -> u16 {
        self.y1 - self.y0
    }

    /// Pixels.
    pub fn pixels(&self) -> u32 {
        u32::from(self.width()) * u32::from(self.height())
    }

    /// Widened on every side, as far as `frame` goes.
    pub(crate) fn widened(&self, columns: u16, rows: u16, frame: Rectangle) -> Rectangle {
        Rectangle {
            x0: self.x0.saturating_sub(columns).max(frame.x0),
            y0: self.y0.saturating_sub(rows).max(frame.y0),
            x1: self.x1.saturating_add(columns).min(frame.x1),
            y1: self.y1.saturating_add(rows).min(frame.y1),
        }
    }

    /// Widened to multiples of [`COLUMNS`], as far as `frame` goes.
    pub(crate) fn in_columns(&self, frame: Rectangle) -> Rectangle {
        Rectangle {
            x0: (self.x0 / COLUMNS * COLUMNS).max(frame.x0),
            x1: self.x1.next_multiple_of(COLUMNS).min(frame.x1),
            ..*self
        }
    }

    /// Widened to both sides to whole words of the mask, as far as `frame` goes: these are scanned fastest.
    pub(crate) fn in_words(&self, frame: Rectangle) -> Rectangle {
        let x0 = self.x0 / PAIR * PAIR;
        let width = (self.x1 - x0).next_multiple_of(WORD);
        let spare = width - (self.x1 - x0);
        let middle = x0.saturating_sub(spare / 2) / PAIR * PAIR;
        let x1 = (middle + width).min(frame.x1);
        let x0 = x1.saturating_sub(width) / PAIR * PAIR;
        Rectangle {
            x0: x0.max(frame.x0),
            x1,
            ..*self
        }
    }

    /// The smallest one around both.
    pub(crate) fn joined(&self, other: &Rectangle) -> Rectangle {
        Rectangle {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }

    /// Whether they share a pixel.
    pub(crate) fn overlaps(&self, other: &Rectangle) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }

    /// Whether `other` lies inside.
    pub(crate) fn contains(&self, other: &Rectangle) -> bool {
        self.joined(other) == *self
    }
}
