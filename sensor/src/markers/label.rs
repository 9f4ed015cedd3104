//! Labels 8-connected runs in one pass over the rows, in fixed storage.
//!
//! Every run of the previous row carries a *label*: the index of a slot that sums up its blob. A
//! run of the current row takes the label of a run that it touches, and joins the labels of all
//! others that it touches. A run that touches no other opens a slot. At the end of the row, labels
//! that the row did not touch are finished. Their blobs are kept if large enough, and their slots
//! become free, as do those of joined labels.
//!
//! Slots never run out. Those in use belong to distinct runs of the previous row, or to runs of the
//! current one that touch none of these. Projected onto one row, all of them are disjoint and not
//! even adjacent, so there are at most ⌈width / 2⌉.

use heapless::Vec;

use crate::markers::blob::Blob;
use crate::markers::dilate::Dilation;
use crate::markers::mask::{MAX_WIDTH, Near};
use crate::markers::moments::Moments;
use crate::markers::runs::{Edges, Run};
use crate::markers::tables::Weights;

/// Most runs of a row, and most slots in use.
const MAX_RUNS: usize = (MAX_WIDTH as usize).div_ceil(2);

/// Index of a slot.
type Label = u16;

/// Marks a free slot, in place of its parent.
const FREE: Label = Label::MAX;

/// The runs of one row, and their labels.
#[derive(Clone, Debug)]
struct Row {
    edges: Edges,
    labels: [Label; MAX_RUNS],
}

impl Row {
    const EMPTY: Row = Row {
        edges: Edges::new(),
        labels: [0; MAX_RUNS],
    };
}

/// The blobs of a frame after some of its rows. Keeps up to `BLOBS` finished ones.
#[derive(Clone, Debug)]
pub struct Labeller<const BLOBS: usize> {
    /// The last row that was pushed, and the one before it, in turn.
    rows: [Row; 2],
    /// Index of the last row that was pushed.
    last: usize,
    forest: Forest,
    kept: Vec<Blob, BLOBS>,
    min_area: u32,
    /// Runs that the frame may still have.
    runs_left: u32,
    /// True if the frame had more runs than it may.
    exhausted: bool,
    /// True if the last row that was pushed has no run.
    idle: bool,
    overflowed: bool,
}

impl<const BLOBS: usize> Labeller<BLOBS> {
    /// A labeller before its first frame.
    pub const fn new() -> Self {
        Labeller {
            rows: [Row::EMPTY; 2],
            last: 0,
            forest: Forest::new(),
            kept: Vec::new(),
            min_area: 0,
            runs_left: 0,
            exhausted: false,
            idle: true,
            overflowed: false,
        }
    }

    /// Starts a frame. Blobs of fewer than `min_area` pixels are dropped. Rows after the one that
    /// exceeds `max_runs` runs are ignored.
    pub fn begin(&mut self, min_area: u32, max_runs: u32) {
        self.rows.iter_mut().for_each(|row| row.edges.clear());
        self.forest.clear();
        self.kept.clear();
        self.min_area = min_area;
        self.runs_left = max_runs;
        self.exhausted = false;
        self.idle = true;
        self.overflowed = false;
    }

    /// Takes row `y` of the mask, which is the row of [`Dilation::edges`] at `i` and `near`. Rows
    /// come in order, from 0 to at most 799; empty ones may be omitted while the labeller is
    /// [idle](Self::is_idle). Returns how many of the row's pixels were set before dilation.
    pub fn push(&mut self, y: u16, dilation: &Dilation, i: usize, near: &Near) -> u32 {
        self.last = 1 - self.last;
        let (before, current) = last_two(&mut self.rows, self.last);
        dilation.edges(i, near, &mut current.edges);
        let (above, runs) = (before.edges.runs(), current.edges.runs());
        let labels = (&before.labels, &mut current.labels);
        let count = runs.len() as u32;
        let (left, exhausted) = self.runs_left.overflowing_sub(count);
        self.runs_left = left;
        self.exhausted |= exhausted;
        self.idle = count == 0;
        let mut all = 0;
        let mut passed = |run: [u16; 2]| {
            let passed = dilation.passed(i, run);
            all += passed;
            passed
        };
        if !continue_blobs([above, runs], labels, &mut self.forest, y, &mut passed) {
            self.label_row(y, passed);
        }
        all
    }

