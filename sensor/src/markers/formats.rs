//! Reads rows of each pixel format: RGB565 through a table, YUV422 and mono directly.

use crate::markers::beside;
use crate::markers::kernels::{threshold_cr, threshold_luma, weigh_luma};
use crate::markers::runs::Run;
use crate::markers::tables::{FULL_WEIGHT, Pixels, Table, Weights};
use hivtac_terms::fixed::Q;
use hivtac_terms::threshold::{
    ByteOrder, HsvBox, Mono, PixelFormat, Threshold, ThresholdError, Yuv422,
};

/// Weight of a pixel at the threshold: half covered.
const AT_THRESHOLD: i16 = 64;

/// Reads rows in the format of a [`Threshold`]. Only RGB565 uses the table `T`.
#[derive(Clone, Debug)]
pub struct Formats<T> {
    table: T,
    threshold: Threshold,
    /// The weight of each luma, if pixels are mono.
    luma: [u8; 256],
    /// The lowest bit of red in an RGB565 pixel as it lies in memory.
    red: u8,
}

impl<T: Table> Formats<T> {
    /// Accepts no pixel until [`set`](Self::set).
    pub const CLOSED: Formats<T> = Formats {
        table: T::CLOSED,
        threshold: Threshold::Rgb565(HsvBox::RED),
        luma: [0; 256],
        red: 11,
    };

    /// Sets format and threshold. The byte order applies to RGB565 only; other formats have only
    /// one.
    ///
    /// # Errors
    /// Those of [`Threshold::check`]; then nothing is changed.
    pub fn set(&mut self, threshold: &Threshold, order: ByteOrder) -> Result<(), ThresholdError> {
        threshold.check()?;
        if let Threshold::Rgb565(hsv_box) = threshold {
            self.table.set(hsv_box, order)?;
            self.red = match order {
                ByteOrder::Native => 11,
                ByteOrder::Swapped => 3,
            };
        }
        if let Threshold::Mono(mono) = threshold {
            for (luma, weight) in (0..=u8::MAX).zip(&mut self.luma) {
                *weight = weight_of(mono, luma);
            }
        }
        self.threshold = *threshold;
        Ok(())
    }

    /// The weights of a run of mono pixels, equal to those of [`Mono`].
    #[inline(always)]
    fn weigh_mono(&self, row: &[u16], run: Run) -> Weights {
        let beyond = (usize::from(run.x1) + 1).min(2 * row.len());
        let first = usize::from(run.x0).min(beyond);
        let [sum, sums] = weigh_luma(&self.luma, row, first..beyond);
        Weights {
            sum,
            // Σw·x = (x0 − 1)·Σw + Σw·(x − x0 + 1).
            sum_x: u32::from(run.x0) * sum + sums - sum,
        }
    }

    /// The pull of an RGB565 pixel.
    #[inline(always)]
    fn pull_rgb565(&self, row: &[u16], column: u16) -> u8 {
        let Some(raw) = row.get(usize::from(column)) else {
            return 0;
        };
        beside::pull(self.table.weight(row, column), raw >> (self.red % 16))
    }

    /// The threshold in use.
    pub fn threshold(&self) -> &Threshold {
        &self.threshold
    }
}

impl<T: Table> Pixels for Formats<T> {
    fn row_length(&self, width: u16) -> usize {
        self.threshold.format().row_length(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool {
        match &self.threshold {
            Threshold::Rgb565(_) => self.table.mask_row(row, mask),
            Threshold::Yuv422(yuv422) => yuv422.mask_row(row, mask),
            Threshold::Mono(mono) => mono.mask_row(row, mask),
        }
    }

    fn mask_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) -> bool {
        match &self.threshold {
            Threshold::Rgb565(_) => self.table.mask_rows(rows, width, mask),
            Threshold::Yuv422(yuv422) => yuv422.mask_rows(rows, width, mask),
            Threshold::Mono(mono) => mono.mask_rows(rows, width, mask),
        }
    }

    fn mask_covered_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) {
        match &self.threshold {
            Threshold::Rgb565(_) => self.table.mask_covered_rows(rows, width, mask),
            Threshold::Yuv422(yuv422) => yuv422.mask_covered_rows(rows, width, mask),
            Threshold::Mono(mono) => mono.mask_covered_rows(rows, width, mask),
        }
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        match &self.threshold {
            Threshold::Rgb565(_) => self.table.weight(row, column),
            Threshold::Yuv422(yuv422) => yuv422.weight(row, column),
            Threshold::Mono(mono) => mono.weight(row, column),
        }
    }

