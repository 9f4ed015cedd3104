//! Cycles of blocks of instructions on LLVM's model of the Cortex-M7 (`llvm-mca`).
//!
//! The core issues in order, so a block's cost is by how much later the instruction after it issues
//! when the block is there: cycles(before + block + tail) − cycles(before + tail), where *before*
//! is what usually ran before it and the tail waits for nothing. Since two instructions may issue
//! in a cycle, this is the mean over both ways in which the pairs can fall. A block that follows
//! itself is timed as the loop that it is.

use std::collections::HashMap;
use std::fmt::Write;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::disassembly::Disassembly;
use super::lowering::{FILLER, lower};
use super::record::Record;
use crate::process;

/// What is named as the package in which both programs come, on Debian.
pub const PACKAGE: &str = "llvm";

/// How much of what came before a block is timed with it, in instructions.
const CONTEXT: usize = 24;
/// Repetitions of a loop: the difference between the two is what is timed.
const LOOPS: (usize, usize) = (8, 24);
/// Instructions of the tail: longer than any latency.
const TAIL: usize = 24;
/// Regions that one run of the analyzer takes.
const BATCH: usize = 500;

/// Loops whose cycles are known from the core's rules: two issues in a cycle, one multiplication,
/// one store, two loads, and two cycles from a load to the address that it gives.
const KNOWN: [(&[&str], f64); 7] = [
    (&["add r0, r1, r2", "add r3, r1, r2"], 1.0),
    (&["add r0, r0, r1"], 1.0),
    (&["smlad r4, r5, r0, r4", "sxtb16 r3, r2"], 1.0),
    (&["smlad r4, r5, r0, r4", "smlad r6, r5, r0, r6"], 2.0),
    (&["str r3, [r0]", "str r4, [r0, #4]"], 2.0),
    (&["ldr r3, [r0]", "ldr r4, [r0, #4]"], 1.0),
    (&["ldr r0, [r0]"], 2.0),
];

/// LLVM's analyzer, with what it has said so far.
pub struct Mca {
    disassembly: Disassembly,
    /// Where its input is written.
    file: PathBuf,
    /// Cycles by the text of the instructions.
    known: HashMap<String, u64>,
}

/// True when both of LLVM's programs are there.
pub fn is_installed() -> bool {
    ["llvm-mca", "llvm-objdump"]
        .iter()
        .all(|name| process::find_program(name).is_some())
}

/// Two pairs of texts, and by what to divide the difference of their cycles.
struct Timing {
    with: [String; 2],
    without: [String; 2],
    divisor: f64,
}

impl Mca {
    /// For an image's instructions; `file` is written to.
    ///
    /// # Errors
    /// When the analyzer cannot be run, or does not know the core's rules.
    pub fn new(disassembly: Disassembly, file: PathBuf) -> Result<Mca> {
        let mut mca = Mca {
            disassembly,
            file,
            known: HashMap::new(),
        };
        mca.check_known_loops()?;
        Ok(mca)
    }

    fn check_known_loops(&mut self) -> Result<()> {
        for (lines, expected) in KNOWN {
            let block: Vec<String> = lines.iter().map(|&line| line.to_owned()).collect();
            let timing = timing(0, &[block], &[Some(0)]);
            self.learn([timing.with.to_vec(), timing.without.to_vec()].concat())?;
            let found = self.evaluate(&timing)?;
            ensure!(
                found == expected,
                "this llvm-mca gives {found} cycles to `{}` and not {expected}: its model of the \
                 core is not the one that the figures of this project stand on (LLVM 14 to 22)",
                lines.join("; ")
            );
        }
        Ok(())
    }

    /// Modelled cycles of one execution of each block.
    ///
    /// # Errors
    /// When the analyzer cannot be run, or does not know an instruction.
    pub fn cycles(&mut self, record: &Record) -> Result<Vec<f64>> {
        let texts = record.blocks().iter().map(|block| self.text(block));
        let texts = texts.collect::<Result<Vec<_>>>()?;
        let before = record.usual_predecessors();
        let timings: Vec<Timing> = (0..texts.len())
            .map(|index| timing(index, &texts, &before))
            .collect();
        let needed = timings
            .iter()
            .flat_map(|timing| timing.with.iter().chain(&timing.without));
        self.learn(needed.cloned().collect())?;
        timings.iter().map(|timing| self.evaluate(timing)).collect()
    }

