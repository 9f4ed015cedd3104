//! Computes the cycles of blocks of instructions with LLVM's model of the Cortex-M7 (`llvm-mca`).
//!
//! The core issues in order. A block's cost is therefore the delay that it causes to the
//! instruction after it: cycles(before + block + tail) − cycles(before + tail). *Before* is the
//! code that usually ran before it, and the tail waits for nothing. Two instructions may issue in a
//! cycle, and the result is the mean over both possible pairings. A block that follows itself is
//! timed as a loop.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use super::lowering::{FILLER, disassemble};
use super::measure::Record;
use crate::process;

const MCA: &str = "llvm-mca -mtriple=thumbv7em-none-eabihf -mcpu=cortex-m7 -iterations=1 \
    -instruction-info=0 -resource-pressure=0";

/// Instructions before a block that are timed with it.
const CONTEXT: usize = 24;
/// Two numbers of repetitions of a loop; the difference of their times is the result.
const LOOPS: (usize, usize) = (8, 24);
/// Instructions of the tail, more than any latency.
const TAIL: usize = 24;
/// Most regions in one run of the analyzer.
const BATCH: usize = 500;

/// LLVM's analyzer, with its results until now.
pub struct Model {
    /// The analyzer's text for each instruction of the image, by address.
    lines: BTreeMap<u64, Vec<String>>,
    /// The file with the analyzer's input.
    file: PathBuf,
    /// Known cycles, by the text of the instructions.
    known: HashMap<String, f64>,
}

/// Texts whose mean cycles differ by `times` times the wanted number.
struct Timing {
    with: [String; 2],
    without: [String; 2],
    times: f64,
}

impl Model {
    /// The model of an image; `file` is overwritten. `None` without LLVM.
    pub fn new(image: &Path, file: PathBuf) -> Result<Option<Model>> {
        let programs = ["llvm-mca", "llvm-objdump"].map(process::find_program);
        if programs.iter().any(Option::is_none) {
            process::say("no modelled cycles: llvm-mca or llvm-objdump (package llvm) is missing");
            return Ok(None);
        }
        let (lines, known) = (disassemble(image)?, HashMap::new());
        Ok(Some(Model { lines, file, known }))
    }

    /// Modelled cycles of one execution of each block.
    pub fn cycles(&mut self, record: &Record) -> Result<Vec<f64>> {
        let mut texts = Vec::new();
        for block in &record.blocks {
            let lines = block.iter().map(|address| self.lines.get(address));
            let lines: Option<Vec<_>> = lines.map(|it| it.map(Vec::as_slice)).collect();
            let lines = lines.with_context(|| format!("llvm-objdump left out some of {block:x?}"));
            texts.push(lines?.concat());
        }
        let before = usual_predecessors(record);
        let timings = (0..texts.len()).map(|index| timing(index, &texts, &before));
        self.evaluate(&timings.collect::<Vec<_>>())
    }

    /// Runs the analyzer for all texts with unknown cycles; returns the cycles of the timings.
    fn evaluate(&mut self, timings: &[Timing]) -> Result<Vec<f64>> {
        let texts = timings.iter().flat_map(|it| [&it.with, &it.without]);
        let unknown = texts.flatten().filter(|it| !self.known.contains_key(*it));
        let unknown: BTreeSet<String> = unknown.cloned().collect();
        for batch in Vec::from_iter(unknown).chunks(BATCH) {
            let cycles = self.ask(batch)?;
            self.known.extend(batch.iter().cloned().zip(cycles));
        }
        let sum = |texts: &[String; 2]| self.known[&texts[0]] + self.known[&texts[1]];
        let each = |it: &Timing| (sum(&it.with) - sum(&it.without)) / 2.0 / it.times;
        Ok(timings.iter().map(each).collect())
    }

    fn ask(&self, texts: &[String]) -> Result<Vec<f64>> {
        let region = |text: &String| format!("# LLVM-MCA-BEGIN\n{text}# LLVM-MCA-END\n");
        process::write(&self.file, &texts.iter().map(region).collect::<String>())?;
        let output = process::output(process::command(MCA).arg(&self.file))?;
        let cycles = |line: &str| Some(line.strip_prefix("Total Cycles:")?.trim().parse());
        let cycles: Result<Vec<f64>, _> = output.lines().filter_map(cycles).collect();
        let cycles = cycles.context("what llvm-mca says")?;
        let all = cycles.len() == texts.len();
        ensure!(all, "llvm-mca left out regions of {}", self.file.display());
        Ok(cycles)
    }
}

/// For each block, the block that ran most often right before it.
fn usual_predecessors(record: &Record) -> Vec<Option<usize>> {
    let mut steps = BTreeMap::<_, u64>::new();
    for (_, before, block, count) in &record.runs {
        if let Some(before) = before {
            *steps.entry((*before, *block)).or_default() += count;
        }
    }
    let mut best = vec![(0, None); record.blocks.len()];
    for ((from, to), count) in steps {
        if count > best[to].0 {
            best[to] = (count, Some(from));
        }
    }
    best.into_iter().map(|(_, from)| from).collect()
}

fn timing(index: usize, texts: &[Vec<String>], before: &[Option<usize>]) -> Timing {
    let block = &texts[index];
    if before[index] == Some(index) {
        let (few, many) = LOOPS;
        let repeated = |times| both_ways(&vec![block.clone(); times].concat());
        return Timing {
            with: repeated(many),
            without: repeated(few),
            times: (many - few) as f64,
        };
    }
    let context = context(index, texts, before);
    Timing {
        with: both_ways(&[context.as_slice(), block].concat()),
        without: both_ways(&context),
        times: 1.0,
    }
}

/// The last instructions that usually ran before a block.
fn context(index: usize, texts: &[Vec<String>], before: &[Option<usize>]) -> Vec<String> {
    let mut context = Vec::new();
    let mut at = index;
    while let Some(previous) = before[at].filter(|_| context.len() < CONTEXT) {
        context = [texts[previous].clone(), context].concat();
        at = previous;
    }
    context.split_off(context.len().saturating_sub(CONTEXT))
}

/// The lines and the tail, starting with the first or the second instruction of a pair.
fn both_ways(lines: &[String]) -> [String; 2] {
    let text = lines.join("\n") + if lines.is_empty() { "" } else { "\n" };
    let tail = format!("{FILLER}\n").repeat(TAIL);
    [format!("{text}{tail}"), format!("{FILLER}\n{text}{tail}")]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Block 0 runs three times, then block 1.
    #[test]
    fn a_block_is_timed_behind_what_usually_precedes_it_and_a_loop_as_such() {
        let blocks = vec![Vec::new(); 2];
        let runs = vec![
            (false, None, 0, 1),
            (false, Some(0), 0, 2),
            (true, Some(0), 1, 1),
        ];
        let before = usual_predecessors(&Record { blocks, runs });
        let texts = [vec!["a".to_owned()], vec!["b".to_owned()]];
        let behind = timing(1, &texts, &before);
        assert!(behind.with[0].contains("a\nb\nmov") && behind.without[0].contains("a\nmov"));
        let looping = timing(0, &texts, &before);
        let count = looping.with[0].matches("a\n").count();
        assert_eq!((count, looping.times), (24, 16.0));
    }
}
