//! The bank's contents and the option bytes, in memory and in a file, and the effect of an
//! interrupted operation on them.

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, bail};

/// Addresses of the second bank.
pub const BANK: Range<u32> = 0x0810_0000..0x0820_0000;
/// Bytes of a sector.
pub const SECTOR_BYTES: u32 = 128 << 10;
/// Bytes of a word.
pub const WORD_BYTES: u32 = 32;
const BANK_BYTES: usize = (BANK.end - BANK.start) as usize;
/// FLASH_OPTSR as delivered (RM0433, table of option bytes).
pub const FACTORY_OPTIONS: u32 = 0x0006_AAF0;
/// Its bits of the brown-out level, BOR_LEV.
pub const LEVEL: u32 = 0b11 << 2;

/// The result of an interrupted operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaves {
    /// The state before the operation.
    Before,
    /// A word that cannot be read; a sector has some words of each state.
    Torn,
    /// The state after the complete operation.
    After,
}

/// A cut of the power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cut {
    /// The operation in which the power is cut, counted from 0.
    pub operation: u64,
    /// The result of that operation.
    pub leaves: Leaves,
}

impl FromStr for Cut {
    type Err = String;

    /// Reads `N` or `N:before`, `N:torn`, `N:after`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (number, leaves) = text.split_once(':').unwrap_or((text, "torn"));
        let operation = number
            .parse()
            .map_err(|_| format!("`{number}` is no number of a flash operation: use 0, 1, 2, …"))?;
        let leaves = match leaves {
            "before" => Leaves::Before,
            "torn" => Leaves::Torn,
            "after" => Leaves::After,
            _ => return Err(format!("`{leaves}`: a cut leaves before, torn or after")),
        };
        Ok(Self { operation, leaves })
    }
}

/// An operation of the bank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// A word is programmed.
    Program {
        /// Its address.
        word: u32,
        /// Its new contents.
        bytes: [u8; WORD_BYTES as usize],
    },
    /// A sector is erased.
    Erase {
        /// The sector's first address.
        sector: u32,
    },
    /// The option bytes are changed.
    Options {
        /// FLASH_OPTSR afterwards.
        options: u32,
    },
}

/// The bank's bytes, and its unreadable words; the option bytes, which are in the other bank.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contents {
    /// The bytes.
    pub array: Vec<u8>,
    /// The options of FLASH_OPTSR, at first those of a chip that has its brown-out level. All
    /// others are as delivered.
    pub options: u32,
    torn: BTreeSet<u32>,
    /// Words that were programmed, by their addresses.
    written: BTreeSet<u32>,
}

impl Default for Contents {
    fn default() -> Self {
        Self {
            array: vec![0xFF; BANK_BYTES],
            options: FACTORY_OPTIONS | LEVEL,
            torn: BTreeSet::new(),
            written: BTreeSet::new(),
        }
    }
}