    /// Weighs the runs of row `y`, the last one that was pushed.
    #[inline(always)]
    pub fn weigh(&mut self, y: u16, weigh: impl Fn(Run) -> Weights) {
        let (_, Row { edges, labels }) = last_two(&mut self.rows, self.last);
        for (&[x0, end], label) in edges.runs().iter().zip(labels) {
            let weights = weigh(Run { x0, x1: end - 1 });
            if let Some(slot) = self.forest.slots.get_mut(usize::from(*label)) {
                slot.moments.weigh(weights, y);
            }
        }
    }

    /// Adds the film next to the runs of row `y`, the last one that was pushed.
    #[inline(always)]
    pub fn look_beside(&mut self, y: u16, beside: impl Fn(Run) -> [u8; 2]) {
        let (_, Row { edges, labels }) = last_two(&mut self.rows, self.last);
        for (&[x0, end], label) in edges.runs().iter().zip(labels) {
            let pull = beside(Run { x0, x1: end - 1 });
            if let Some(slot) = self.forest.slots.get_mut(usize::from(*label)) {
                slot.moments.beside.add_row(pull, y);
            }
        }
    }

    /// Returns whether the frame has had more runs than it may.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }

    /// Returns whether no blob is open, so that an empty row changes nothing.
    pub fn is_idle(&self) -> bool {
        self.idle
    }

    /// Finishes the blobs that reach the last row, `height` − 1.
    pub fn finish(&mut self, height: u16) {
        self.last = 1 - self.last;
        last_two(&mut self.rows, self.last).1.edges.clear();
        self.idle = true;
        self.label_row(height, |_| 0);
    }

    /// Returns the blobs kept so far, ordered by their lowest row, then by their first column in
    /// it.
    pub fn kept(&self) -> &[Blob] {
        &self.kept
    }

    /// Returns whether the storage was too small: blobs are then missing or cut.
    pub fn overflowed(&self) -> bool {
        self.overflowed || self.exhausted
    }

    /// Labels the runs of the last row, `y`, and finishes blobs that end above it. `passed` returns
    /// how many pixels of a run were set before dilation.
    fn label_row(&mut self, y: u16, mut passed: impl FnMut([u16; 2]) -> u32) {
        let (before, current) = last_two(&mut self.rows, self.last);
        // From the first run above that can touch this run or a later one.
        let mut above = before.edges.runs().iter().zip(&before.labels);
        let mut joined = false;
        for (&[x0, end], label) in current.edges.runs().iter().zip(&mut current.labels) {
            // Columns at most one apart touch, straight or across a corner.
            while above.clone().next().is_some_and(|(above, _)| above[1] < x0) {
                above.next();
            }
            let run = Run { x0, x1: end - 1 };
            let mut touched = above.clone().take_while(|(above, _)| above[0] <= end);
            let Some((_, touched_label)) = touched.next() else {
                let mut moments = Moments::of_run(run, y);
                moments.passed = passed([x0, end]);
                let opened = self.forest.open(moments);
                self.overflowed |= opened.is_none();
                *label = opened.unwrap_or(0);
                continue;
            };
            let root = self.forest.find(*touched_label);
            for (_, other) in touched {
                self.forest.join(root, *other);
                joined = true;
            }
            if let Some(Slot { moments, .. }) = self.forest.slots.get_mut(usize::from(root)) {
                moments.add_run(run, y);
                moments.passed += passed([x0, end]);
            }
            *label = root;
        }
        if joined {
            // No run may keep a label that was joined to another.
            let count = current.edges.runs().len();
            for label in current.labels.iter_mut().take(count) {
                *label = self.forest.find(*label);
            }
        }
        self.finish_untouched(y);
    }

