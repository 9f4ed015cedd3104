//! Replaces each mask bit by the majority of its 3×3 pixels, as rows arrive. Specks and holes of up
//! to four pixels vanish, and edges stay in place.
//!
//! An opening removes specks, too, but not those that touch a flat part of a marker's edge, and it
//! widens holes. Pixels outside the frame count as unset.

use crate::markers::mask::{MAX_WORDS, any_set, last_word_bits, words_of};

/// The two rows before the next one, and the number of pixels changed so far.
#[derive(Clone, Debug)]
pub struct Majority {
    rows: [[u32; MAX_WORDS]; 2],
    specks: u32,
    holes: u32,
}

impl Majority {
    /// A filter before its first frame.
    pub const fn new() -> Majority {
        Majority {
            rows: [[0; MAX_WORDS]; 2],
            specks: 0,
            holes: 0,
        }
    }

    /// Starts a frame.
    pub fn begin(&mut self) {
        *self = Majority::new();
    }

    /// Number of set pixels of the frame that were cleared.
    pub fn specks(&self) -> u32 {
        self.specks
    }

    /// Number of unset pixels of the frame that were set.
    pub fn holes(&self) -> u32 {
        self.holes
    }

    /// Replaces incoming rows of `width` pixels: each becomes the filtered row above it. Returns
    /// whether any pixel is set.
    #[inline(never)]
    pub fn filter(&mut self, rows: &mut [u32], width: u16) -> bool {
        let mut any = false;
        for row in rows.chunks_exact_mut(words_of(width).max(1)) {
            let mut raw = [0; MAX_WORDS];
            let filled = raw.iter_mut().zip(row.iter());
            filled.for_each(|(raw, word)| *raw = *word);
            let [above, middle] = &self.rows;
            if any_set(above) || any_set(middle) || any_set(&raw) {
                majority_row(above, middle, &raw, row);
                if let Some(word) = row.last_mut() {
                    *word &= last_word_bits(width);
                }
                any |= any_set(row);
                for (before, after) in middle.iter().zip(row.iter()) {
                    self.specks += (before & !after).count_ones();
                    self.holes += (!before & after).count_ones();
                }
            }
            let [above, middle] = &mut self.rows;
            *above = *middle;
            *middle = raw;
        }
        any
    }
}

/// Number of set pixels of each column's three, in two bits for each column of a word.
#[derive(Clone, Copy, Default)]
struct Sums {
    ones: u32,
    twos: u32,
}

/// Adds three numbers bit by bit; returns the bits of the sum and the carries.
fn added(a: u32, b: u32, c: u32) -> (u32, u32) {
    (a ^ b ^ c, (a & b) | (c & (a ^ b)))
}

/// The columns' sums, as seen one column to the right.
fn moved(left: Sums, word: Sums) -> Sums {
    Sums {
        ones: word.ones << 1 | left.ones >> 31,
        twos: word.twos << 1 | left.twos >> 31,
    }
}

/// The columns' sums, as seen one column to the left.
fn moved_back(word: Sums, right: Sums) -> Sums {
    Sums {
        ones: word.ones >> 1 | right.ones << 31,
        twos: word.twos >> 1 | right.twos << 31,
    }
}

fn majority_row(
    above: &[u32; MAX_WORDS],
    middle: &[u32; MAX_WORDS],
    below: &[u32; MAX_WORDS],
    row: &mut [u32],
) {
    let rows = above.iter().zip(middle).zip(below);
    let mut sums = rows.map(|((above, middle), below)| {
        let (ones, twos) = added(*above, *middle, *below);
        Sums { ones, twos }
    });
    let (mut left, mut word) = (Sums::default(), sums.next().unwrap_or_default());
    for out in row {
        let right = sums.next().unwrap_or_default();
        let (before, after) = (moved(left, word), moved_back(word, right));
        // p in two bits, and q, which counts twice, in two bits: p + 2·q ≥ 5.
        let (p0, p1) = added(before.ones, word.ones, after.ones);
        let (q0, q1) = added(before.twos, word.twos, after.twos);
        *out = (q1 & (q0 | p0 | p1)) | (q0 & p0 & p1);
        (left, word) = (word, right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{vec, vec::Vec};

    const WIDTH: usize = 75;
    const WORDS: usize = 3;
    const LAST: u32 = (1 << (WIDTH - 64)) - 1;

    fn pixel_by_pixel(rows: &[[u32; WORDS]]) -> Vec<[u32; WORDS]> {
        let set = |x: i32, y: i32| {
            let inside = (0..WIDTH as i32).contains(&x) && (0..rows.len() as i32).contains(&y);
            inside && rows[y as usize][x as usize / 32] >> (x % 32) & 1 == 1
        };
        let mut out = vec![[0; WORDS]; rows.len()];
        for y in 0..rows.len() as i32 {
            for x in 0..WIDTH as i32 {
                let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
                if around.filter(|(x, y)| set(*x, *y)).count() >= 5 {
                    out[y as usize][x as usize / 32] |= 1 << (x % 32);
                }
            }
        }
        out
    }

    /// Words with few pixels and with many.
    fn word() -> impl Strategy<Value = u32> {
        prop_oneof![
            any::<u32>(),
            (any::<u32>(), any::<u32>()).prop_map(|(a, b)| a | b),
            Just(0),
            Just(u32::MAX)
        ]
    }

    proptest! {
        #[test]
        fn rows_are_those_counted_pixel_by_pixel(
            mut rows in prop::collection::vec([word(), word(), word()], 1..12),
            at_a_time in 1..5_usize,
        ) {
            rows.iter_mut().for_each(|row| row[2] &= LAST);
            let expected = pixel_by_pixel(&rows);
            let mut filtered: Vec<u32> = rows.iter().flatten().copied().chain([0; WORDS]).collect();
            let mut majority = Majority::new();
            majority.begin();
            for band in filtered.chunks_mut(at_a_time * WORDS) {
                let any = majority.filter(band, WIDTH as u16);
                prop_assert_eq!(any, band.iter().any(|word| *word != 0));
            }
            // A row comes out with the one below it; the row above the first is empty.
            prop_assert_eq!(&filtered[..WORDS], &[0; WORDS]);
            let found: Vec<[u32; WORDS]> = filtered[WORDS..].as_chunks().0.to_vec();
            prop_assert_eq!(found, expected);
        }
    }
}
