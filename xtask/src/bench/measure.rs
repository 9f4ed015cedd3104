//! The cases that `benchmark-cases` (in `tests`) writes, each in QEMU: what its stages cost.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde::Deserialize;

use super::cycles::Model;
use super::stages::Stages;
use crate::process::{self, command};
use crate::{artifacts, toolchain};

/// The emulator, up to how scripts are handed to the image.
const QEMU: &str = "qemu-system-arm -M mps2-an500 -display none -monitor none -serial none \
    -d plugin -semihosting-config";

/// One script, as `benchmark-cases` describes it.
#[derive(Deserialize)]
pub struct Case {
    pub work: Work,
    file: PathBuf,
    /// Columns and rows of the frame, or of the frames that the model is for.
    pub size: [u64; 2],
    /// Pixel format of that frame: `rgb565`, `yuv422` or `mono`.
    pub format: String,
}

/// What a case runs.
#[derive(Deserialize)]
pub enum Work {
    /// One frame, from its first row to the force; what is special about it, empty for the usual
    /// one.
    Frame(String),
    /// One inference of a model with these layer widths.
    Network(Vec<u64>),
    /// The network of a model that tells places, and so many steps from its answer.
    Steps(u64),
    /// The threshold's table of 64 KiB, made once for each threshold.
    Table,
}

/// Writes all scripts into a folder.
pub fn cases(folder: &Path) -> Result<Vec<Case>> {
    let mut command = std::process::Command::new(artifacts::host_program("benchmark-cases")?);
    let lines = process::output(command.current_dir(toolchain::at("")).arg(folder))?;
    let cases: Result<_, _> = lines.lines().map(serde_json::from_str).collect();
    cases.context("what benchmark-cases says")
}

/// Executed instructions, exactly, and what LLVM's model of the core makes of them in memory
/// without wait states: not a number without LLVM.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    pub instructions: u64,
    pub cycles: f64,
}

/// The costs of stages.
pub type Costs = BTreeMap<&'static str, Cost>;

/// Of some stages together, or of all when none is named.
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

/// What one case took.
pub struct Measured {
    pub case: Case,
    pub stages: Costs,
    /// What happens once the last band of rows is there.
    pub last_band: Cost,
    /// What runs more often than a network has neurons: its multiplications.
    pub inner_loop: Cost,
}

/// What the plugin (`xtask/instruction-counter`) recorded of one run.
#[derive(Deserialize)]
pub struct Record {
    /// The instructions of each block, by their addresses, in order.
    pub blocks: Vec<Vec<u64>>,
    /// Whether the last band of rows was there, the block before, the block, and how often it ran
    /// after that; the first after a call has none before.
    pub runs: Vec<(bool, Option<usize>, usize, u64)>,
}

impl Record {
    /// How often each instruction ran. It may lie in several blocks: the first round of a loop is
    /// one with what comes before it.
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

/// The image with all that is needed to measure cases on it.
pub struct Bench {
    image: PathBuf,
    plugin: PathBuf,
    folder: PathBuf,
    stages: Stages,
    /// `None` without LLVM.
    model: Option<Model>,
}

impl Bench {
    /// Measures on `image`; writes what it needs into `folder`.
    pub fn new(image: PathBuf, folder: PathBuf) -> Result<Bench> {
        Ok(Bench {
            plugin: artifacts::instruction_counter(plugin_version()?)?,
            stages: Stages::of_image(&image)?,
            model: Model::new(&image, folder.join("blocks.s"))?,
            image,
            folder,
        })
    }

    /// Runs one case.
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
            // A block that the compiler made of several stages is shared by their instructions.
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

/// The version of the plugin interface that this QEMU accepts: 1 before QEMU 9, 2 from then on.
fn plugin_version() -> Result<u32> {
    let text = process::output(&mut command("qemu-system-arm --version"))?;
    // `QEMU emulator version 7.2.22 (Debian …`
    let version = text
        .split_once("version ")
        .and_then(|(_, rest)| rest.split('.').next());
    let major: u32 = version.context("no version of QEMU")?.parse()?;
    Ok(if major < 9 { 1 } else { 2 })
}
