//! Keeps one record through power cuts, as a log in two sectors.
//!
//! # Design
//! Saving appends the whole record; the last record that reads correctly is the one that is kept. A
//! record is never changed in place. When a sector is full, the other one, which has only older
//! records, is erased. The log continues there with a higher *generation*, which each record
//! carries. The sector with the newest record is never erased.
//!
//! A word whose programming was cut off may read correctly now and not tomorrow, or the other way
//! round. So each record is followed by a *seal*, programmed after the record. A non-blank word
//! after a record proves that all words of the record were programmed completely. If the last
//! record has no seal, or is followed by words that are not a record, the log is not *settled*.
//! Whoever opened it must then save the record again, behind all of that; older or unfinished
//! records no longer count.
//!
//! A word that does not read back as programmed is skipped, and the record is written anew behind
//! it.

use crate::storage::blob;
use crate::storage::flash::{self, BLANK, Failed, Flash, Place};
use crate::storage::record::{self, Header};
use core::ops::Range;

pub use crate::storage::record::PAYLOAD_LIMIT;

/// Number of sectors of a log: the first two of its flash.
const SECTORS: u32 = 2;
/// Number of attempts to write a record.
const ATTEMPTS: u32 = 8;

/// Why a record was not saved. The previous record is still kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveError {
    /// It is longer than [`PAYLOAD_LIMIT`].
    TooLong,
    /// The flash is worn: the record read back in no place.
    Worn,
}

/// A log in the first two sectors of a flash.
#[derive(Debug)]
pub struct Log<F> {
    flash: F,
    newest: Option<Newest>,
    /// Generation of the sector that is being written.
    generation: u32,
    /// The next word to program; `None` if the next record begins a new sector.
    end: Option<Place>,
    settled: bool,
    failures: u32,
}

#[derive(Clone, Copy, Debug)]
struct Newest {
    sector: u32,
    length: u16,
}

impl<F: Flash> Log<F> {
    /// Opens the log and reads the newest payload into the front of `payload`. Returns its length;
    /// `None` if the log is empty.
    pub fn open(flash: F, payload: &mut [u8; PAYLOAD_LIMIT]) -> (Self, Option<usize>) {
        let mut log = Self {
            flash,
            newest: None,
            generation: 0,
            end: None,
            settled: true,
            failures: 0,
        };
        for sector in 0..SECTORS {
            log.scan(sector, payload);
        }
        for sector in 0..SECTORS {
            log.look_at_the_start(sector);
        }
        let length = log.newest.map(|newest| usize::from(newest.length));
        (log, length)
    }

    /// Returns false if the record may read differently the next time: save it again.
    pub fn is_settled(&self) -> bool {
        self.settled
    }

    /// Number of failed attempts to write a record or a blob since the log was opened.
    pub fn failures(&self) -> u32 {
        self.failures
    }

    /// Number of sectors erased in the life of this log.
    pub fn erases(&self) -> u32 {
        self.generation
    }

    /// Erases those of some sectors that a [`blob`] needs, writes it into them, and reads it back.
    /// They must not be the log's.
    ///
    /// # Errors
    /// [`Failed`]: the bytes do not fit the sectors, or do not read back.
    pub async fn write_blob(&mut self, sectors: Range<u32>, bytes: &[u8]) -> Result<(), Failed> {
        let written = blob::write(&mut self.flash, sectors, bytes).await;
        if written.is_err() {
            self.count_failure();
        }
        written
    }

    /// Returns the flash, for access to its other sectors.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Keeps `payload` from now on.
    ///
    /// # Errors
    /// [`SaveError`]; the previous record is still kept.
    pub async fn save(&mut self, payload: &[u8]) -> Result<(), SaveError> {
        let length = u16::try_from(payload.len()).map_err(|_| SaveError::TooLong)?;
        if payload.len() > PAYLOAD_LIMIT {
            return Err(SaveError::TooLong);
        }
        for _ in 0..ATTEMPTS {
            match self.append(payload).await {
                Ok(sector) => {
                    self.settled = true;
                    self.newest = Some(Newest { sector, length });
                    return Ok(());
                }
                Err(Failed) => self.count_failure(),
            }
        }
        Err(SaveError::Worn)
    }

    fn count_failure(&mut self) {
        self.failures = self.failures.saturating_add(1);
    }

