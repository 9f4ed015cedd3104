//! Reads rows of RGB565 pixels through a table over all 65,536 values.

use crate::markers::beside;
use crate::markers::kernels::{threshold_bytes, weigh_bytes};
use crate::markers::mask::words_of;
use hivtac_terms::hsv::{Hsv, rgb888};
use hivtac_terms::threshold::{ByteOrder, HsvBox, ThresholdError};

pub use crate::markers::runs::Run;

/// Reads the pixels of a row: which of them belong to a marker, and how much of each it covers.
///
/// A row is a slice of `u16` as it lies in memory.
pub trait Pixels {
    /// Number of `u16`s of a row of `width` pixels.
    fn row_length(&self, width: u16) -> usize;

    /// Thresholds a row: bit i of word w is pixel 32·w + i. `mask` has ⌈pixels / 32⌉ words; bits
    /// beyond the row are cleared. Returns whether any bit is set.
    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool;

    /// Thresholds several rows of `width` pixels, one after the other in memory. `mask` has ⌈width
    /// / 32⌉ words for each. Returns whether any bit is set.
    #[inline(always)]
    fn mask_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) -> bool {
        if width.is_multiple_of(32) {
            // All rows together are one long row.
            return self.mask_row(rows, mask);
        }
        self.mask_each_row(rows, width, mask)
    }

    /// [`mask_rows`](Self::mask_rows) row by row, for any width.
    #[inline(never)]
    fn mask_each_row(&self, rows: &[u16], width: u16, mask: &mut [u32]) -> bool {
        let rows = rows.chunks(self.row_length(width).max(1));
        let mut any = false;
        for (row, mask) in rows.zip(mask.chunks_exact_mut(words_of(width).max(1))) {
            any |= self.mask_row(row, mask);
        }
        any
    }

    /// Masks several rows as [`mask_rows`](Self::mask_rows) does, but sets the pixels that a marker
    /// covers at least half, at any light. Formats that cannot determine this use the threshold.
    fn mask_covered_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) {
        self.mask_rows(rows, width, mask);
    }

    /// Returns how much of a pixel of the row a marker covers, 0 to [`FULL_WEIGHT`] at most; 0
    /// beyond the row.
    fn weight(&self, row: &[u16], column: u16) -> u8;

    /// Returns the pull ([`Beside`](crate::markers::beside::Beside)) of a pixel of the row; 0
    /// beyond the row.
    #[inline(always)]
    fn pull(&self, row: &[u16], column: u16) -> u8 {
        beside::by_weight(self.weight(row, column))
    }

    /// Returns the pull of the pixels left and right of a run.
    #[inline(always)]
    fn beside(&self, row: &[u16], run: Run) -> [u8; 2] {
        let (left, right) = beside::columns(run);
        [
            left.map_or(0, |left| self.pull(row, left)),
            self.pull(row, right),
        ]
    }

    /// Returns the sum of the weights of a run's pixels.
    #[inline(never)]
    fn weigh(&self, row: &[u16], run: Run) -> Weights {
        let columns = (run.x0..=run.x1).map(|x| (u32::from(x), self.weight(row, x)));
        columns.fold(Weights::NONE, |sums, (x, weight)| sums.with(x, weight))
    }
}

/// No pixels: for rows that arrive as masks.
impl Pixels for () {
    fn row_length(&self, _: u16) -> usize {
        0
    }

    fn mask_row(&self, _: &[u16], mask: &mut [u32]) -> bool {
        mask.fill(0);
        false
    }

    fn weight(&self, _: &[u16], _: u16) -> u8 {
        0
    }
}

/// A table over all values of an RGB565 pixel, set to a threshold box.
pub trait Table: Pixels {
    /// A table that accepts no pixel, to be [`set`](Self::set) later: for a `static`.
    const CLOSED: Self;

    /// Compiles a box into this table, in place. It takes a few million instructions: call it once
    /// per setting, never per frame.
    ///
    /// # Errors
    /// Those of [`HsvBox::check`]; the table is then unchanged.
    fn set(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> Result<(), ThresholdError>;

    /// Returns whether a pixel passes; `raw` is its value in memory.
    fn accepts(&self, raw: u16) -> bool;
}

/// The largest weight. A pixel that a marker covers wholly has about 95.
pub const FULL_WEIGHT: u8 = 127;

/// Sums of weights over the pixels of one run.
/// With weights of at most 127 and columns below 800 they fit `u32`: Σw·x ≤ 127 · 800 · 799 / 2 <
/// 2²⁶.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Weights {
    /// Σw.
    pub sum: u32,
    /// Σw·x.
    pub sum_x: u32,
}

