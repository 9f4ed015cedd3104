//! Records the executed blocks while the program requests it.

use std::collections::{BTreeMap, BTreeSet};

/// The meaning of a call of a marking function.
#[derive(Clone, Copy)]
pub enum Mark {
    /// Recording begins.
    Begin,
    /// Recording ends.
    End,
    /// Part 1 begins.
    LastBand,
}

struct Block {
    addresses: Vec<u64>,
    /// The block's mark. Marking functions are not recorded, up to their return.
    mark: Option<Mark>,
}

/// The blocks, and their order of execution.
pub struct Record {
    blocks: Vec<Block>,
    recording: bool,
    part: u8,
    /// The block that ran last since recording began.
    before: Option<usize>,
    /// Number of executions by part, block before, and block.
    runs: BTreeMap<(u8, Option<usize>, usize), u64>,
}

impl Record {
    /// An empty record.
    pub const fn new() -> Record {
        Record {
            blocks: Vec::new(),
            recording: false,
            part: 0,
            before: None,
            runs: BTreeMap::new(),
        }
    }

    /// Adds a translated block; returns its number for [`Record::run`].
    pub fn add_block(&mut self, addresses: Vec<u64>, mark: Option<Mark>) -> usize {
        self.blocks.push(Block { addresses, mark });
        self.blocks.len() - 1
    }

    /// Records the execution of a block.
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

    /// The whole record, in the format of the crate's documentation.
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

    /// Each block that ran, once; and its index among these, by its number of translation.
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
