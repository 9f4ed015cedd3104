//! A part of a frame.

use crate::blob::Blob;

/// Windows begin and end at multiples of so many columns, or at the frame's edge: pixels then are whole words, in every
/// format.
const COLUMNS: u16 = 4;

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

    /// Widened on every side, as far as `frame` goes, and to whole words.
    pub(crate) fn widened(&self, columns: u16, rows: u16, frame: Rectangle) -> Rectangle {
        let x1 = self.x1.saturating_add(columns).next_multiple_of(COLUMNS);
        Rectangle {
            x0: (self.x0.saturating_sub(columns) / COLUMNS * COLUMNS).max(frame.x0),
            y0: self.y0.saturating_sub(rows).max(frame.y0),
            x1: x1.min(frame.x1),
            y1: self.y1.saturating_add(rows).min(frame.y1),
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
