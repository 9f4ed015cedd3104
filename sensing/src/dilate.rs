//! 3×3 dilation, zero to three times, row by row.
//!
//! n dilations by 3×3 are one by a square of 2n + 1: first along the row, then over the last 2n + 1 rows. As with
//! OpenCV's default border, what lies outside the frame counts as unset.

use crate::mask::{EMPTY_ROW, MaskRow, last_word_bits};

/// Most dilations.
pub const MAX_DILATIONS: u8 = 3;
/// Rows that the tallest square covers.
const RING: usize = 2 * MAX_DILATIONS as usize + 1;

/// The rows that the next output still needs, dilated along the row: a ring of 2n + 1.
#[derive(Clone, Debug)]
pub struct Dilation {
    ring: [MaskRow; RING],
    /// The row that goes out.
    out: MaskRow,
    /// Which rows of the ring have a set bit.
    occupied: [bool; RING],
    /// n.
    radius: u8,
    width: u16,
    /// Where the next row goes.
    next: usize,
    /// Rows still to come in before the first goes out.
    delay: u8,
}

impl Dilation {
    /// For no frame yet.
    pub const fn new() -> Dilation {
        Dilation {
            ring: [EMPTY_ROW; RING],
            out: EMPTY_ROW,
            occupied: [false; RING],
            radius: 0,
            width: 1,
            next: 0,
            delay: 0,
        }
    }

    /// Starts a frame of rows of `width` pixels with `dilations` ≤ [`MAX_DILATIONS`] dilations.
    pub fn begin(&mut self, width: u16, dilations: u8) {
        *self = Dilation {
            radius: dilations.min(MAX_DILATIONS),
            width,
            delay: dilations.min(MAX_DILATIONS),
            ..Dilation::new()
        };
    }

    /// Rows that [`push`](Self::push) is behind: as many empty ones bring out the last.
    pub fn radius(&self) -> u8 {
        self.radius
    }

    /// Takes the next row, ⌈width / 32⌉ words, and gives the row that lies [`radius`](Self::radius) rows above it, dilated;
    /// `None` while there is none yet.
    pub fn push(&mut self, row: &[u32]) -> Option<&[u32]> {
        self.store(row);
        if self.delay > 0 {
            self.delay -= 1;
            return None;
        }
        Some(self.combine(row.len()))
    }

    /// Dilates a row along itself into the ring.
    fn store(&mut self, row: &[u32]) {
        let occupied = row.iter().any(|word| *word != 0);
        self.occupied[self.next] = occupied;
        if occupied {
            let stored = &mut self.ring[self.next][..row.len()];
            spread(row, self.radius, stored);
            if let Some(last) = stored.last_mut() {
                *last &= last_word_bits(self.width);
            }
        }
        self.next = (self.next + 1) % self.height();
    }

    /// The ring's occupied rows of so many words, one over the other.
    fn combine(&mut self, words: usize) -> &[u32] {
        let height = self.height();
        let out = &mut self.out[..words];
        out.fill(0);
        let rows = self.ring.iter().zip(self.occupied).take(height);
        for (row, _) in rows.filter(|(_, occupied)| *occupied) {
            for (to, from) in out.iter_mut().zip(row) {
                *to |= from;
            }
        }
        out
    }

    fn height(&self) -> usize {
        2 * usize::from(self.radius) + 1
    }
}

/// Sets every bit within `radius` < 32 columns of a set one.
fn spread(row: &[u32], radius: u8, out: &mut [u32]) {
    let mut left = 0;
    for (i, to) in out.iter_mut().enumerate() {
        let word = row[i];
        let right = row.get(i + 1).copied().unwrap_or(0);
        *to = if left | word | right == 0 {
            0
        } else {
            spread_word(left, word, right, radius)
        };
        left = word;
    }
}

/// One word of [`spread`], given its neighbours.
fn spread_word(left: u32, word: u32, right: u32, radius: u8) -> u32 {
    let rightwards = u64::from(word) << 32 | u64::from(left);
    let leftwards = u64::from(right) << 32 | u64::from(word);
    (1..=u32::from(radius)).fold(word, |bits, shift| {
        bits | (rightwards << shift >> 32) as u32 | (leftwards >> shift) as u32
    })
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    const WIDTH: u16 = 75;
    const HEIGHT: usize = 40;

    /// A mask and the same after one, two and three dilations by OpenCV (`tests/opencv/reference.py`).
    const OPENCV: &[u8; 4 * HEIGHT * 12] = include_bytes!("../tests/opencv/dilated.bits");

    fn opencv(dilations: u8) -> Vec<[u32; 3]> {
        let mask = OPENCV.chunks_exact(HEIGHT * 12).nth(usize::from(dilations));
        let word = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().unwrap());
        let row = |bytes: &[u8]| [0, 4, 8].map(|i| word(&bytes[i..i + 4]));
        mask.unwrap().chunks_exact(12).map(row).collect()
    }

    fn dilated(rows: &[[u32; 3]], dilations: u8) -> Vec<[u32; 3]> {
        let mut dilation = Dilation::new();
        dilation.begin(WIDTH, dilations);
        let below = std::iter::repeat_n(&[0; 3], usize::from(dilations));
        let rows = rows.iter().chain(below);
        let rows = rows.filter_map(|row| dilation.push(row).map(|out| out.try_into().unwrap()));
        rows.collect()
    }

    #[test]
    fn masks_equal_opencv() {
        for dilations in 0..=MAX_DILATIONS {
            assert_eq!(
                dilated(&opencv(0), dilations),
                opencv(dilations),
                "{dilations}"
            );
        }
    }

    #[test]
    fn frames_lower_than_the_square_come_out_whole() {
        for dilations in 0..=MAX_DILATIONS {
            for height in 0..4 {
                let rows = dilated(&opencv(0)[..height], dilations);
                assert_eq!(rows.len(), height);
            }
        }
    }
}
