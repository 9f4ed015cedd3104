//! 8-connected labelling of runs in one pass over the rows, in fixed storage.
//!
//! Every run of the row before carries a *label*: the index of a slot in which its blob is summed up. A run of the current
//! row takes the label of a run that it touches, and joins the labels of all that it touches; one that touches none
//! opens a slot. At the end of the row, labels that it did not touch are finished: their blobs are kept
//! if large enough, and their slots are free again, as are those of joined labels.
//!
//! Slots never run out: those in use belong to distinct runs of the row before, or to runs of the current one that touch none of
//! these. Seen along the row, all of them are disjoint and not even adjacent, so that there are at most ⌈width / 2⌉.

use heapless::Vec;

use crate::{
    blob::Blob,
    dilate::Part,
    mask::MAX_WIDTH,
    runs::{Run, for_each_run},
    tables::Weights,
};

/// Most runs in a row, and most slots in use.
const MAX_RUNS: usize = (MAX_WIDTH as usize).div_ceil(2);

/// Index of a slot.
type Label = u16;

/// Marks a free slot, in place of its parent.
const FREE: Label = Label::MAX;

/// A run of the row before or of the current one.
#[derive(Clone, Copy, Debug)]
struct LabelledRun {
    run: Run,
    label: Label,
}

/// One entry of the union-find forest.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// Itself when it is a root, [`FREE`] when it is free.
    parent: Label,
    /// The sum over all that joined it, when it is a root.
    blob: Blob,
}

/// What is known of a frame's blobs after some of its rows. Keeps up to `BLOBS` finished ones.
#[derive(Clone, Debug)]
pub struct Labeller<const BLOBS: usize> {
    before: Vec<LabelledRun, MAX_RUNS>,
    current: Vec<LabelledRun, MAX_RUNS>,
    slots: Vec<Slot, MAX_RUNS>,
    free: Vec<Label, MAX_RUNS>,
    kept: Vec<Blob, BLOBS>,
    min_area: u32,
    /// Runs that the frame may still have; `None` when it had more.
    runs_left: Option<u32>,
    overflowed: bool,
}

impl<const BLOBS: usize> Labeller<BLOBS> {
    /// For no frame yet.
    pub const fn new() -> Self {
        Labeller {
            before: Vec::new(),
            current: Vec::new(),
            slots: Vec::new(),
            free: Vec::new(),
            kept: Vec::new(),
            min_area: 0,
            runs_left: Some(0),
            overflowed: false,
        }
    }

    /// Starts a frame in which blobs of fewer than `min_area` pixels are dropped.
    /// After a row with which it has more than `max_runs` runs, nothing more of it is taken.
    pub fn begin(&mut self, min_area: u32, max_runs: u32) {
        self.before.clear();
        self.slots.clear();
        self.free.clear();
        self.kept.clear();
        self.min_area = min_area;
        self.runs_left = Some(max_runs);
        self.overflowed = false;
    }

    /// Takes the part of row `y` of the mask that has its set bits; `weigh` gives the weights of one of its runs. Rows come in order, from 0 to at most
    /// 799.
    pub fn push(&mut self, part: Part<'_>, y: u16, weigh: impl Fn(Run) -> Weights) {
        self.current.clear();
        let mut first = 0;
        for_each_run(part.first, part.words, |run| {
            self.push_run(run, y, weigh(run), &mut first)
        });
        let count = self.current.len() as u32;
        self.runs_left = self.runs_left.and_then(|left| left.checked_sub(count));
        self.overflowed |= self.is_exhausted();
        self.resolve_runs();
        self.finish_untouched(y);
        self.before.clear();
        self.overflowed |= self.before.extend_from_slice(&self.current).is_err();
    }

    /// Whether the frame has had more runs than it may.
    pub fn is_exhausted(&self) -> bool {
        self.runs_left.is_none()
    }

