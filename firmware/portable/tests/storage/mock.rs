//! Simulates a flash whose words have an error correcting code and wear out, and whose power can be
//! cut.

use std::cell::Cell;
use std::future::{Future, pending};
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use hivtac_portable::storage::flash::{BLANK, Failed, Flash, Place, Unreadable, Word};

/// Few, so that sectors fill up.
pub const SECTOR_WORDS: u32 = 24;
/// Two of the log, and two for each of two blobs.
pub const SECTORS: u32 = 6;

/// The state of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// It reads as this.
    Whole(Word),
    /// It does not read.
    Torn,
    /// It reads as this at one time, and as an error at another.
    Flaky(Word),
}

/// The state of each affected word after an operation was cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// As before the operation.
    Before,
    /// Unreadable.
    Torn,
    /// As after the operation or unreadable, differently at each read.
    Flaky,
    /// As after the operation.
    After,
    /// In an erased sector, every third word in one of the first three states.
    Mixed,
}

pub const EVERY_WAY: [Leaves; 5] = [
    Leaves::Before,
    Leaves::Torn,
    Leaves::Flaky,
    Leaves::After,
    Leaves::Mixed,
];

/// The cells, which outlive a power cut.
#[derive(Clone, Debug)]
pub struct Cells {
    words: Vec<State>,
    /// Erases of each sector.
    pub erases: [u32; SECTORS as usize],
    /// Programming and erasing operations so far.
    pub operations: u64,
    /// Words that cannot be programmed.
    pub worn: Vec<u32>,
    /// Words that stay unchanged when they are programmed.
    pub deaf: Vec<u32>,
    /// Words that read otherwise than they were programmed, without an error.
    pub faint: Vec<u32>,
    chance: u64,
}

impl Cells {
    pub fn blank(seed: u64) -> Self {
        Self {
            words: vec![State::Whole(BLANK); (SECTORS * SECTOR_WORDS) as usize],
            erases: [0; SECTORS as usize],
            operations: 0,
            worn: Vec::new(),
            deaf: Vec::new(),
            faint: Vec::new(),
            chance: seed,
        }
    }

    /// Copies the first words of the first sector to its end.
    pub fn repeat_at_the_end(&mut self, words: usize) {
        let end = SECTOR_WORDS as usize;
        self.words.copy_within(..words, end - words);
    }

    fn coin(&mut self) -> bool {
        self.chance = self
            .chance
            .wrapping_mul(0x5851_F42D_4C95_7F2D)
            .wrapping_add(0x1405_7B7E_F767_814F);
        self.chance >> 40 & 1 == 1
    }

    fn left(leaves: Leaves, nth: usize, before: State, after: Word) -> State {
        match leaves {
            Leaves::Before => before,
            Leaves::Torn => State::Torn,
            Leaves::Flaky => State::Flaky(after),
            Leaves::After => State::Whole(after),
            Leaves::Mixed => {
                let kinds = [Leaves::Before, Leaves::Torn, Leaves::Flaky];
                Self::left(kinds[nth % 3], nth, before, after)
            }
        }
    }
}

/// A cut of the power at an operation.
#[derive(Clone, Copy, Debug)]
pub struct Cut {
    /// Number of the operation, counted from the start of the device.
    pub operation: u64,
    pub leaves: Leaves,
}

/// The flash of a device that runs.
#[derive(Debug)]
pub struct Mock<'c> {
    pub cells: &'c mut Cells,
    cut: Option<Cut>,
    begun: u64,
    is_cut: Rc<Cell<bool>>,
}

impl<'c> Mock<'c> {
    pub fn new(cells: &'c mut Cells, cut: Option<Cut>) -> Self {
        Self {
            cells,
            cut,
            begun: 0,
            is_cut: Rc::default(),
        }
    }

    /// Counts an operation. Returns the state that it leaves if the power fails in it, otherwise
    /// `None`.
    fn begin(&mut self) -> Option<Leaves> {
        assert!(!self.is_cut.get(), "nothing runs without power");
        let nth = self.begun;
        self.begun += 1;
        self.cells.operations += 1;
        let cut = self.cut.filter(|cut| cut.operation == nth)?;
        self.is_cut.set(true);
        Some(cut.leaves)
    }
}

fn index(place: Place) -> usize {
    assert!(place.sector < SECTORS && place.word < SECTOR_WORDS);
    (place.sector * SECTOR_WORDS + place.word) as usize
}

impl Flash for Mock<'_> {
    const SECTOR_WORDS: u32 = SECTOR_WORDS;

    fn read(&mut self, place: Place) -> Result<Word, Unreadable> {
        let state = self.cells.words[index(place)];
        match state {
            State::Whole(word) => Ok(word),
            State::Torn => Err(Unreadable),
            State::Flaky(word) if self.cells.coin() => Ok(word),
            State::Flaky(_) => Err(Unreadable),
        }
    }

    async fn program(&mut self, place: Place, word: &Word) -> Result<(), Failed> {
        let at = index(place);
        let before = self.cells.words[at];
        // A word whose programming was cut off before it began is still blank.
        assert_eq!(before, State::Whole(BLANK), "{place:?} programmed twice");
        if let Some(leaves) = self.begin() {
            self.cells.words[at] = Cells::left(leaves, at, before, *word);
            return pending().await;
        }
        if self.cells.deaf.contains(&(at as u32)) {
            return Err(Failed);
        }
        if self.cells.worn.contains(&(at as u32)) {
            self.cells.words[at] = State::Torn;
            return Err(Failed);
        }
        let mut written = *word;
        if self.cells.faint.contains(&(at as u32)) {
            written[12] ^= 1;
        }
        self.cells.words[at] = State::Whole(written);
        Ok(())
    }

    async fn erase(&mut self, sector: u32) -> Result<(), Failed> {
        let from = index(Place { sector, word: 0 });
        let cut = self.begin();
        self.cells.erases[sector as usize] += 1;
        let leaves = cut.unwrap_or(Leaves::After);
        for (nth, state) in self.cells.words[from..][..SECTOR_WORDS as usize]
            .iter_mut()
            .enumerate()
        {
            *state = Cells::left(leaves, nth, *state, BLANK);
        }
        match cut {
            Some(_) => pending().await,
            None => Ok(()),
        }
    }
}

/// Runs a future that waits only for the flash; `None` if the power was cut in it.
pub fn powered<T>(work: impl Future<Output = T>) -> Option<T> {
    let mut context = Context::from_waker(Waker::noop());
    match pin!(work).poll(&mut context) {
        Poll::Ready(done) => Some(done),
        Poll::Pending => None,
    }
}