    /// Frees those labels of the row before the last, `y`, that were joined to others or not
    /// touched.
    fn finish_untouched(&mut self, y: u16) {
        let (Row { edges, labels }, _) = last_two(&mut self.rows, self.last);
        for &mut label in labels.iter_mut().take(edges.runs().len()) {
            let Some(slot) = self.forest.slots.get_mut(usize::from(label)) else {
                continue;
            };
            let root = slot.parent == label;
            if slot.parent == FREE || root && slot.moments.y1 == y {
                continue;
            }
            if root && slot.moments.area >= self.min_area {
                self.overflowed |= self.kept.push(slot.moments.blob()).is_err();
            }
            slot.parent = FREE;
            self.overflowed |= self.forest.free.push(label).is_err();
        }
    }
}

/// The row before the last, and the last.
#[inline(always)]
fn last_two(rows: &mut [Row; 2], last: usize) -> (&mut Row, &mut Row) {
    let [a, b] = rows;
    if last == 0 { (b, a) } else { (a, b) }
}

/// Handles the usual case: each run of row `y` touches exactly one of those above, and each of
/// these exactly one of them. Otherwise returns false and does nothing. `passed` returns how many
/// pixels of a run were set before dilation.
#[inline(always)]
fn continue_blobs(
    [above, runs]: [&[[u16; 2]]; 2],
    (above_labels, labels): (&[Label; MAX_RUNS], &mut [Label; MAX_RUNS]),
    forest: &mut Forest,
    y: u16,
    mut passed: impl FnMut([u16; 2]) -> u32,
) -> bool {
    if above.len() != runs.len() {
        return false;
    }
    let mut free = [0, 0];
    for (a, b) in above.iter().zip(runs) {
        let touch = a[0] <= b[1] && b[0] <= a[1];
        let apart = free[0] <= b[0] && free[1] <= a[0];
        if !touch || !apart {
            return false;
        }
        // The first columns behind both runs.
        free = [a[1] + 1, b[1] + 1];
    }
    let labels = labels.iter_mut().zip(above_labels);
    for (&[x0, end], (label, above)) in runs.iter().zip(labels) {
        *label = *above;
        let run = Run { x0, x1: end - 1 };
        if let Some(Slot { moments, .. }) = forest.slots.get_mut(usize::from(*above)) {
            moments.add_run(run, y);
            moments.passed += passed([x0, end]);
        }
    }
    true
}

/// One entry of the union-find forest.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// The slot itself if it is a root, [`FREE`] if it is free.
    parent: Label,
    /// Sums over all slots that joined it, if it is a root.
    moments: Moments,
}

/// The open blobs.
#[derive(Clone, Debug)]
struct Forest {
    slots: Vec<Slot, MAX_RUNS>,
    free: Vec<Label, MAX_RUNS>,
}

impl Forest {
    const fn new() -> Forest {
        Forest {
            slots: Vec::new(),
            free: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.slots.clear();
        self.free.clear();
    }

    /// Puts a blob into a free slot.
    fn open(&mut self, moments: Moments) -> Option<Label> {
        let Some(label) = self.free.pop() else {
            let parent = self.slots.len() as Label;
            let slot = Slot { parent, moments };
            return self.slots.push(slot).ok().map(|()| parent);
        };
        let parent = label;
        *self.slots.get_mut(usize::from(label))? = Slot { parent, moments };
        Some(label)
    }

    /// Joins the blob of a label to that of a root, which remains.
    fn join(&mut self, root: Label, label: Label) {
        let other = self.find(label);
        if root == other {
            return;
        }
        let Some(joined) = self.slots.get_mut(usize::from(other)) else {
            return;
        };
        joined.parent = root;
        let moments = joined.moments;
        if let Some(slot) = self.slots.get_mut(usize::from(root)) {
            slot.moments.add(&moments);
        }
    }

    /// The root of a label; halves the path to it.
    fn find(&mut self, mut label: Label) -> Label {
        // A label without a slot is its own root.
        loop {
            let slots = &mut self.slots;
            let Some(parent) = slots.get(usize::from(label)).map(|slot| slot.parent) else {
                return label;
            };
            if parent == label {
                return label;
            }
            let Some(grandparent) = slots.get(usize::from(parent)).map(|slot| slot.parent) else {
                return label;
            };
            if let Some(slot) = slots.get_mut(usize::from(label)) {
                slot.parent = grandparent;
            }
            label = grandparent;
        }
    }
}