impl Weights {
    /// The sums of no pixels.
    pub const NONE: Weights = Weights { sum: 0, sum_x: 0 };

    /// Returns the sums with one more pixel, in column `x` < 800.
    pub const fn with(self, x: u32, weight: u8) -> Weights {
        Weights {
            sum: self.sum + weight as u32,
            sum_x: self.sum_x + weight as u32 * x,
        }
    }
}

/// Red below this, of 255, gives no weight: it is three levels of five bits.
const DARKEST_RED: u8 = 24;

/// Returns the redness of a pixel (red in bits 15–11): ⌊80·(2r − g − b)/r⌋ − 28 of 8-bit channels,
/// from 0 to [`FULL_WEIGHT`]. It is 0 for greys and for nearly black pixels: with three levels of
/// red or less the ratio is meaningless.
///
/// If film and marker are equally bright in red, as grey film and red tape are, (2r − g − b)/r
/// grows linearly with the part of a pixel that the marker covers. A ratio does not depend on the
/// light, so a gradient of light does not shift centroids; weights by a difference would.
/// Subtracting 28 removes the redness of a slightly warm film.
///
/// Root mean square error of centroids on rendered frames, px:
///
/// | weights | QVGA | 800×600 | QVGA, gradient of 60 % | 800×600, gradient |
/// |---|---|---|---|---|
/// | redness | 0.017 | 0.015 | 0.020 | 0.023 |
/// | r − (g + b)/2 | 0.030 | 0.035 | 0.10 | 0.14 |
/// | mask alone | 0.10 | 0.046 | | |
pub const fn redness(pixel: u16) -> u8 {
    let [red, green, blue] = rgb888(pixel);
    let excess = 2 * red as i32 - green as i32 - blue as i32;
    // The quotient is at most 160.
    if excess <= 0 || red < DARKEST_RED {
        return 0;
    }
    let weight = 80 * excess / red as i32 - 28;
    if weight <= 0 {
        0
    } else if weight >= FULL_WEIGHT as i32 {
        FULL_WEIGHT
    } else {
        weight as u8
    }
}

/// One byte for each `u16` as it lies in memory: bit 0 is set if its colour is inside the box, bits
/// 1–7 are its [`redness`]. 64 KiB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ByteTable {
    bytes: [u8; 65_536],
}

impl ByteTable {
    /// Returns the table of a box. Large: on a microcontroller, [`set`](Table::set) one in place.
    ///
    /// # Errors
    /// Those of [`HsvBox::check`].
    pub fn new(hsv_box: &HsvBox, order: ByteOrder) -> Result<ByteTable, ThresholdError> {
        let mut table = ByteTable::CLOSED;
        table.set(hsv_box, order)?;
        Ok(table)
    }

    /// Bit i of the result is bit 7 of the byte of pixel i, for up to four pixels.
    #[inline(always)]
    fn covered(&self, pixels: &[u16]) -> u32 {
        let mut bytes = [0; 4];
        let filled = bytes.iter_mut().zip(pixels);
        filled.for_each(|(byte, raw)| *byte = self.byte(*raw));
        // The factor's bit 28 − 7·i moves bit 8·i to bit 28 + i; no two terms meet.
        let tops = (u32::from_le_bytes(bytes) >> 7) & 0x0101_0101;
        tops.wrapping_mul(0x1020_4080) >> 28
    }

    /// Returns the byte of a pixel; `raw` is its value in memory.
    #[inline(always)]
    pub const fn byte(&self, raw: u16) -> u8 {
        self.bytes[raw as usize]
    }
}

impl Table for ByteTable {
    const CLOSED: ByteTable = ByteTable { bytes: [0; 65_536] };