    fn text(&self, block: &[u64]) -> Result<Vec<String>> {
        let mut lines = Vec::new();
        for address in block {
            let instruction = self.disassembly.get(address);
            let instruction = instruction
                .with_context(|| format!("llvm-objdump shows no instruction at {address:#x}"))?;
            lines.extend(lower(instruction));
        }
        Ok(lines)
    }

    fn evaluate(&self, timing: &Timing) -> Result<f64> {
        let sum = |texts: &[String; 2]| -> Result<f64> {
            let cycles = texts.iter().map(|text| self.known.get(text).copied());
            let sum: Option<u64> = cycles.sum();
            Ok(sum.context("llvm-mca left a region out")? as f64 / 2.0)
        };
        Ok((sum(&timing.with)? - sum(&timing.without)?) / timing.divisor)
    }

    /// Asks the analyzer for what is not known yet.
    fn learn(&mut self, mut texts: Vec<String>) -> Result<()> {
        texts.retain(|text| !self.known.contains_key(text));
        texts.sort();
        texts.dedup();
        for batch in texts.chunks(BATCH) {
            let cycles = self.ask(batch)?;
            self.known.extend(batch.iter().cloned().zip(cycles));
        }
        Ok(())
    }

    fn ask(&self, texts: &[String]) -> Result<Vec<u64>> {
        let mut input = String::new();
        for text in texts {
            let _ = writeln!(input, "# LLVM-MCA-BEGIN\n{text}# LLVM-MCA-END");
        }
        fs::write(&self.file, input).with_context(|| format!("writing {}", self.file.display()))?;
        let mut command = Command::new("llvm-mca");
        command
            .args(["-mtriple=thumbv7em-none-eabihf", "-mcpu=cortex-m7"])
            .args([
                "-iterations=1",
                "-instruction-info=0",
                "-resource-pressure=0",
            ]);
        let output = process::output(command.arg(&self.file))?;
        let cycles: Vec<u64> = output.lines().filter_map(total_cycles).collect();
        ensure!(
            cycles.len() == texts.len(),
            "llvm-mca timed {} of {} regions of {}",
            cycles.len(),
            texts.len(),
            self.file.display()
        );
        Ok(cycles)
    }
}

/// `Total Cycles:      1003`
fn total_cycles(line: &str) -> Option<u64> {
    line.strip_prefix("Total Cycles:")?.trim().parse().ok()
}

fn timing(index: usize, texts: &[Vec<String>], before: &[Option<usize>]) -> Timing {
    let block = &texts[index];
    if before[index] == Some(index) {
        let (few, many) = LOOPS;
        return Timing {
            with: both_ways(&vec![block.clone(); many].concat()),
            without: both_ways(&vec![block.clone(); few].concat()),
            divisor: (many - few) as f64,
        };
    }
    let context = context(index, texts, before);
    Timing {
        with: both_ways(&[context.clone(), block.clone()].concat()),
        without: both_ways(&context),
        divisor: 1.0,
    }
}

/// What usually ran before a block: its last instructions.
fn context(index: usize, texts: &[Vec<String>], before: &[Option<usize>]) -> Vec<String> {
    let mut context = Vec::new();
    let mut at = index;
    while let Some(previous) = before[at].filter(|_| context.len() < CONTEXT) {
        context = [texts[previous].clone(), context].concat();
        at = previous;
    }
    context.split_off(context.len().saturating_sub(CONTEXT))
}

/// The lines and the tail, beginning with the first or the second instruction of a pair.
fn both_ways(lines: &[String]) -> [String; 2] {
    let tail = vec![FILLER.to_owned(); TAIL];
    let text = |head: &[String]| {
        let lines = [head, lines, &tail].concat();
        lines
            .iter()
            .fold(String::new(), |text, line| text + line + "\n")
    };
    [text(&[]), text(&[FILLER.to_owned()])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cycles_are_found_in_the_report() {
        assert_eq!(total_cycles("Total Cycles:      1003"), Some(1003));
        assert_eq!(total_cycles("Iterations:        1"), None);
    }

    #[test]
    fn a_block_is_timed_behind_what_usually_precedes_it() {
        let texts = [vec!["a".to_owned()], vec!["b".to_owned()]];
        let timing = timing(1, &texts, &[None, Some(0)]);
        assert!(timing.with[0].starts_with("a\nb\n") && timing.without[0].starts_with("a\nmov"));
    }

    #[test]
    fn a_block_that_follows_itself_is_timed_as_a_loop() {
        let timing = timing(0, &[vec!["a".to_owned()]], &[Some(0)]);
        assert_eq!(timing.with[0].matches("a\n").count(), 24);
        assert_eq!(timing.divisor, 16.0);
    }
}
