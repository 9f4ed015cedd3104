//! Runs: maximal spans of set bits in a row.

/// A run, in columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Run {
    /// First column.
    pub x0: u16,
    /// Last column (inclusive).
    pub x1: u16,
}

/// Calls `visit` with each run of a row of mask words, from left to right. A row of w pixels has at most ⌈w / 2⌉.
///
/// A run begins and ends where a bit differs from the one before it, so the set bits of `word ^ (word << 1)` are the
/// first columns of runs and of gaps in turn: words without an edge cost one test, whether they are empty or full.
pub fn for_each_run(words: &[u32], mut visit: impl FnMut(Run)) {
    let mut open = None;
    let mut before = 0;
    let mut column = 0;
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
