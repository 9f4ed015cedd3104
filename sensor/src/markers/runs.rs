//! Finds runs: maximal spans of set bits in a row.

use crate::markers::mask::MAX_WIDTH;

/// A run, in columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Run {
    /// First column.
    pub x0: u16,
    /// Last column (inclusive).
    pub x1: u16,
}

/// Calls `visit` with each edge of a word whose first column is `column`: each bit that differs
/// from the previous one. `open` is true if the bit before the word is set.
///
/// Edges are the set bits of `word ^ (word << 1)`: the first columns of runs and of gaps in turn. A
/// word without an edge costs one test, whether it is empty or full.
#[inline(always)]
pub fn for_each_edge(column: u16, word: u32, open: bool, mut visit: impl FnMut(u16)) {
    let mut edges = word ^ (word << 1 | u32::from(open));
    while edges != 0 {
        visit(column + edges.trailing_zeros() as u16);
        edges &= edges - 1;
    }
}

#[cfg(test)]
/// Calls `visit` with each run of a row of mask words, from left to right. A row of w pixels has at
/// most ⌈w / 2⌉ runs.
pub fn for_each_run(words: &[u32], mut visit: impl FnMut(Run)) {
    let mut open = None;
    let mut column = 0;
    for &word in words {
        for_each_edge(column, word, open.is_some(), |x| {
            open = match open {
                None => Some(x),
                Some(x0) => {
                    visit(Run { x0, x1: x - 1 });
                    None
                }
            };
        });
        column += 32;
    }
    if let Some(x0) = open {
        visit(Run { x0, x1: column - 1 });
    }
}

/// The edges of a row: the first column of each run, and the column behind its last.
#[derive(Clone, Debug)]
pub struct Edges {
    columns: [u16; MAX_WIDTH as usize],
    count: usize,
}

impl Edges {
    /// The edges of an empty row.
    pub const fn new() -> Edges {
        Edges {
            columns: [0; MAX_WIDTH as usize],
            count: 0,
        }
    }

    /// Begins the next row.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes the word whose first column is `column`. Words come from left to right. Omitted words
    /// must be empty, and must not follow directly a word whose last bit is set. Edges beyond the
    /// widest row are dropped.
    #[inline(always)]
    pub fn take(&mut self, column: u16, word: u32) {
        let open = !self.count.is_multiple_of(2);
        for_each_edge(column, word, open, |x| self.push(x));
    }

    /// Takes all edges but one at the row's end from `find`, which writes them and returns their
    /// number.
    #[cfg(armv7em)]
    pub fn fill(&mut self, find: impl FnOnce(&mut [u16; MAX_WIDTH as usize]) -> usize) {
        self.count = find(&mut self.columns).min(self.columns.len());
    }

    /// Ends the row, which has `columns` columns.
    #[inline(always)]
    pub fn end(&mut self, columns: u16) {
        if !self.count.is_multiple_of(2) {
            self.push(columns);
        }
    }

    #[inline(always)]
    fn push(&mut self, column: u16) {
        if let Some(place) = self.columns.get_mut(self.count) {
            *place = column;
            self.count += 1;
        }
    }

    /// Returns the first column of each run, and the one behind its last.
    #[inline(always)]
    pub fn runs(&self) -> &[[u16; 2]] {
        let (edges, _) = self.columns.split_at(self.count.min(self.columns.len()));
        edges.as_chunks().0
    }
}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use proptest::prelude::*;

    use super::*;

    fn runs(words: &[u32]) -> Vec<(u16, u16)> {
        let mut found = Vec::new();
        for_each_run(words, |run| found.push((run.x0, run.x1)));
        found
    }

    fn bit_by_bit(words: &[u32]) -> Vec<(u16, u16)> {
        let set = |x: u16| words[usize::from(x / 32)] >> (x % 32) & 1 == 1;
        let mut found: Vec<(u16, u16)> = Vec::new();
        for x in (0..32 * words.len() as u16).filter(|x| set(*x)) {
            match found.last_mut() {
                Some((_, x1)) if *x1 + 1 == x => *x1 = x,
                _ => found.push((x, x)),
            }
        }
        found
    }

    /// Words with few edges and with many.
    fn word() -> impl Strategy<Value = u32> {
        let spans = (0..32_u32, 0..32_u32).prop_map(|(a, b)| u32::MAX << a & u32::MAX >> b);
        prop_oneof![Just(0), Just(u32::MAX), spans, any::<u32>()]
    }

    proptest! {
        #[test]
        fn runs_are_those_found_bit_by_bit(words in prop::collection::vec(word(), 0..6)) {
            prop_assert_eq!(runs(&words), bit_by_bit(&words));
            let mut edges = Edges::new();
            (0..).zip(&words).for_each(|(i, word)| edges.take(32 * i, *word));
            edges.end(32 * words.len() as u16);
            let pairs = edges.runs().iter().map(|[start, end]| (*start, end - 1));
            prop_assert_eq!(pairs.collect::<Vec<_>>(), bit_by_bit(&words));
        }
    }

    #[test]
    fn runs_cross_words_and_reach_both_borders() {
        assert_eq!(runs(&[u32::MAX; 25]), vec![(0, 799)]);
        assert_eq!(runs(&[1, 1 << 31, 1]), vec![(0, 0), (63, 64)]);
        assert_eq!(runs(&[0xaaaa_aaaa; 25]).len(), 400);
        assert!(runs(&[0; 25]).is_empty());
    }
}
