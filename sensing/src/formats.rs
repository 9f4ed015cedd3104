//! How rows of YUV422 and mono pixels are read. Neither needs a table.
//!
//! A [`Scanner`](crate::scanner::Scanner) takes them as it takes a table's RGB565; the model file and
//! [`Settings`](crate::settings::Settings) know RGB565 only.

use crate::tables::{FULL_WEIGHT, Pixels};

/// Weight of a pixel at a threshold: half covered. A level more or less is worth two.
const AT_THRESHOLD: i16 = 64;

/// YUV422 in the order Y0 Cb Y1 Cr: a `u16` a pixel, luma below. A pair of pixels belongs to a marker when their Cr is
/// at least the threshold. A pixel's weight grows by two for each level of Cr, from 64 at the threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Yuv422 {
    /// Lowest Cr of a marker: about half way between the film's (132) and its (191).
    pub cr_low: u8,
}

/// Mono: two pixels a `u16`, the left one below. A pixel belongs to a marker when its luma lies within the limits, both
/// included. Its weight grows by two for each level that it lies inside the nearer limit, from 64 there; a limit of 0
/// or 255 is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Mono {
    /// Lowest luma of a marker.
    pub low: u8,
    /// Highest luma of a marker: half way to the film's. Red markers are dark in green light (36 against the
    /// film's 141), and hardly darker than the film in white light.
    pub high: u8,
}

fn weight_inside(levels: i16) -> u8 {
    (AT_THRESHOLD + 2 * levels).clamp(0, i16::from(FULL_WEIGHT)) as u8
}

impl Pixels for Yuv422 {
    /// Rows of an odd width end within a pair: its last pixel has no Cr, and is none of a marker.
    fn row_length(&self, width: u16) -> usize {
        usize::from(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) {
        for (word, pixels) in mask.iter_mut().zip(row.chunks(32)) {
            *word = (0..)
                .zip(pixels.chunks_exact(2))
                .fold(0, |bits, (i, pair)| {
                    let inside = (pair[1] >> 8) as u8 >= self.cr_low;
                    bits | (3 * u32::from(inside)) << (2 * i)
                });
        }
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        let pixel = row.get(usize::from(column | 1));
        pixel.map_or(0, |pixel| {
            weight_inside((pixel >> 8) as i16 - i16::from(self.cr_low))
        })
    }
}

impl Mono {
    /// How far inside the nearer limit, in levels; below 0 outside.
    fn depth(&self, luma: u8) -> i16 {
        let luma = i16::from(luma);
        let above = match self.low {
            0 => i16::MAX / 4,
            low => luma - i16::from(low),
        };
        let below = match self.high {
            255 => i16::MAX / 4,
            high => i16::from(high) - luma,
        };
        above.min(below)
    }
}

impl Pixels for Mono {
    /// Rows have an even width: a `u16` holds two pixels, and a last one alone would leave a half that is none.
    fn row_length(&self, width: u16) -> usize {
        usize::from(width.div_ceil(2))
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) {
        for (word, pairs) in mask.iter_mut().zip(row.chunks(16)) {
            *word = (0..).zip(pairs).fold(0, |bits, (i, pair)| {
                let [left, right] = pair.to_le_bytes();
                let [left, right] = [left, right].map(|luma| u32::from(self.depth(luma) >= 0));
                bits | (left | right << 1) << (2 * i)
            });
        }
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        let pair = row.get(usize::from(column / 2));
        pair.map_or(0, |pair| {
            let luma = pair.to_le_bytes()[usize::from(column % 2)];
            weight_inside(self.depth(luma))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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

    #[test]
    fn weights_grow_with_what_is_covered() {
        let cr = |cr: u16| Yuv422 { cr_low: 160 }.weight(&[0, cr << 8], 0);
        assert_eq!([120, 150, 160, 180, 250].map(cr), [0, 44, 64, 104, 127]);
        let mono = |luma: u16| Mono { low: 0, high: 108 }.weight(&[luma], 0);
        assert_eq!([0, 80, 108, 130, 200].map(mono), [127, 120, 64, 20, 0]);
        assert_eq!(
            Mono { low: 9, high: 255 }.weight(&[7], 5),
            0,
            "beyond the row"
        );
    }
}