    #[inline(always)]
    fn beside(&self, row: &[u16], run: Run) -> [u8; 2] {
        match &self.threshold {
            Threshold::Rgb565(_) => {
                let (left, right) = beside::columns(run);
                let left = left.map_or(0, |left| self.pull_rgb565(row, left));
                [left, self.pull_rgb565(row, right)]
            }
            Threshold::Yuv422(yuv422) => yuv422.beside(row, run),
            Threshold::Mono(mono) => mono.beside(row, run),
        }
    }

    #[inline(always)]
    fn weigh(&self, row: &[u16], run: Run) -> Weights {
        match &self.threshold {
            Threshold::Rgb565(_) => self.table.weigh(row, run),
            Threshold::Yuv422(yuv422) => yuv422.weigh(row, run),
            Threshold::Mono(_) => self.weigh_mono(row, run),
        }
    }
}

/// Additional weight per level of Cr inside the threshold: 2.
const PER_CR: Q<2, i16> = Q::from_bits(8);
/// Additional weight per level of luma: 5/4.
const PER_LUMA: Q<2, i16> = Q::from_bits(5);

/// The weight of a pixel inside a threshold: that of a pixel at the threshold plus `more`.
fn weight_inside(more: Q<2, i16>) -> u8 {
    (AT_THRESHOLD + more.floor()).clamp(0, i16::from(FULL_WEIGHT)) as u8
}

