//! What the plugin (`xtask/instruction-counter`) recorded of one run.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};

/// How often a block ran after another.
#[derive(Debug)]
struct Run {
    last_band: bool,
    /// The block before; `None` when it is the first after a call.
    before: Option<usize>,
    block: usize,
    count: u64,
}

/// Blocks, and how they followed each other.
#[derive(Debug, Default)]
pub struct Record {
    /// The instructions of each block, by their addresses, in order.
    pub blocks: Vec<Vec<u64>>,
    runs: Vec<Run>,
}

impl Record {
    /// Reads what the plugin wrote.
    pub fn parse(text: &str) -> Result<Record> {
        let mut record = Record::default();
        for line in text.lines() {
            let added = record.add_line(line);
            added.with_context(|| format!("the plugin printed the line `{line}`"))?;
        }
        ensure!(!record.runs.is_empty(), "the plugin counted nothing");
        Ok(record)
    }

    fn add_line(&mut self, line: &str) -> Result<()> {
        let words: Vec<&str> = line.split(' ').collect();
        let block = |word: &str| {
            let number: usize = word.parse()?;
            ensure!(number < self.blocks.len(), "there is no block {number}");
            Ok(number)
        };
        match words[..] {
            ["block", ..] => {
                let addresses = words[1..].iter().map(|word| u64::from_str_radix(word, 16));
                self.blocks.push(addresses.collect::<Result<_, _>>()?);
            }
            ["run", part, before, after, count] => self.runs.push(Run {
                last_band: part == "1",
                before: (before != "-").then(|| block(before)).transpose()?,
                block: block(after)?,
                count: count.parse()?,
            }),
            _ => bail!("it is neither a block nor a run"),
        }
        Ok(())
    }

    /// How often each block ran, in all or only once the last band of rows was there.
    pub fn counts(&self, only_last_band: bool) -> Vec<u64> {
        let mut counts = vec![0; self.blocks.len()];
        for run in self
            .runs
            .iter()
            .filter(|run| run.last_band || !only_last_band)
        {
            counts[run.block] += run.count;
        }
        counts
    }

    /// How often each instruction ran.
    pub fn executions(&self) -> BTreeMap<u64, u64> {
        let mut executions = BTreeMap::new();
        for (block, count) in self.blocks.iter().zip(self.counts(false)) {
            for address in block {
                *executions.entry(*address).or_default() += count;
            }
        }
        executions
    }

    /// The block that most often came right before each one.
    pub fn usual_predecessors(&self) -> Vec<Option<usize>> {
        let mut steps = BTreeMap::<_, u64>::new();
        for run in &self.runs {
            if let Some(before) = run.before {
                *steps.entry((before, run.block)).or_default() += run.count;
            }
        }
        let mut best = vec![(0, None); self.blocks.len()];
        for ((from, to), count) in steps {
            if count > best[to].0 {
                best[to] = (count, Some(from));
            }
        }
        best.into_iter().map(|(_, from)| from).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Block 0 loops three times, then comes block 1, and in the last band block 0 again.
    const LOOP: &str = "block 1a0 1a2\nblock 1a6\nrun 0 - 0 1\nrun 0 0 0 2\nrun 0 0 1 1\n\
                        run 1 1 0 1\n";

    #[test]
    fn counts_add_up_and_the_usual_way_is_the_commonest() {
        let record = Record::parse(LOOP).unwrap();
        assert_eq!(record.blocks, [vec![0x1a0, 0x1a2], vec![0x1a6]]);
        assert_eq!(
            (record.counts(false), record.counts(true)),
            (vec![4, 1], vec![1, 0])
        );
        assert_eq!(record.executions()[&0x1a2], 4);
        assert_eq!(record.usual_predecessors(), [Some(0), Some(0)]);
    }

    #[test]
    fn a_line_without_meaning_is_named() {
        for text in ["no line", "block 1a0\nrun 0 - 7 1", "block x", ""] {
            assert!(Record::parse(text).is_err(), "{text}");
        }
    }
}
