//! Attacks on a log in flash whose words were overwritten, torn or worn in any way. The log opens,
//! and saved data are there at the next start.

use core::pin::pin;
use core::task::{Context, Poll, Waker};

use arbitrary::{Result, Unstructured};
use hivtac_portable::storage::flash::{BLANK, Failed, Flash, Place, Unreadable, WORD_BYTES, Word};
use hivtac_portable::storage::{Log, PAYLOAD_LIMIT};

const SECTOR_WORDS: u32 = 24;
const WORDS: usize = 2 * SECTOR_WORDS as usize;
/// The largest number of steps of one attack.
const STEPS: usize = 64;

/// The effect of programming on a word.
#[derive(Clone, Copy, PartialEq, Eq, arbitrary::Arbitrary)]
enum Wear {
    /// The word has the programmed value.
    Good,
    /// The word cannot be read afterwards.
    Torn,
    /// The word does not change.
    Deaf,
}

/// Two sectors: each word's value, if it can be read, and its wear.
struct Cells {
    words: [std::result::Result<Word, Unreadable>; WORDS],
    wear: [Wear; WORDS],
}

struct Mock<'c>(&'c mut Cells);

fn index(place: Place) -> usize {
    assert!(place.sector < 2 && place.word < SECTOR_WORDS, "{place:?}");
    (place.sector * SECTOR_WORDS + place.word) as usize
}

impl Flash for Mock<'_> {
    const SECTOR_WORDS: u32 = SECTOR_WORDS;

    fn read(&mut self, place: Place) -> std::result::Result<Word, Unreadable> {
        self.0.words[index(place)]
    }

    async fn program(&mut self, place: Place, word: &Word) -> std::result::Result<(), Failed> {
        let at = index(place);
        let word = match (self.0.wear[at], self.0.words[at]) {
            (Wear::Deaf, _) => return Err(Failed),
            (Wear::Good, Ok(BLANK)) => Ok(*word),
            _ => Err(Unreadable),
        };
        self.0.words[at] = word;
        word.map(drop).map_err(|_| Failed)
    }

    async fn erase(&mut self, sector: u32) -> std::result::Result<(), Failed> {
        let first = index(Place { sector, word: 0 });
        self.0.words[first..first + SECTOR_WORDS as usize].fill(Ok(BLANK));
        Ok(())
    }
}

/// Returns the payload of a device at its start; `None` if its log is empty.
fn kept(cells: &mut Cells) -> Option<Vec<u8>> {
    let mut payload = [0; PAYLOAD_LIMIT];
    let (_, length) = Log::open(Mock(cells), &mut payload);
    length.map(|length| payload[..length].to_vec())
}

/// Opens the log and saves a payload. Returns whether that succeeded.
fn save(cells: &mut Cells, payload: &[u8]) -> bool {
    let (mut log, _) = Log::open(Mock(cells), &mut [0; PAYLOAD_LIMIT]);
    let mut context = Context::from_waker(Waker::noop());
    match pin!(log.save(payload)).poll(&mut context) {
        Poll::Ready(result) => result.is_ok(),
        Poll::Pending => unreachable!("nothing here waits"),
    }
}

/// Attacks with the steps that the input describes.
pub fn attack(input: &[u8]) -> bool {
    let mut cells = Cells {
        words: [Ok(BLANK); WORDS],
        wear: [Wear::Good; WORDS],
    };
    let mut input = Unstructured::new(input);
    let mut saved = false;
    for _ in 0..STEPS {
        // The end of the input ends the attack.
        match step(&mut cells, &mut input) {
            Ok(went_well) => saved |= went_well,
            Err(_) => break,
        }
    }
    saved
}

fn step(cells: &mut Cells, input: &mut Unstructured<'_>) -> Result<bool> {
    if input.is_empty() {
        return Err(arbitrary::Error::NotEnoughData);
    }
    let at = input.choose_index(WORDS)?;
    match input.int_in_range(0..=5)? {
        0 => cells.words[at] = Err(Unreadable),
        1 => cells.wear[at] = input.arbitrary()?,
        2 => overwrite(&mut cells.words[at], input.arbitrary()?),
        3 => {
            let mut word = cells.words[at].unwrap_or_default();
            word[input.choose_index(WORD_BYTES)?] = input.arbitrary()?;
            overwrite(&mut cells.words[at], word);
        }
        _ => {
            let length = input.arbitrary::<u8>()?;
            let payload = input.bytes(usize::from(length).min(input.len()))?;
            return Ok(saved_is_kept(cells, payload));
        }
    }
    // The payload, whatever it is, is the same at the next start.
    assert_eq!(kept(cells), kept(cells));
    Ok(false)
}

/// Overwrites a programmed word: it gets a different value, but never a blank one.
fn overwrite(cell: &mut std::result::Result<Word, Unreadable>, word: Word) {
    if *cell != Ok(BLANK) && word != BLANK {
        *cell = Ok(word);
    }
}

/// Checks that a saved payload is there at the next start, and that a failed save leaves the one
/// before.
fn saved_is_kept(cells: &mut Cells, payload: &[u8]) -> bool {
    let before = kept(cells);
    let went_well = save(cells, payload);
    let after = kept(cells);
    match went_well {
        true => assert_eq!(after.as_deref(), Some(payload)),
        false => assert_eq!(after, before),
    }
    went_well
}
