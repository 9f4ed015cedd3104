//! Dilates the mask by 3×3, zero to three times, as rows arrive.
//!
//! n dilations by 3×3 equal one by a square of 2n + 1 pixels: the last 2n + 1 rows or-ed, then
//! spread along the row. As with OpenCV's default border, pixels outside the frame count as unset.
//!
//! Most rows of a frame are empty, and most words of the others. So rows are taken several at a
//! time, and only words near a set word of any of them are looked at again.

#[cfg(armv7em)]
use crate::markers::kernels::dilate_edges;
use crate::markers::mask::{MAX_WORDS, Near, last_word_bits, words_of};
use crate::markers::runs::Edges;

/// Most dilations.
pub const MAX_DILATIONS: u8 = 3;
/// Most rows that are taken at a time.
pub const MAX_ROWS: usize = 8;
/// Most earlier rows that are still needed.
const MAX_KEPT: usize = 2 * MAX_DILATIONS as usize;

/// The rows that the next output still needs.
#[derive(Clone, Debug)]
pub struct Dilation {
    /// The last 2n rows, followed by the incoming ones: ⌈width / 32⌉ words each.
    mask: [u32; (MAX_KEPT + MAX_ROWS) * MAX_WORDS],
    /// Bit i is set if one of these rows may have a set bit in word i.
    occupied: u32,
    /// Bit i is set if row i of these has a set bit.
    set_rows: u32,
    /// n.
    radius: u8,
    width: u16,
    /// ⌈width / 32⌉.
    words: usize,
}

impl Dilation {
    /// A dilation before its first frame.
    pub const fn new() -> Dilation {
        Dilation {
            mask: [0; (MAX_KEPT + MAX_ROWS) * MAX_WORDS],
            occupied: 0,
            set_rows: 0,
            radius: 0,
            width: 1,
            words: 1,
        }
    }

    /// Starts a frame of rows of `width` pixels with `dilations` ≤ [`MAX_DILATIONS`] dilations.
    pub fn begin(&mut self, width: u16, dilations: u8) {
        self.radius = dilations.min(MAX_DILATIONS);
        self.width = width;
        self.words = words_of(width);
        self.occupied = 0;
        self.set_rows = 0;
        let kept = self.kept();
        if let Some(kept) = self.mask.get_mut(..kept) {
            kept.fill(0);
        }
    }

    /// Number of rows by which the output lags; as many empty rows flush the last output.
    pub fn radius(&self) -> u8 {
        self.radius
    }

    /// Returns the place for the next `rows` ≤ [`MAX_ROWS`] rows. All of their words must be
    /// written before they are [looked at](Self::look). Bits beyond the width must be unset.
    #[inline(always)]
    pub fn incoming(&mut self, rows: usize) -> &mut [u32] {
        let kept = self.kept();
        let incoming = self.mask.get_mut(kept..).unwrap_or_default();
        incoming.get_mut(..rows * self.words).unwrap_or_default()
    }

    /// Looks at the rows that were written. Needed only if one of them has a set bit.
    pub fn look(&mut self, rows: usize) {
        let row_words = self.words.max(1);
        let (mut occupied, mut set_rows) = (0, 0);
        for (y, row) in self.incoming(rows).chunks_exact(row_words).enumerate() {
            // Leading zeros are 32 only for an empty word, so this loop has no branch.
            let shift_in = |empty, word: &u32| empty << 1 | word.leading_zeros() >> 5;
            let (first, pairs) = row.as_rchunks::<2>();
            let empty = pairs.iter().rev().fold(u32::MAX, |empty, [left, right]| {
                shift_in(shift_in(empty, right), left)
            });
            let in_row = !first.iter().fold(empty, shift_in);
            occupied |= in_row;
            set_rows |= u32::from(in_row != 0) << y;
        }
        self.occupied |= occupied;
        self.set_rows |= set_rows << self.kept_rows();
    }

    /// Returns whether all rows that are still needed are empty.
    pub fn is_empty(&self) -> bool {
        self.set_rows == 0
    }

    /// Returns whether the dilated row of [`edges`](Self::edges) at `i` is empty.
    #[inline(always)]
    pub fn is_empty_row(&self, i: usize) -> bool {
        (self.set_rows >> i) & ((2 << self.kept_rows()) - 1) == 0
    }

