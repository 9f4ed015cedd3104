//! Measures the costs of stages in QEMU, for each case that `benchmark-cases` (in `tests`) writes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Deserialize;

use super::cycles::Model;
use super::stages::Stages;
use crate::process::{self, command};
use crate::{artifacts, toolchain};

/// The emulator's command line, up to the script for the image.
const QEMU: &str = "qemu-system-arm -M mps2-an500 -display none -monitor none -serial none \
    -d plugin -semihosting-config";

/// One script, as described by `benchmark-cases`.
#[derive(Deserialize)]
pub struct Case {
    pub work: Work,
    file: PathBuf,
    /// Columns and rows of the frame, or of the frames for which the model was made.
    pub size: [u64; 2],
    /// Pixel format of that frame: `rgb565`, `yuv422` or `mono`.
    pub format: String,
}

/// The work of a case.
#[derive(Deserialize)]
pub enum Work {
    /// One frame, from its first row to the force, with a name for what is special about it; the
    /// name is empty for the usual frame.
    Frame(String),
    /// One inference of a model with these layer widths.
    Network(Vec<u64>),
    /// The network of a model that gives places, and this number of steps from its answer.
    Steps(u64),
    /// The threshold's table of 64 KiB, which is made once for each threshold.
    Table,
}

/// Writes all scripts into a folder; returns their cases.
pub fn cases(folder: &Path) -> Result<Vec<Case>> {
    let mut command = std::process::Command::new(artifacts::host_program("benchmark-cases")?);
    let lines = process::output(command.current_dir(toolchain::at("")).arg(folder))?;
    let cases: Result<_, _> = lines.lines().map(serde_json::from_str).collect();
    cases.context("what benchmark-cases says")
}

/// The exact number of executed instructions, and their cycles by LLVM's model of the core in
/// memory without wait states. The cycles are NaN without LLVM.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    pub instructions: u64,
    pub cycles: f64,
}

/// The costs of stages.
pub type Costs = BTreeMap<&'static str, Cost>;

/// The sum of some stages, or of all stages for an empty list.
pub fn sum(costs: &Costs, stages: &[&str]) -> Cost {
    let mut sum = Cost::default();
    for (stage, cost) in costs {
        if stages.is_empty() || stages.contains(stage) {
            sum.add(*cost);
        }
    }
    sum
}

impl Cost {
    fn add(&mut self, other: Cost) {
        self.instructions += other.instructions;
        self.cycles += other.cycles;
    }
}

/// The results of one case.
pub struct Measured {
    pub case: Case,
    pub stages: Costs,
    /// The cost after the last band of rows has arrived.
    pub last_band: Cost,
    /// The cost of the code that runs more often than a network has neurons: its multiplications.
    pub inner_loop: Cost,
}

/// The plugin's record (`xtask/instruction-counter`) of one run.
#[derive(Deserialize)]
pub struct Record {
    /// The addresses of each block's instructions, in order.
    pub blocks: Vec<Vec<u64>>,
    /// Whether the last band of rows had arrived, the block before, the block, and the number of
    /// its executions. The first block after a call has no block before.
    pub runs: Vec<(bool, Option<usize>, usize, u64)>,
}

impl Record {
    /// Number of executions of each instruction. It may be in several blocks: the first round of a
    /// loop forms one with the code before it.
    fn executions(&self) -> BTreeMap<u64, u64> {
        let mut executions = BTreeMap::new();
        for (_, _, block, count) in &self.runs {
            for address in &self.blocks[*block] {
                *executions.entry(*address).or_default() += count;
            }
        }
        executions
    }
}

/// The image and the programs for measurements on it.
pub struct Bench {
    image: PathBuf,
    plugin: PathBuf,
    folder: PathBuf,
    stages: Stages,
    /// `None` without LLVM.
    model: Option<Model>,
}

impl Bench {
    /// Measures on `image`; writes its files into `folder`.
    pub fn new(image: PathBuf, folder: PathBuf) -> Result<Bench> {
        Ok(Bench {
            plugin: artifacts::instruction_counter(plugin_version()?)?,
            stages: Stages::of_image(&image)?,
            model: Model::new(&image, folder.join("blocks.s"))?,
            image,
            folder,
        })
    }

    /// Measures one case.
    pub fn measure(&mut self, case: Case) -> Result<Measured> {
        let record = self.record(&case)?;
        let cycles = match &mut self.model {
            Some(model) => model.cycles(&record)?,
            None => vec![f64::NAN; record.blocks.len()],
        };
        let mut measured = Measured {
            case,
            stages: Costs::default(),
            last_band: Cost::default(),
            inner_loop: Cost::default(),
        };
        let neurons = match &measured.case.work {
            Work::Network(widths) => widths[1..].iter().sum(),
            _ => u64::MAX,
        };
        let executions = record.executions();
        for &(is_last_band, _, block, instructions) in &record.runs {
            let addresses = &record.blocks[block];
            // If the compiler merged several stages into a block, its cost is divided by their
            // instructions.
            let cycles = cycles[block] * instructions as f64 / addresses.len() as f64;
            for address in addresses {
                let Some(stage) = self.stages.stage(*address)? else {
                    continue;
                };
                let cost = Cost {
                    instructions,
                    cycles,
                };
                measured.stages.entry(stage).or_default().add(cost);
                if is_last_band {
                    measured.last_band.add(cost);
                }
                if stage == "network" && executions[address] > neurons {
                    measured.inner_loop.add(cost);
                }
            }
        }
        Ok(measured)
    }

    fn record(&self, case: &Case) -> Result<Record> {
        let (log, results) = (self.folder.join("record"), self.folder.join("results"));
        let (script, results) = (case.file.display(), results.display());
        let arguments = format!("arg=hivtac-qemu-image,arg={script},arg={results}");
        let mut qemu = command(QEMU);
        qemu.arg(format!("enable=on,target=native,{arguments}"));
        qemu.arg("-kernel").arg(&self.image);
        qemu.arg("-plugin").arg(&self.plugin).arg("-D").arg(&log);
        process::output(&mut qemu)?;
        let record = serde_json::from_str(&process::read(&log)?);
        record.with_context(|| format!("what the plugin wrote: {}", log.display()))
    }
}

/// The plugin interface's version that this QEMU accepts: 1 before QEMU 9, 2 from then on.
fn plugin_version() -> Result<u32> {
    let text = process::output(&mut command("qemu-system-arm --version"))?;
    // `QEMU emulator version 7.2.22 (Debian …`
    let version = text
        .split_once("version ")
        .and_then(|(_, rest)| rest.split('.').next());
    let major: u32 = version.context("no version of QEMU")?.parse()?;
    Ok(if major < 9 { 1 } else { 2 })
}