    fn set(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> Result<(), ThresholdError> {
        hsv_box.check()?;
        for (raw, byte) in (0..=u16::MAX).zip(&mut self.bytes) {
            let pixel = order.pixel(raw);
            let inside = hsv_box.contains(Hsv::from_rgb565(pixel));
            *byte = redness(pixel) << 1 | u8::from(inside);
        }
        Ok(())
    }

    fn accepts(&self, raw: u16) -> bool {
        self.byte(raw) & 1 == 1
    }
}

impl Pixels for ByteTable {
    fn row_length(&self, width: u16) -> usize {
        usize::from(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool {
        threshold_bytes(&self.bytes, row, mask)
    }

    /// Tests bit 7 of a byte: weights of 64 and more, two thirds of that inside a marker.
    #[inline(never)]
    fn mask_covered_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) {
        let rows = rows.chunks(usize::from(width).max(1));
        for (row, mask) in rows.zip(mask.chunks_exact_mut(words_of(width).max(1))) {
            for (word, pixels) in mask.iter_mut().zip(row.chunks(32)) {
                let fours = pixels.chunks(4).rev();
                *word = fours.fold(0, |bits, four| bits << 4 | self.covered(four));
            }
        }
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        let raw = row.get(usize::from(column));
        raw.map_or(0, |raw| self.byte(*raw) >> 1)
    }

    #[inline(always)]
    fn weigh(&self, row: &[u16], run: Run) -> Weights {
        let (x0, x1) = (usize::from(run.x0), usize::from(run.x1));
        let pixels = match row.get(x0..x1 + 1) {
            Some(pixels) => pixels,
            None => row.get(x0..).unwrap_or_default(),
        };
        let [sum, sums] = weigh_bytes(&self.bytes, pixels);
        Weights {
            sum,
            // Σw·x = (x0 − 1)·Σw + Σw·(x − x0 + 1).
            sum_x: u32::from(run.x0) * sum + sums - sum,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{boxed::Box, vec};

    const GREEN: HsvBox = HsvBox {
        hue_low: 50,
        hue_high: 70,
        ..HsvBox::RED
    };

    #[test]
    fn the_table_says_what_the_box_and_the_colour_say() {
        for (hsv_box, order) in [
            (HsvBox::RED, ByteOrder::Native),
            (HsvBox::RED, ByteOrder::Swapped),
            (GREEN, ByteOrder::Swapped),
        ] {
            let table = Box::new(ByteTable::new(&hsv_box, order).unwrap());
            for raw in 0..=u16::MAX {
                let pixel = order.pixel(raw);
                let inside = hsv_box.contains(Hsv::from_rgb565(pixel));
                assert_eq!(table.accepts(raw), inside, "{raw:04x}");
                assert_eq!(table.weight(&[raw], 0), redness(pixel), "{raw:04x}");
            }
        }
    }

    #[test]
    fn weights_are_redness_and_none_for_greys() {
        assert_eq!(redness(0xf800), FULL_WEIGHT);
        for level in 0..32_u16 {
            assert_eq!(redness(level << 11 | level << 6 | level), 0, "{level}");
        }
        assert_eq!(redness(0x07ff), 0, "cyan");
    }

    #[test]
    fn a_closed_table_accepts_nothing() {
        let mut mask = [u32::MAX; 2];
        ByteTable::CLOSED.mask_row(&[0xf800; 40], &mut mask);
        assert_eq!(mask, [0; 2]);
    }

    #[test]
    fn a_wrong_box_changes_nothing() {
        let wrong = HsvBox {
            hue_low: 180,
            ..HsvBox::RED
        };
        let mut table = Box::new(ByteTable::new(&HsvBox::RED, ByteOrder::Native).unwrap());
        let before = table.clone();
        assert!(table.set(&wrong, ByteOrder::Swapped).is_err());
        assert!(table == before);
    }

    proptest! {
        #[test]
        fn masks_and_sums_are_those_of_the_pixels(
            row in prop::collection::vec(any::<u16>(), 1..=800),
            a in 0..800_u16,
            b in 0..800_u16,
        ) {
            std::thread_local!(static TABLE: Box<ByteTable> =
                Box::new(ByteTable::new(&HsvBox::RED, ByteOrder::Swapped).unwrap()));
            TABLE.with(|table| {
                let mut mask = vec![u32::MAX; row.len().div_ceil(32)];
                table.mask_row(&row, &mut mask);
                let bit = |x: usize| mask[x / 32] >> (x % 32) & 1 == 1;
                for (x, &raw) in row.iter().enumerate() {
                    prop_assert_eq!(bit(x), table.accepts(raw));
                }
                prop_assert!((row.len()..32 * mask.len()).all(|x| !bit(x)), "beyond the row");
                let run = Run { x0: a.min(b), x1: a.max(b) };
                let sums = table.weigh(&row, run);
                let columns = usize::from(run.x0)..(usize::from(run.x1) + 1).min(row.len());
                let weights = columns.map(|x| (x as u32, u32::from(redness(row[x].swap_bytes()))));
                let width = row.len() as u16;
                table.mask_covered_rows(&row, width, &mut mask);
                for (x, &raw) in row.iter().enumerate() {
                    let bit = mask[x / 32] >> (x % 32) & 1 == 1;
                    prop_assert_eq!(bit, redness(raw.swap_bytes()) >= 64);
                }
                let (sum, sum_x) = weights.fold((0, 0), |(s, sx), (x, w)| (s + w, sx + w * x));
                prop_assert_eq!((sums.sum, sums.sum_x), (sum, sum_x));
                Ok(())
            })?;
        }
    }
}