impl Contents {
    /// Returns a blank bank of a chip with these options.
    pub fn with_options(options: u32) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }

    /// Reads a file: the bank's bytes, FLASH_OPTSR, then the addresses of torn words,
    /// little-endian.
    ///
    /// # Errors
    /// If it cannot be read, or has another format.
    pub fn load(file: &Path) -> anyhow::Result<Self> {
        let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
        let (array, rest) = bytes.split_at_checked(BANK_BYTES).unwrap_or_default();
        let (words, surplus) = rest.as_chunks();
        let mut words = words.iter().map(|word| u32::from_le_bytes(*word));
        let Some(options) = words.next().filter(|_| surplus.is_empty()) else {
            bail!(
                "{}: no contents of a flash bank, which have {BANK_BYTES} bytes, the options and \
                 the addresses of torn words",
                file.display()
            );
        };
        let torn = words.collect();
        let words = array.chunks(WORD_BYTES as usize);
        let addresses = BANK.step_by(WORD_BYTES as usize);
        let is_blank = |word: &[u8]| word.iter().all(|byte| *byte == 0xFF);
        let written = addresses.zip(words).filter(|(_, word)| !is_blank(word));
        Ok(Self {
            array: array.to_vec(),
            options,
            torn,
            written: written.map(|(address, _)| address).collect(),
        })
    }

    /// Writes such a file. The file before stays whole until the new one is, whatever ends this
    /// program.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn save(&self, file: &Path) -> anyhow::Result<()> {
        let words = std::iter::once(&self.options).chain(&self.torn);
        let words = words.flat_map(|word| word.to_le_bytes());
        let bytes: Vec<u8> = self.array.iter().copied().chain(words).collect();
        let mut new = file.as_os_str().to_owned();
        new.push(format!(".{}.new", std::process::id()));
        std::fs::write(&new, bytes)
            .and_then(|()| std::fs::rename(&new, file))
            .inspect_err(|_| drop(std::fs::remove_file(&new)))
            .with_context(|| file.display().to_string())
    }

    /// Returns the count of unreadable words.
    pub fn torn(&self) -> usize {
        self.torn.len()
    }

    /// Returns the word at an address; `None` if it cannot be read.
    pub fn word(&self, address: u32) -> Option<&[u8]> {
        let at = (address - BANK.start) as usize;
        let bytes = &self.array[at..at + WORD_BYTES as usize];
        (!self.torn.contains(&address)).then_some(bytes)
    }

    /// Carries out an operation, completely or with the result of a power cut. A change of options
    /// that was cut keeps the old ones (RM0433, FLASH option bytes).
    pub fn operate(&mut self, operation: &Operation, leaves: Leaves) {
        match (*operation, leaves) {
            (_, Leaves::Before) | (Operation::Options { .. }, Leaves::Torn) => {}
            (Operation::Options { options }, Leaves::After) => self.options = options,
            (Operation::Program { word, .. }, Leaves::Torn) => self.tear_word(word),
            (Operation::Erase { sector }, Leaves::Torn) => self.tear_sector(sector),
            (Operation::Program { word, bytes }, Leaves::After) => {
                let at = (word - BANK.start) as usize;
                self.array[at..at + bytes.len()].copy_from_slice(&bytes);
                self.programmed(word);
            }
            (Operation::Erase { sector }, Leaves::After) => {
                let at = (sector - BANK.start) as usize;
                self.array[at..at + SECTOR_BYTES as usize].fill(0xFF);
                self.erased(sector);
            }
        }
    }

    pub(super) fn is_torn(&self, range: Range<u64>) -> bool {
        let from = range.start as u32 / WORD_BYTES * WORD_BYTES;
        self.torn.range(from..range.end as u32).next().is_some()
    }

    /// Marks a word as programmed. Returns whether it was blank.
    pub(super) fn programmed(&mut self, word: u32) -> bool {
        self.written.insert(word) && !self.torn.contains(&word)
    }

    pub(super) fn erased(&mut self, sector: u32) {
        let words = sector..sector + SECTOR_BYTES;
        self.torn.retain(|word| !words.contains(word));
        self.written.retain(|word| !words.contains(word));
    }

    fn tear_word(&mut self, word: u32) {
        self.torn.insert(word);
    }

    /// Tears a sector: of three words one is blank, one is unreadable, and one is unchanged.
    fn tear_sector(&mut self, sector: u32) {
        let words = (sector..sector + SECTOR_BYTES).step_by(WORD_BYTES as usize);
        for (nth, word) in words.enumerate() {
            let at = (word - BANK.start) as usize;
            match nth % 3 {
                0 => {
                    self.array[at..at + WORD_BYTES as usize].fill(0xFF);
                    self.torn.remove(&word);
                }
                1 => self.tear_word(word),
                _ => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_come_back_from_their_file() {
        let mut contents = Contents::default();
        contents.array[64] = 7;
        contents.options = FACTORY_OPTIONS;
        contents.tear_word(BANK.start + 32);
        let file = tempfile::NamedTempFile::new().unwrap();
        contents.save(file.path()).unwrap();
        let read = Contents::load(file.path()).unwrap();
        assert_eq!((&read.array, &read.torn), (&contents.array, &contents.torn));
        assert_eq!(read.options, FACTORY_OPTIONS);
        let mut read = read;
        assert!(!read.programmed(BANK.start + 64), "it is not blank");
        assert!(!read.programmed(BANK.start + 32), "it is torn");
        assert!(read.programmed(BANK.start));
        assert!(read.is_torn(u64::from(BANK.start)..u64::from(BANK.start) + 128));
        assert!(!read.is_torn(u64::from(BANK.start)..u64::from(BANK.start) + 32));
    }

    #[test]
    fn an_erase_makes_torn_words_blank_and_a_cut_one_leaves_some_of_each() {
        let mut contents = Contents::default();
        contents.array[..SECTOR_BYTES as usize].fill(0);
        contents.tear_sector(BANK.start);
        assert_eq!(contents.torn(), 1365);
        assert_eq!((contents.array[0], contents.array[64]), (0xFF, 0));
        contents.erased(BANK.start);
        assert_eq!(contents.torn(), 0);
    }

    #[test]
    fn an_operation_leaves_what_was_there_something_torn_or_what_was_to_be() {
        let word = BANK.start + 64;
        let bytes = [7; WORD_BYTES as usize];
        let program = Operation::Program { word, bytes };
        let sector = BANK.start;
        let erase = Operation::Erase { sector };
        let mut contents = Contents::default();
        contents.operate(&program, Leaves::Before);
        assert_eq!(contents, Contents::default());
        contents.operate(&program, Leaves::Torn);
        assert_eq!((contents.word(word), contents.torn()), (None, 1));
        contents.operate(&erase, Leaves::After);
        assert_eq!(contents, Contents::default());
        contents.operate(&program, Leaves::After);
        assert_eq!(contents.word(word), Some(&bytes[..]));
        assert!(!contents.programmed(word), "it is not blank");
        contents.operate(&erase, Leaves::Torn);
        assert_eq!(
            (contents.word(word), contents.torn()),
            (Some(&bytes[..]), 1365)
        );
        contents.operate(&erase, Leaves::After);
        assert_eq!(contents, Contents::default());
    }

    #[test]
    fn a_cut_change_of_options_keeps_the_old_ones() {
        let change = Operation::Options { options: 7 };
        let mut contents = Contents::default();
        contents.operate(&change, Leaves::Before);
        contents.operate(&change, Leaves::Torn);
        assert_eq!(contents, Contents::default());
        contents.operate(&change, Leaves::After);
        assert_eq!(contents.options, 7);
    }

    #[test]
    fn a_cut_that_makes_no_sense_is_explained() {
        let cut: Cut = "12:after".parse().unwrap();
        assert_eq!((cut.operation, cut.leaves), (12, Leaves::After));
        assert_eq!("3".parse::<Cut>().unwrap().leaves, Leaves::Torn);
        for (text, word) in [("x", "`x`"), ("1:half", "half")] {
            let error = text.parse::<Cut>().unwrap_err();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn a_file_of_another_size_is_refused() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let error = Contents::load(file.path()).unwrap_err().to_string();
        assert!(error.contains("bytes"), "{error}");
    }
}
