//! What was executed while the program asked for it to be recorded.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Bytes of a cache line of the Cortex-M7: loads are told apart no finer.
const LINE: u64 = 32;

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

/// Blocks, how they followed each other, and loads.
pub struct Record {
    blocks: Vec<Block>,
    recording: bool,
    part: u8,
    /// The block that ran last, since recording began.
    before: Option<usize>,
    /// How often a block ran in a part after another.
    runs: BTreeMap<(u8, Option<usize>, usize), u64>,
    /// Loads in a part by the number of the cache line.
    loads: BTreeMap<(u8, u64), u64>,
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
            loads: BTreeMap::new(),
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

    /// Something is loaded.
    pub fn load(&mut self, address: u64) {
        if self.recording {
            *self.loads.entry((self.part, address / LINE)).or_default() += 1;
        }
    }

    /// Everything, in the lines that the crate's documentation describes.
    pub fn report(&self) -> String {
        let mut text = String::new();
        for (number, block) in self.blocks.iter().enumerate() {
            if self.runs.keys().any(|(_, _, ran)| *ran == number) {
                let _ = write!(text, "block {number:x}");
                for address in &block.addresses {
                    let _ = write!(text, " {address:x}");
                }
                text.push('\n');
            }
        }
        for ((part, before, number), count) in &self.runs {
            let before = before.map_or("-".to_owned(), |before| format!("{before:x}"));
            let _ = writeln!(text, "run {part} {before} {number:x} {count}");
        }
        for ((part, line), count) in &self.loads {
            let _ = writeln!(text, "load {part} {:x} {count}", line * LINE);
        }
        text
    }
}