    /// Finds the edges of a dilated row: the one that is [`radius`](Self::radius) rows above row
    /// `i` of those that were written. `near` is the result of [`near`](Self::near).
    #[inline(always)]
    pub fn edges(&self, i: usize, near: &Near, edges: &mut Edges) {
        #[cfg(armv7em)]
        if self.radius == 1 {
            let rows = self.mask.get(i * self.words + near.first..);
            let rows = rows.unwrap_or_default();
            edges.fill(|edges| dilate_edges(rows, self.words, near, edges));
            return edges.end(32 * self.words as u16);
        }
        edges.clear();
        self.spread(i, near, edges);
    }

    /// The edges of dilated row `i` within the words `near`.
    fn spread(&self, i: usize, near: &Near, edges: &mut Edges) {
        let rows = self.mask.get(i * self.words..).unwrap_or_default();
        let rows = rows.chunks_exact(self.words.max(1));
        let mut columns = [0; MAX_WORDS];
        let columns = columns.get_mut(..near.words).unwrap_or_default();
        for row in rows.take(2 * usize::from(self.radius) + 1) {
            let row = row.get(near.first..).unwrap_or_default();
            let all = columns.iter_mut().zip(row);
            all.for_each(|(all, word)| *all |= word);
        }
        let mut left = 0;
        for (i, &word) in columns.iter().enumerate() {
            let right = columns.get(i + 1).copied().unwrap_or(0);
            if left | word | right != 0 {
                let spread = spread_word(left, word, right, self.radius);
                let inside = if i + 1 < near.words {
                    u32::MAX
                } else {
                    near.last
                };
                edges.take(32 * (near.first + i) as u16, spread & inside);
            }
            left = word;
        }
        edges.end(32 * self.words as u16);
    }

    /// Returns how many pixels of a run of dilated row `i` were set before dilation. The run is
    /// given by its first column and the one behind its last.
    #[inline(always)]
    pub fn passed(&self, i: usize, [x0, end]: [u16; 2]) -> u32 {
        let first = (i + usize::from(self.radius)) * self.words + usize::from(x0 / 32);
        let columns = u32::from(end).wrapping_sub(u32::from(x0));
        let start = u32::from(x0 % 32);
        match self.mask.get(first..first + 2) {
            // Most runs of a marker take this branch.
            Some([word, next]) if (1..=32).contains(&columns) => {
                let bits = word >> start | (next << 1) << (31 - start);
                (bits << (32 - columns)).count_ones()
            }
            _ => self.passed_in_words(first, start, columns),
        }
    }

    /// The number of set bits among `columns` bits from bit `start` of the mask's word `first` on.
    #[inline(never)]
    fn passed_in_words(&self, first: usize, start: u32, columns: u32) -> u32 {
        let words = self.mask.get(first..).unwrap_or_default();
        let end = start + columns;
        let inside = |(word, column): (&u32, u32)| {
            let from = u32::MAX << start.saturating_sub(column).min(31);
            let to = u32::MAX >> (32 - (end - column).min(32));
            (word & from & to).count_ones()
        };
        words.iter().zip((0..end).step_by(32)).map(inside).sum()
    }

    /// Returns the words in which dilated rows may have set bits: the occupied words and one on
    /// each side.
    pub fn near(&self) -> Near {
        let first = self.occupied.trailing_zeros() as usize;
        let end = 32 - self.occupied.leading_zeros() as usize;
        let (first, end) = (first.saturating_sub(1).min(end), (end + 1).min(self.words));
        Near {
            first,
            words: end - first,
            last: if end == self.words {
                last_word_bits(self.width)
            } else {
                u32::MAX
            },
        }
    }

    /// Keeps only the last 2n of the kept and written rows.
    pub fn advance(&mut self, rows: usize) {
        if self.is_empty() {
            return;
        }
        // Words that are not occupied are empty in all rows.
        let first = self.occupied.trailing_zeros() as usize;
        let end = 32 - self.occupied.leading_zeros() as usize;
        for row in 0..self.kept_rows() {
            let split = (row + rows) * self.words;
            let Some((to, from)) = self.mask.split_at_mut_checked(split) else {
                break;
            };
            let to = to.get_mut(row * self.words + first..).unwrap_or_default();
            let from = from.get(first..end).unwrap_or_default();
            to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
        }
        self.set_rows >>= rows;
        if self.is_empty() {
            self.occupied = 0;
        }
    }