    /// Whether no blob is open, so that an empty row changes nothing.
    pub fn is_idle(&self) -> bool {
        self.before.is_empty()
    }

    /// Finishes the blobs that reach the last row, `height` − 1.
    pub fn finish(&mut self, height: u16) {
        self.push(Part::EMPTY, height, |_| Weights::NONE);
    }

    /// The blobs kept so far, ordered by their lowest row, then by where they begin in it.
    pub fn kept(&self) -> &[Blob] {
        &self.kept
    }

    /// Whether the storage was too small: blobs are then missing or cut.
    pub fn overflowed(&self) -> bool {
        self.overflowed
    }

    /// Takes a run of row `y`. `first` is the first run of the row before that can touch this one or a later one.
    fn push_run(&mut self, run: Run, y: u16, weights: Weights, first: &mut usize) {
        // Columns at most one apart touch, straight or across a corner.
        while self
            .before
            .get(*first)
            .is_some_and(|b| b.run.x1 + 1 < run.x0)
        {
            *first += 1;
        }
        let label = self.label_run(run, y, weights, *first);
        let stored =
            label.is_some_and(|label| self.current.push(LabelledRun { run, label }).is_ok());
        self.overflowed |= !stored;
    }

    /// Adds a run to the blob of those that it touches, from `first` on in the row before, which become one; or to a new
    /// blob.
    fn label_run(&mut self, run: Run, y: u16, weights: Weights, first: usize) -> Option<Label> {
        let mut root = None;
        let mut next = first;
        while let Some(touched) = self.before.get(next).filter(|b| b.run.x0 <= run.x1 + 1) {
            let other = self.find(touched.label);
            root = Some(root.map_or(other, |root| self.join(root, other)));
            next += 1;
        }
        let Some(root) = root else {
            return self.open(Blob::of_run(run, y, weights));
        };
        let blob = &mut self.slots[usize::from(root)].blob;
        blob.add(&Blob::of_run(run, y, weights));
        Some(root)
    }

    /// Puts a blob into a free slot.
    fn open(&mut self, blob: Blob) -> Option<Label> {
        let Some(label) = self.free.pop() else {
            let label = self.slots.len() as Label;
            let slot = Slot {
                parent: label,
                blob,
            };
            return self.slots.push(slot).ok().map(|()| label);
        };
        self.slots[usize::from(label)] = Slot {
            parent: label,
            blob,
        };
        Some(label)
    }

    /// Joins the blob of one root to that of another, which remains.
    fn join(&mut self, root: Label, other: Label) -> Label {
        if root != other {
            let joined = &mut self.slots[usize::from(other)];
            joined.parent = root;
            let blob = joined.blob;
            self.slots[usize::from(root)].blob.add(&blob);
        }
        root
    }

    /// The root of a label; halves the path to it.
    fn find(&mut self, mut label: Label) -> Label {
        loop {
            let parent = self.slots[usize::from(label)].parent;
            if parent == label {
                return label;
            }
            let grandparent = self.slots[usize::from(parent)].parent;
            self.slots[usize::from(label)].parent = grandparent;
            label = grandparent;
        }
    }

    /// Points the labels of the current row at their roots, so that nothing points at joined ones.
    fn resolve_runs(&mut self) {
        for i in 0..self.current.len() {
            self.current[i].label = self.find(self.current[i].label);
        }
    }

    /// Frees the labels of the row before that were joined to others, and those that row `y` did not touch.
    fn finish_untouched(&mut self, y: u16) {
        for &LabelledRun { label, .. } in &self.before {
            let slot = &mut self.slots[usize::from(label)];
            let root = slot.parent == label;
            if slot.parent == FREE || root && slot.blob.y1 == y {
                continue;
            }
            if root && slot.blob.area >= self.min_area {
                self.overflowed |= self.kept.push(slot.blob).is_err();
            }
            slot.parent = FREE;
            self.overflowed |= self.free.push(label).is_err();
        }
    }
}
