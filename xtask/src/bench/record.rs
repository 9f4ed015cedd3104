//! What the plugin (`xtask/instruction-counter`) recorded of one run.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

/// The instructions of a block, by their addresses, in order.
pub type Block = Vec<u64>;

/// Whole frame, or only what happens once its last band of rows is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Everything.
    Whole,
    /// From the last band of rows on.
    LastBand,
}

/// How often a block ran after another.
#[derive(Debug, PartialEq, Eq)]
struct Run {
    last_band: bool,
    /// The block before; `None` when it is the first after a call.
    before: Option<usize>,
    block: usize,
    count: u64,
}

/// Blocks, how they followed each other, and loads.
#[derive(Debug, Default)]
pub struct Record {
    blocks: Vec<Block>,
    runs: Vec<Run>,
    /// Loads by the address of 32 bytes.
    loads: BTreeMap<u64, u64>,
}

impl Record {
    /// Reads what the plugin wrote.
    ///
    /// # Errors
    /// At a line that means nothing; says which.
    pub fn parse(text: &str) -> Result<Record> {
        let mut record = Record::default();
        let mut numbers = Numbers::default();
        for line in text.lines() {
            record
                .add_line(line, &mut numbers)
                .with_context(|| format!("the plugin printed the line `{line}`"))?;
        }
        ensure!(!record.runs.is_empty(), "the plugin counted nothing");
        Ok(record)
    }

    fn add_line(&mut self, line: &str, numbers: &mut Numbers) -> Result<()> {
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["block", number, ..] => {
                let addresses = words[2..].iter().map(|word| hex(word));
                numbers.add(hex(number)?, addresses.collect::<Result<_>>()?, self);
            }
            ["run", part, before, block, count] => {
                let before = (before != "-").then(|| numbers.find(before)).transpose()?;
                self.runs.push(Run {
                    last_band: part == "1",
                    before,
                    block: numbers.find(block)?,
                    count: count.parse()?,
                });
            }
            ["load", _, address, count] => {
                *self.loads.entry(hex(address)?).or_default() += count.parse::<u64>()?;
            }
            _ => anyhow::bail!("it is neither a block nor a run nor a load"),
        }
        Ok(())
    }

    /// All blocks that ran.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// How often each block ran in a part.
    pub fn counts(&self, part: Part) -> Vec<u64> {
        let mut counts = vec![0; self.blocks.len()];
        let runs = self.runs.iter();
        for run in runs.filter(|run| part == Part::Whole || run.last_band) {
            counts[run.block] += run.count;
        }
        counts
    }

    /// How often each instruction ran.
    pub fn executions(&self) -> BTreeMap<u64, u64> {
        let mut executions = BTreeMap::new();
        for (block, count) in self.blocks.iter().zip(self.counts(Part::Whole)) {
            for address in block {
                *executions.entry(*address).or_default() += count;
            }
        }
        executions
    }

    /// The block that most often came right before each one.
    pub fn usual_predecessors(&self) -> Vec<Option<usize>> {
        let mut best = vec![None; self.blocks.len()];
        for ((from, to), count) in self.steps() {
            if best[to].is_none_or(|(most, _)| count > most) {
                best[to] = Some((count, from));
            }
        }
        let from = |best: Option<(u64, usize)>| best.map(|(_, from)| from);
        best.into_iter().map(from).collect()
    }

    /// How often a block was left another way than it usually is. A predictor that always guesses
    /// the usual way is wrong so often.
    pub fn unusual_exits(&self) -> u64 {
        let mut exits: BTreeMap<usize, (u64, u64)> = BTreeMap::new();
        for ((from, _), count) in self.steps() {
            let (sum, most) = exits.entry(from).or_default();
            *sum += count;
            *most = count.max(*most);
        }
        exits.values().map(|(sum, most)| sum - most).sum()
    }

    /// Loads, and how many different 32 bytes they touched, within a range of addresses.
    pub fn loads(&self, addresses: std::ops::Range<u64>) -> (u64, u64) {
        let found = self.loads.range(addresses);
        found.fold((0, 0), |(loads, lines), (_, count)| {
            (loads + count, lines + 1)
        })
    }

    fn steps(&self) -> BTreeMap<(usize, usize), u64> {
        let mut steps = BTreeMap::new();
        for run in &self.runs {
            if let Some(before) = run.before {
                *steps.entry((before, run.block)).or_default() += run.count;
            }
        }
        steps
    }
}

/// The plugin's numbers of blocks: several of them may be the same block.
#[derive(Default)]
struct Numbers {
    index: BTreeMap<u64, usize>,
    known: BTreeMap<Block, usize>,
}

impl Numbers {
    fn add(&mut self, number: u64, block: Block, record: &mut Record) {
        let blocks = &mut record.blocks;
        let index = *self.known.entry(block).or_insert_with_key(|block| {
            blocks.push(block.clone());
            blocks.len() - 1
        });
        self.index.insert(number, index);
    }

    fn find(&self, number: &str) -> Result<usize> {
        let index = self.index.get(&hex(number)?);
        index
            .copied()
            .with_context(|| format!("there is no block {number}"))
    }
}

fn hex(word: &str) -> Result<u64> {
    Ok(u64::from_str_radix(word, 16)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Block 0 loops three times, then comes block 1; block 2 is block 0, translated again.
    const LOOP: &str = "block 0 1a0 1a2\nblock 1 1a6\nblock 2 1a0 1a2\nrun 0 - 0 1\nrun 0 0 0 \
                        2\nrun 0 0 1 1\n\
                        run 1 1 2 1\nload 0 20000000 3\nload 1 20000020 4\nload 1 60000000 5\n";

    #[test]
    fn counts_of_a_block_add_up() {
        let record = Record::parse(LOOP).unwrap();
        assert_eq!(record.blocks(), [vec![0x1a0, 0x1a2], vec![0x1a6]]);
        assert_eq!(record.counts(Part::Whole), [4, 1]);
        assert_eq!(record.counts(Part::LastBand), [1, 0]);
        assert_eq!(record.executions()[&0x1a2], 4);
    }

    #[test]
    fn the_usual_way_is_the_commonest() {
        let record = Record::parse(LOOP).unwrap();
        assert_eq!(record.usual_predecessors(), [Some(0), Some(0)]);
        // The loop ends once.
        assert_eq!(record.unusual_exits(), 1);
    }

    #[test]
    fn loads_are_told_apart_by_their_addresses() {
        let record = Record::parse(LOOP).unwrap();
        assert_eq!(record.loads(0x2000_0000..0x3000_0000), (7, 2));
        assert_eq!(record.loads(0x6000_0000..0x7000_0000), (5, 1));
    }

    #[test]
    fn a_line_without_meaning_is_named() {
        for text in ["no line", "block 0 1a0\nrun 0 - 7 1", "block x", ""] {
            assert!(Record::parse(text).is_err(), "{text}");
        }
    }
}
