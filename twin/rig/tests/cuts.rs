//! Helpers for tests that cut the power at every operation that writes the flash, in every way. One
//! complete run gives the list of operations, from which the result of each cut follows.
//!
//! Images that a start cannot distinguish are started once. A run of the rig depends only on its
//! inputs, and the rig reports the words of the flash that a run read or programmed. With another
//! image that has the same values in all of these words, the run is the same, bit for bit.
//! `models::a_start_depends_on_no_word_that_the_rig_does_not_tell` shows that no other word counts.

use std::collections::BTreeSet;
use std::path::Path;

use hivtac_rig::peripherals::flash::{
    BANK, Contents, Cut, Leaves, Operation, SECTOR_BYTES, WORD_BYTES,
};

/// The state of a device at its start, and the words of its flash that decided it.
pub type Start<T> = (T, BTreeSet<u32>);

/// Returns the contents that a cut of a complete run leaves of the flash `before` it.
pub fn left(before: &Contents, whole: &[Operation], cut: Cut) -> Contents {
    let (done, rest) = whole.split_at(cut.operation as usize);
    let mut contents = before.clone();
    for operation in done {
        contents.operate(operation, Leaves::After);
    }
    contents.operate(&rest[0], cut.leaves);
    contents
}

/// Iterates over the results of each cut of a complete run. A cut after one operation is a cut
/// before the next.
fn images(before: &Contents, whole: &[Operation]) -> impl Iterator<Item = (Cut, Contents)> {
    let mut contents = before.clone();
    let last = whole.len() - 1;
    let each = (0..).zip(whole.to_vec());
    each.flat_map(move |(operation, done)| {
        let after = (operation as usize == last).then_some(Leaves::After);
        let ways = [Leaves::Before, Leaves::Torn].into_iter().chain(after);
        let left = ways.map(|leaves| {
            let mut left = contents.clone();
            left.operate(&done, leaves);
            (Cut { operation, leaves }, left)
        });
        let left: Vec<_> = left.collect();
        contents.operate(&done, Leaves::After);
        left
    })
}

/// Starts a device with the result of each cut of a complete run, once for all images that a start
/// cannot distinguish. Passes each device's state to `judge`. Returns the number of starts.
pub fn start_each<T>(
    before: &Contents,
    whole: &[Operation],
    start: impl Fn(&Path) -> Start<T>,
    mut judge: impl FnMut(Cut, &Contents, &T),
) -> usize {
    let directory = tempfile::tempdir().unwrap();
    let flash = directory.path().join("flash");
    let mut started: Vec<(Contents, Start<T>)> = Vec::new();
    let mut count = 0;
    for (cut, image) in images(before, whole) {
        let is_alike = |(other, (_, words)): &(Contents, Start<T>)| {
            words
                .iter()
                .all(|word| other.word(*word) == image.word(*word))
        };
        let known = started.iter().rposition(is_alike).unwrap_or_else(|| {
            image.save(&flash).unwrap();
            let found = start(&flash);
            assert!(!found.1.is_empty(), "a start reads the flash");
            started.push((image.clone(), found));
            started.len() - 1
        });
        judge(cut, &image, &started[known].1.0);
        count += 1;
    }
    println!("{count} cuts leave {} images to a start", started.len());
    assert_eq!(count, 2 * whole.len() + 1);
    started.len()
}

/// Returns whether the flash holds these bytes at the beginning of one of the places for models, of
/// two sectors each.
pub fn holds_model(contents: &Contents, file: &[u8]) -> bool {
    let places = (BANK.start..BANK.end).step_by(2 * SECTOR_BYTES as usize);
    let is_here = |place: u32| {
        let words = (place..).step_by(WORD_BYTES as usize);
        (words.zip(file.chunks(WORD_BYTES as usize))).all(|(word, part)| {
            let read = contents.word(word);
            read.is_some_and(|read| read.starts_with(part))
        })
    };
    places.skip(1).take(2).any(is_here)
}

/// Returns the flash of a device whose settings were saved until its log's first sector was full.
/// The next save begins with an erase of the other sector.
pub fn full(mut contents: Contents) -> Contents {
    let sector = BANK.start..BANK.start + SECTOR_BYTES;
    let words = |range: std::ops::Range<u32>| range.step_by(WORD_BYTES as usize);
    let is_blank = |word: &u32| contents.word(*word) == Some(&[0xFF; WORD_BYTES as usize][..]);
    let end = words(sector.clone()).find(is_blank).expect("some room");
    let record = (end - sector.start) as usize;
    assert!(record > 0, "it keeps something");
    let programs = |contents: &Contents, word: u32, from: u32| Operation::Program {
        word,
        bytes: contents.word(from).unwrap().try_into().unwrap(),
    };
    let copies = SECTOR_BYTES as usize / record;
    for nth in 1..copies {
        for (number, from) in (0..).zip(words(sector.start..end)) {
            let word = sector.start + (nth * record) as u32 + number * WORD_BYTES;
            let operation = programs(&contents, word, from);
            contents.operate(&operation, Leaves::After);
        }
    }
    contents
}