    /// Writes a record and its seal behind the previous one; returns the number of the sector.
    async fn append(&mut self, payload: &[u8]) -> Result<u32, Failed> {
        let words = record::words(payload.len());
        let first = self.room_for(words).await?;
        let header = Header::new(self.generation, payload).ok_or(Failed)?;
        for nth in 0..words {
            let place = first.behind(nth);
            // Whatever happens, this word is not programmed again, and the next one is reserved for
            // a seal, in case the record later reads correctly.
            self.end = Some(place.behind(2));
            let word = record::word(&header, payload, nth);
            flash::program(&mut self.flash, place, &word).await?;
        }
        let seal = first.behind(words);
        self.end = Some(seal.behind(1));
        // A seal that does not read back still counts, because it is not blank.
        let _ = self.flash.program(seal, &record::seal()).await;
        Ok(first.sector)
    }

    /// Returns a place for a record of `words` words and its seal: behind the last one, or in the
    /// other sector, which is erased.
    async fn room_for(&mut self, words: u32) -> Result<Place, Failed> {
        let fits = |end: &Place| end.word + words < F::SECTOR_WORDS;
        if let Some(end) = self.end.filter(fits) {
            return Ok(end);
        }
        let last = match (self.newest, self.end) {
            (Some(newest), _) => Some(newest.sector),
            (None, end) => end.map(|end| end.sector),
        };
        let sector = last.map_or(0, |last| (last + 1) % SECTORS);
        self.end = None;
        self.flash.erase(sector).await?;
        self.generation = self.generation.saturating_add(1);
        let start = Place { sector, word: 0 };
        self.end = Some(start);
        Ok(start)
    }

    /// Finds the last record of a sector, and takes it if its generation is the highest so far.
    /// Blank words do not end the search: a word that could not be programmed may be blank.
    fn scan(&mut self, sector: u32, payload: &mut [u8; PAYLOAD_LIMIT]) {
        let mut place = Place { sector, word: 0 };
        while place.word < F::SECTOR_WORDS {
            let read = self.flash.read(place);
            let header = read.ok().as_ref().and_then(Header::of);
            let record = header.filter(|header| self.take(place, header, payload));
            if read != Ok(BLANK) && self.is_newest_in(sector) {
                // An unreadable record may end with this word; the next one may be its seal.
                self.end = Some(place.behind(record.map_or(2, |header| header.words() + 1)));
                self.settled &= record.is_some();
            }
            place = place.behind(record.map_or(1, |header| header.words() + 1));
        }
    }

    fn is_newest_in(&self, sector: u32) -> bool {
        self.newest.is_some_and(|newest| newest.sector == sector)
    }

    /// A sector without the newest record begins with an older record or a blank word. Otherwise it
    /// begins with an unfinished record, and is written next.
    fn look_at_the_start(&mut self, sector: u32) {
        if self.is_newest_in(sector) {
            return;
        }
        let is_old = match self.flash.read(Place { sector, word: 0 }) {
            Ok(BLANK) => true,
            Ok(word) => Header::of(&word).is_some_and(|header| header.generation < self.generation),
            Err(_) => false,
        };
        if !is_old {
            self.settled = false;
            self.end = None;
        }
    }

    /// Takes the record that begins at a place, unless it is older. Returns false if it does not
    /// read correctly.
    fn take(&mut self, at: Place, header: &Header, payload: &mut [u8; PAYLOAD_LIMIT]) -> bool {
        let mut read = [0; PAYLOAD_LIMIT];
        let Some(read) = read.get_mut(..usize::from(header.length)) else {
            return false;
        };
        if !self.read_record(at, header, read) {
            return false;
        }
        if header.generation >= self.generation {
            self.generation = header.generation;
            self.newest = Some(Newest {
                sector: at.sector,
                length: header.length,
            });
            let seal = at.behind(header.words());
            self.settled = self.flash.read(seal) != Ok(BLANK);
            for (byte, value) in payload.iter_mut().zip(read) {
                *byte = *value;
            }
        }
        true
    }

    fn read_record(&mut self, at: Place, header: &Header, payload: &mut [u8]) -> bool {
        // The record and its seal must fit the sector.
        let mut whole = at.word + header.words() < F::SECTOR_WORDS;
        for nth in 0..header.words() {
            whole = whole
                && (self.flash.read(at.behind(nth)))
                    .is_ok_and(|word| record::take(&word, nth, payload));
        }
        whole && header.fits(payload)
    }
}