    /// 2n.
    fn kept_rows(&self) -> usize {
        2 * usize::from(self.radius)
    }

    /// Number of words of the kept rows.
    fn kept(&self) -> usize {
        self.kept_rows() * self.words
    }
}

/// One word of a row, spread by `radius` < 32 columns; `left` and `right` are its neighbours.
#[inline(always)]
fn spread_word(left: u32, word: u32, right: u32, radius: u8) -> u32 {
    (1..=u32::from(radius)).fold(word, |bits, shift| {
        let rightwards = word << shift | left >> (32 - shift);
        let leftwards = word >> shift | right << (32 - shift);
        bits | rightwards | leftwards
    })
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::markers::runs::for_each_run;

    const WIDTH: u16 = 75;
    const HEIGHT: usize = 40;

    /// A mask, followed by its one, two and three dilations by OpenCV
    /// (`tests/opencv/reference.py`).
    const OPENCV: &[u8; 4 * HEIGHT * 12] = include_bytes!("../../tests/opencv/dilated.bits");

    fn opencv(dilations: u8) -> Vec<[u32; 3]> {
        let mask = OPENCV.chunks_exact(HEIGHT * 12).nth(usize::from(dilations));
        let word = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().unwrap());
        let row = |bytes: &[u8]| [0, 4, 8].map(|i| word(&bytes[i..i + 4]));
        mask.unwrap().chunks_exact(12).map(row).collect()
    }

    /// The runs of each dilated row, if rows arrive `at_a_time`.
    fn dilated(rows: &[[u32; 3]], dilations: u8, at_a_time: usize) -> Vec<Vec<(u16, u16)>> {
        let late = usize::from(dilations);
        let below = std::iter::repeat_n(&[0; 3], late);
        let all: Vec<_> = rows.iter().chain(below).collect();
        let mut dilation = Dilation::new();
        dilation.begin(WIDTH, dilations);
        let mut out = Vec::new();
        let set = |row: &[u32; 3]| row.iter().map(|word| word.count_ones()).sum::<u32>();
        for band in all.chunks(at_a_time) {
            let words: Vec<u32> = band.iter().flat_map(|row| **row).collect();
            dilation.incoming(band.len()).copy_from_slice(&words);
            dilation.look(band.len());
            for i in 0..band.len() {
                let mut edges = Edges::new();
                dilation.edges(i, &dilation.near(), &mut edges);
                let runs: Vec<_> = edges.runs().iter().map(|[x, end]| (*x, end - 1)).collect();
                assert!(!dilation.is_empty() || dilation.is_empty_row(i));
                assert!(!dilation.is_empty_row(i) || runs.is_empty());
                let passed = edges.runs().iter().map(|run| dilation.passed(i, *run));
                let of_row = (out.len().checked_sub(late)).map_or(0, |row| set(all[row]));
                assert_eq!(passed.sum::<u32>(), of_row);
                out.push(runs);
            }
            dilation.advance(band.len());
        }
        out.split_off(late)
    }

    fn runs(rows: &[[u32; 3]]) -> Vec<Vec<(u16, u16)>> {
        let runs = |row: &[u32; 3]| {
            let mut runs = Vec::new();
            for_each_run(row, |run| runs.push((run.x0, run.x1)));
            runs
        };
        rows.iter().map(runs).collect()
    }

    #[test]
    fn masks_equal_opencv() {
        for dilations in 0..=MAX_DILATIONS {
            for at_a_time in 1..=MAX_ROWS {
                let found = dilated(&opencv(0), dilations, at_a_time);
                let expected = runs(&opencv(dilations));
                assert_eq!(found, expected, "{dilations}, {at_a_time}");
            }
        }
    }

    #[test]
    fn frames_lower_than_the_square_come_out_whole() {
        for dilations in 0..=MAX_DILATIONS {
            for height in 0..4 {
                let rows = dilated(&opencv(0)[..height], dilations, 1);
                assert_eq!(rows.len(), height);
            }
        }
    }
}
