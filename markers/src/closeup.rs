//! The pixels around what may be four markers, kept while a frame's rows come once more.

use crate::tables::Pixels;

/// Columns and rows of a window: a marker of 40 px with its surroundings.
pub const SIDE: usize = 48;

/// How much of each pixel around a place a marker covers ([`Pixels::weight`]).
#[derive(Clone, Debug)]
pub struct Window {
    /// Leftmost column and topmost row in the frame.
    pub origin: [u16; 2],
    weights: [[u8; SIDE]; SIDE],
}

/// One window for each marker.
#[derive(Clone, Debug)]
pub struct Closeups {
    windows: [Window; 4],
    size: [u16; 2],
    rows_in: u16,
}

impl Window {
    const EMPTY: Window = Window {
        origin: [0; 2],
        weights: [[0; SIDE]; SIDE],
    };

    /// The weight at a point of the window, px with 8 fractional bits, as is the weight, between
    /// its four nearest pixels; 0 beyond the window.
    pub fn at(&self, [x, y]: [i32; 2]) -> i32 {
        let pixel = |row: Option<&[u8; SIDE]>, column: i32| -> i32 {
            let column = usize::try_from(column).unwrap_or(usize::MAX);
            row.and_then(|row| row.get(column))
                .copied()
                .map_or(0, i32::from)
        };
        let (column, row) = (x >> 8, y >> 8);
        let rows =
            [row, row + 1].map(|row| self.weights.get(usize::try_from(row).unwrap_or(usize::MAX)));
        let [upper, lower] = rows.map(|row| {
            let (left, right) = (pixel(row, column), pixel(row, column + 1));
            256 * left + (x & 255) * (right - left)
        });
        (256 * upper + (y & 255) * (lower - upper)) >> 8
    }

    /// Takes row `y` of the frame.
    fn take(&mut self, pixels: &impl Pixels, row: &[u16], y: u16) {
        let [left, top] = self.origin;
        let below = usize::from(y.wrapping_sub(top));
        let Some(kept) = self.weights.get_mut(below) else {
            return;
        };
        for (column, weight) in (left..).zip(kept) {
            *weight = pixels.weight(row, column);
        }
    }
}

impl Default for Closeups {
    fn default() -> Self {
        Self::new()
    }
}

impl Closeups {
    /// For no frame yet.
    pub const fn new() -> Closeups {
        Closeups {
            windows: [Window::EMPTY; 4],
            size: [0; 2],
            rows_in: 0,
        }
    }

    /// Waits for a frame of so many columns and rows, of which it keeps what lies around four
    /// pixels.
    pub fn begin(&mut self, size: [u16; 2], around: [[u16; 2]; 4]) {
        (self.size, self.rows_in) = (size, 0);
        for (window, around) in self.windows.iter_mut().zip(around) {
            let origin = |around: u16, size: u16| {
                let largest = size.saturating_sub(SIDE as u16);
                around.saturating_sub(SIDE as u16 / 2).min(largest)
            };
            let ([x, y], [width, height]) = (around, size);
            window.origin = [origin(x, width), origin(y, height)];
            // A frame may be smaller than a window.
            window.weights = [[0; SIDE]; SIDE];
        }
    }

    /// Takes the next rows of the frame, as they lie in memory one after the other.
    pub fn push_rows(&mut self, pixels: &impl Pixels, rows: &[u16]) {
        let length = pixels.row_length(self.size[0]).max(1);
        for row in rows.chunks_exact(length) {
            for window in &mut self.windows {
                window.take(pixels, row, self.rows_in);
            }
            self.rows_in = self.rows_in.saturating_add(1);
        }
    }

    /// The windows of markers 0–3; `None` unless all rows of the frame came.
    pub fn windows(&self) -> Option<&[Window; 4]> {
        (self.rows_in == self.size[1]).then_some(&self.windows)
    }
}
