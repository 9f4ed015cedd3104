//! What was executed while the program asked for it to be recorded.

use std::collections::{BTreeMap, BTreeSet};

/// What a call of one of the program's marking functions means.
#[derive(Clone, Copy)]
pub enum Mark {
    /// Record from here on.
    Begin,
    /// Record no longer.
    End,
    /// What comes now is part 1.
    LastBand,
}

struct Block {
    addresses: Vec<u64>,
    /// The marking functions themselves, their return included, are not recorded.
    mark: Option<Mark>,
}

/// Blocks, and how they followed each other.
pub struct Record {
    blocks: Vec<Block>,
    recording: bool,
    part: u8,
    /// The block that ran last, since recording began.
    before: Option<usize>,
    /// How often a block ran in a part after another.
    runs: BTreeMap<(u8, Option<usize>, usize), u64>,
}

impl Record {
    /// Before anything ran.
    pub const fn new() -> Record {
        Record {
            blocks: Vec::new(),
            recording: false,
            part: 0,
            before: None,
            runs: BTreeMap::new(),
        }
    }

    /// A block was translated: gives the number that it is run by.
    pub fn add_block(&mut self, addresses: Vec<u64>, mark: Option<Mark>) -> usize {
        self.blocks.push(Block { addresses, mark });
        self.blocks.len() - 1
    }

    /// A block runs.
    pub fn run(&mut self, number: usize) {
        match self.blocks[number].mark {
            Some(Mark::Begin) => {
                self.recording = true;
                self.before = None;
            }
            Some(Mark::End) => self.recording = false,
            Some(Mark::LastBand) => self.part = 1,
            None if self.recording => {
                *self
                    .runs
                    .entry((self.part, self.before, number))
                    .or_default() += 1;
                self.before = Some(number);
            }
            None => {}
        }
    }

    /// Everything, as the crate's documentation describes.
    pub fn report(&self) -> String {
        let (blocks, numbers) = self.blocks_that_ran();
        let mut runs = BTreeMap::<_, u64>::new();
        for (&(part, before, block), count) in &self.runs {
            let before = before.map(|before| numbers[before]);
            *runs.entry((part, before, numbers[block])).or_default() += count;
        }
        let runs = runs.into_iter().map(|((part, before, block), count)| {
            let before = before.map_or("null".to_owned(), |before| before.to_string());
            format!("[{},{before},{block},{count}]", part == 1)
        });
        let runs: Vec<String> = runs.collect();
        format!("{{\"blocks\":{blocks:?},\"runs\":[{}]}}\n", runs.join(","))
    }

    /// Each block that ran, once, and its number among these by that of translation.
    fn blocks_that_ran(&self) -> (Vec<&Vec<u64>>, Vec<usize>) {
        let ran: BTreeSet<usize> = self.runs.keys().map(|(.., block)| *block).collect();
        let mut numbers = vec![usize::MAX; self.blocks.len()];
        let (mut blocks, mut known) = (Vec::new(), BTreeMap::new());
        for number in ran {
            let addresses = &self.blocks[number].addresses;
            numbers[number] = *known.entry(addresses).or_insert_with(|| {
                blocks.push(addresses);
                blocks.len() - 1
            });
        }
        (blocks, numbers)
    }
}