impl Pixels for Yuv422 {
    /// A row of odd width ends within a pair. Its last pixel has no Cr, and never belongs to a
    /// marker.
    fn row_length(&self, width: u16) -> usize {
        PixelFormat::Yuv422.row_length(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool {
        threshold_cr(self.cr_low, row, mask)
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        let pixel = row.get(usize::from(column | 1));
        pixel.map_or(0, |pixel| {
            weight_inside(PER_CR * ((pixel >> 8) as i16 - i16::from(self.cr_low)))
        })
    }

    /// Weighs whole pairs. A dilation covers only one pixel of every other pair, and half of its Cr
    /// would shift the centroid. Two runs of a dilated row never share a pair, because a pair
    /// passes the threshold as a whole.
    fn weigh(&self, row: &[u16], run: Run) -> Weights {
        let columns = run.x0 & !1..=run.x1 | 1;
        columns.fold(Weights::NONE, |sums, x| {
            sums.with(u32::from(x), self.weight(row, x))
        })
    }
}

/// The weight of a pixel of a luma.
fn weight_of(mono: &Mono, luma: u8) -> u8 {
    weight_inside(PER_LUMA * depth(mono, luma))
}

/// How far a luma is inside the nearer limit, in levels; negative outside.
fn depth(mono: &Mono, luma: u8) -> i16 {
    let luma = i16::from(luma);
    let above = match mono.low {
        0 => i16::MAX / 8,
        low => luma - i16::from(low),
    };
    let below = match mono.high {
        255 => i16::MAX / 8,
        high => i16::from(high) - luma,
    };
    above.min(below)
}

impl Pixels for Mono {
    /// The width must be even: a `u16` holds two pixels, and half of the last one would not be a
    /// pixel.
    fn row_length(&self, width: u16) -> usize {
        PixelFormat::Mono.row_length(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool {
        let Some(span) = self.high.checked_sub(self.low) else {
            mask.fill(0);
            return false;
        };
        threshold_luma(self.low, span, row, mask)
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        let pair = row.get(usize::from(column / 2));
        pair.map_or(0, |pair| {
            weight_of(self, pair.to_le_bytes()[usize::from(column % 2)])
        })
    }

    /// Nothing: without colour a film in uneven light looks like one that something shows through.
    fn beside(&self, _: &[u16], _: Run) -> [u8; 2] {
        [0; 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::markers::tables::ByteTable;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    fn mask(pixels: &impl Pixels, row: &[u16], width: usize) -> Vec<bool> {
        let mut words = vec![u32::MAX; width.div_ceil(32)];
        pixels.mask_row(row, &mut words);
        let bit = |x: usize| words[x / 32] >> (x % 32) & 1 == 1;
        assert!((width..32 * words.len()).all(|x| !bit(x)), "beyond the row");
        (0..width).map(bit).collect()
    }

    proptest! {
        #[test]
        fn a_pair_is_set_when_its_cr_is_high(
            row in prop::collection::vec(any::<u16>(), 1..400).prop_map(|half| half.repeat(2)),
            cr_low in any::<u8>(),
        ) {
            let found = mask(&Yuv422 { cr_low }, &row, row.len());
            for (x, found) in found.into_iter().enumerate() {
                let [_, cr] = row[x | 1].to_le_bytes();
                prop_assert_eq!(found, cr >= cr_low);
                let weight = Yuv422 { cr_low }.weight(&row, x as u16);
                prop_assert_eq!(found, weight >= 64);
            }
        }

        #[test]
        fn a_mono_pixel_is_set_within_the_limits(
            row in prop::collection::vec(any::<u16>(), 1..=400),
            low in any::<u8>(),
            high in any::<u8>(),
        ) {
            let mono = Mono { low, high };
            let found = mask(&mono, &row, 2 * row.len());
            for (x, found) in found.into_iter().enumerate() {
                let luma = row[x / 2].to_le_bytes()[x % 2];
                prop_assert_eq!(found, (low..=high).contains(&luma));
                prop_assert_eq!(found, mono.weight(&row, x as u16) >= 64);
            }
        }
    }

    proptest! {
        /// The table of weights gives a run the weight of its pixels, also if it ends beyond the
        /// row.
        #[test]
        fn mono_runs_are_weighed_as_their_pixels(
            row in prop::collection::vec(any::<u16>(), 1..=400),
            low in any::<u8>(),
            high in any::<u8>(),
            a in 0..800_u16,
            b in 0..800_u16,
        ) {
            let mono = Mono { low: low.min(high), high: low.max(high) };
            let mut formats = Formats::<ByteTable>::CLOSED;
            formats.set(&Threshold::Mono(mono), ByteOrder::Native).unwrap();
            let run = Run { x0: a.min(b), x1: a.max(b) };
            prop_assert_eq!(formats.weigh(&row, run), mono.weigh(&row, run));
        }
    }

    #[test]
    fn pairs_are_weighed_as_a_whole() {
        let row = [0, 200 << 8, 0, 150 << 8, 0, 162 << 8, 0, 90 << 8];
        let weigh = |x0, x1| Yuv422::RED.weigh(&row, Run { x0, x1 });
        assert_eq!(weigh(1, 4), weigh(0, 5));
        // 64 + 2 · 38 exceeds the largest weight.
        let (first, second, third) = (127, 64 - 2 * 12, 64);
        let sum_x = first + second * (2 + 3) + third * (4 + 5);
        let sum = 2 * (first + second + third);
        assert_eq!(weigh(1, 4), Weights { sum, sum_x });
    }

    #[test]
    fn weights_grow_with_what_is_covered() {
        let cr = |cr: u16| Yuv422 { cr_low: 160 }.weight(&[0, cr << 8], 0);
        assert_eq!([120, 150, 160, 180, 250].map(cr), [0, 44, 64, 104, 127]);
        let mono = |luma: u16| Mono { low: 0, high: 88 }.weight(&[luma], 0);
        assert_eq!(
            [0, 36, 87, 88, 89, 141].map(mono),
            [127, 127, 65, 64, 62, 0]
        );
        assert_eq!(
            Mono { low: 9, high: 255 }.weight(&[7], 5),
            0,
            "beyond the row"
        );
    }
}
