//! Runs: maximal spans of set bits in a row.

/// A run, in columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Run {
    /// First column.
    pub x0: u16,
    /// Last column (inclusive).
    pub x1: u16,
}

/// Calls `visit` with each run of a row of mask words, whose first is word `first` of the row, from left to right. A row
/// of w pixels has at most ⌈w / 2⌉.
///
/// A run begins and ends where a bit differs from the one before it, so the set bits of `word ^ (word << 1)` are the
/// first columns of runs and of gaps in turn: words without an edge cost one test, whether they are empty or full.
pub fn for_each_run(first: usize, words: &[u32], mut visit: impl FnMut(Run)) {
    let mut open = None;
    let mut before = 0;
    let mut column = 32 * first as u16;
    for &word in words {
        let mut edges = word ^ (word << 1 | before);
        before = word >> 31;
        while edges != 0 {
            let x = column + edges.trailing_zeros() as u16;
            open = match open {
                None => Some(x),
                Some(x0) => {
                    visit(Run { x0, x1: x - 1 });
                    None
                }
            };
            edges &= edges - 1;
        }
        column += 32;
    }
    if let Some(x0) = open {
        visit(Run { x0, x1: column - 1 });
    }
}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use proptest::prelude::*;

    use super::*;

    fn runs(words: &[u32]) -> Vec<(u16, u16)> {
        let mut found = Vec::new();
        for_each_run(0, words, |run| found.push((run.x0, run.x1)));
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
            let mut moved = Vec::new();
            for_each_run(7, &words, |run| moved.push((run.x0 - 224, run.x1 - 224)));
            prop_assert_eq!(moved, bit_by_bit(&words));
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
