//! 3×3 dilation, zero to three times, row by row.
//!
//! n dilations by 3×3 are one by a square of 2n + 1: the last 2n + 1 rows one over the other, then along the row. As with
//! OpenCV's default border, what lies outside the frame counts as unset.
//!
//! Most rows of a frame are empty, and most words of the others: every row remembers where its set bits begin and end,
//! and only what lies between is looked at again.

use crate::mask::{EMPTY_ROW, MaskRow, last_word_bits, words_of};

/// Most dilations.
pub const MAX_DILATIONS: u8 = 3;
/// Rows that the tallest square covers.
const RING: usize = 2 * MAX_DILATIONS as usize + 1;

/// The rows that the next output still needs: a ring of 2n + 1.
#[derive(Clone, Debug)]
pub struct Dilation {
    ring: [MaskRow; RING],
    /// Where the set bits of the ring's rows lie.
    spans: [Span; RING],
    /// How many of them have any.
    occupied: u8,
    /// The row that goes out.
    out: MaskRow,
    /// n.
    radius: u8,
    width: u16,
    /// ⌈width / 32⌉.
    words: usize,
    /// Where the next row goes.
    next: usize,
    /// Rows still to come in before the first goes out.
    delay: u8,
}

/// The words of a row from the first to before the last that has a set bit; empty when none has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Span {
    first: usize,
    end: usize,
}

impl Span {
    const EMPTY: Span = Span {
        first: usize::MAX,
        end: 0,
    };

    fn with(self, other: Span) -> Span {
        Span {
            first: self.first.min(other.first),
            end: self.end.max(other.end),
        }
    }
}

/// The part of a row that has all its set bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part<'r> {
    /// Which word of the row is its first.
    pub first: usize,
    /// Its words; none when the row is empty.
    pub words: &'r [u32],
}

impl Part<'_> {
    /// Of an empty row.
    pub const EMPTY: Part<'static> = Part {
        first: 0,
        words: &[],
    };
}

impl Dilation {
    /// For no frame yet.
    pub const fn new() -> Dilation {
        Dilation {
            ring: [EMPTY_ROW; RING],
            spans: [Span::EMPTY; RING],
            occupied: 0,
            out: EMPTY_ROW,
            radius: 0,
            width: 1,
            words: 1,
            next: 0,
            delay: 0,
        }
    }

    /// Starts a frame of rows of `width` pixels with `dilations` ≤ [`MAX_DILATIONS`] dilations.
    pub fn begin(&mut self, width: u16, dilations: u8) {
        self.ring = [EMPTY_ROW; RING];
        self.spans = [Span::EMPTY; RING];
        self.occupied = 0;
        self.radius = dilations.min(MAX_DILATIONS);
        self.width = width;
        self.words = words_of(width);
        self.next = 0;
        self.delay = self.radius;
    }

    /// Rows that [`push`](Self::push) is behind: as many empty rows bring out the last.
    pub fn radius(&self) -> u8 {
        self.radius
    }

    /// Where the next row is to be written, all of its ⌈width / 32⌉ words, before it is [pushed](Self::push). Bits beyond
    /// the width must be unset.
    #[inline(always)]
    pub fn incoming(&mut self) -> &mut [u32] {
        &mut self.ring[self.next][..self.words]
    }

    /// The number of set bits of the row that was written, when nothing else of it is wanted.
    pub fn count(&self) -> u32 {
        let row = &self.ring[self.next][..self.words];
        row.iter().map(|word| word.count_ones()).sum()
    }

    /// Takes the row that was written. Gives the number of its set bits, and the row that lies [`radius`](Self::radius)
    /// rows above it, dilated, once there is one.
    #[inline(always)]
    pub fn push(&mut self) -> (u32, Option<Part<'_>>) {
        let row = &self.ring[self.next][..self.words];
        let any = row.iter().fold(0, |all, word| all | word);
        if any | u32::from(self.occupied) == 0 {
            // As most rows are.
            self.step();
            return (0, self.is_due().then_some(Part::EMPTY));
        }
        self.push_among_occupied()
    }

    fn push_among_occupied(&mut self) -> (u32, Option<Part<'_>>) {
        let row = &self.ring[self.next][..self.words];
        let (mut span, mut count) = (Span::EMPTY, 0);
        for (i, word) in row.iter().enumerate().filter(|(_, word)| **word != 0) {
            count += word.count_ones();
            span.first = span.first.min(i);
            span.end = i + 1;
        }
        let replaced = core::mem::replace(&mut self.spans[self.next], span);
        self.occupied += u8::from(span != Span::EMPTY);
        self.occupied -= u8::from(replaced != Span::EMPTY);
        self.step();
        if !self.is_due() {
            return (count, None);
        }
        (count, Some(self.dilated()))
    }

    /// Moves on to the next row of the ring.
    fn step(&mut self) {
        self.next += 1;
        if self.next == self.height() {
            self.next = 0;
        }
    }

    /// Whether a row goes out for the one that came in.
    fn is_due(&mut self) -> bool {
        let due = self.delay == 0;
        self.delay = self.delay.saturating_sub(1);
        due
    }

    /// The row in the middle of the ring, dilated.
    fn dilated(&mut self) -> Part<'_> {
        let height = self.height();
        let spans = self.spans.iter().take(height);
        let span = spans.fold(Span::EMPTY, |all, span| all.with(*span));
        if span == Span::EMPTY {
            return Part::EMPTY;
        }
        let reach = usize::from(self.radius.min(1));
        let first = span.first.saturating_sub(reach);
        let end = (span.end + reach).min(self.words);
        let words = &mut self.out[first..end];
        match (self.radius, &self.ring) {
            (1, [a, b, c, ..]) => dilate_three([a, b, c].map(|row| &row[first..end]), words),
            (radius, ring) => {
                words.fill(0);
                for row in ring.iter().take(height) {
                    for (to, from) in words.iter_mut().zip(&row[first..end]) {
                        *to |= from;
                    }
                }
                spread(words, radius);
            }
        }
        if let Some(last) = words.last_mut().filter(|_| end == self.words) {
            *last &= last_word_bits(self.width);
        }
        Part { first, words }
    }

    fn height(&self) -> usize {
        2 * usize::from(self.radius) + 1
    }
}

/// The usual dilation in one go: three rows one over the other and along the row, in as many words.
fn dilate_three([a, b, c]: [&[u32]; 3], out: &mut [u32]) {
    let mut columns = a.iter().zip(b).zip(c).map(|((a, b), c)| a | b | c);
    let (mut left, mut word) = (0, columns.next().unwrap_or(0));
    for to in out {
        let right = columns.next().unwrap_or(0);
        *to = spread_word(left, word, right, 1);
        (left, word) = (word, right);
    }
}

/// Sets every bit within `radius` < 32 columns of a set one.
fn spread(words: &mut [u32], radius: u8) {
    let (mut left, mut word) = (0, words.first().copied().unwrap_or(0));
    for i in 0..words.len() {
        let right = words.get(i + 1).copied().unwrap_or(0);
        if left | word | right != 0 {
            words[i] = spread_word(left, word, right, radius);
        }
        (left, word) = (word, right);
    }
}

/// One word of [`spread`], given its neighbours.
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
        let mut out = Vec::new();
        for row in rows.iter().chain(below) {
            dilation.incoming().copy_from_slice(row);
            let (count, part) = dilation.push();
            assert_eq!(count, row.iter().map(|word| word.count_ones()).sum());
            out.extend(part.map(|part| {
                let mut whole = [0; 3];
                whole[part.first..][..part.words.len()].copy_from_slice(part.words);
                whole
            }));
        }
        out
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
