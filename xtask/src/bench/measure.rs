//! One case in QEMU: what each of its stages costs.

use std::collections::BTreeMap;
use std::fs;
use std::iter::Sum;
use std::ops::{Add, AddAssign};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use super::cases::{Case, Work, neurons};
use super::disassembly;
use super::mca::{self, Mca};
use super::memory::Loads;
use super::record::{Part, Record};
use super::stages::Stages;
use crate::process;

/// Executed instructions, and what LLVM's model of the core makes of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Exact.
    pub instructions: u64,
    /// Modelled, in memory without wait states; `None` without LLVM.
    pub cycles: Option<f64>,
}

impl Add for Cost {
    type Output = Cost;

    fn add(self, other: Cost) -> Cost {
        let cycles = match (self.cycles, other.cycles) {
            (Some(a), Some(b)) => Some(a + b),
            (one, other) => one.or(other),
        };
        Cost {
            instructions: self.instructions + other.instructions,
            cycles,
        }
    }
}

impl AddAssign for Cost {
    fn add_assign(&mut self, other: Cost) {
        *self = *self + other;
    }
}

impl Sum for Cost {
    fn sum<I: Iterator<Item = Cost>>(costs: I) -> Cost {
        costs.fold(Cost::default(), Add::add)
    }
}

/// What one case took.
pub struct Measured {
    /// The case.
    pub case: Case,
    /// Cost of each stage.
    pub stages: BTreeMap<&'static str, Cost>,
    /// What happens once the last band of rows is there.
    pub last_band: Cost,
    /// The loops of the network that multiply.
    pub inner_loop: Cost,
    /// How often a predictor that always guesses a block's usual successor is wrong.
    pub mispredictions: u64,
    /// Where data was loaded from.
    pub loads: Loads,
}

impl Measured {
    /// Everything together.
    pub fn total(&self) -> Cost {
        self.stages.values().copied().sum()
    }

    /// Some stages together.
    pub fn of(&self, stages: &[&str]) -> Cost {
        let costs = stages.iter().filter_map(|stage| self.stages.get(stage));
        costs.copied().sum()
    }
}

/// The image with all that is needed to measure cases on it.
pub struct Bench {
    image: PathBuf,
    plugin: PathBuf,
    folder: PathBuf,
    stages: Stages,
    /// `None` without LLVM.
    mca: Option<Mca>,
}

impl Bench {
    /// Measures on `image` with QEMU's `plugin`; writes what it needs into `folder`.
    ///
    /// # Errors
    /// When the image cannot be read, or LLVM does not know the core.
    pub fn new(image: PathBuf, plugin: PathBuf, folder: PathBuf) -> Result<Bench> {
        let mca = if mca::is_installed() {
            let disassembly = disassembly::disassemble(&image)?;
            Some(Mca::new(disassembly, folder.join("blocks.s"))?)
        } else {
            None
        };
        Ok(Bench {
            stages: Stages::of_image(&image)?,
            image,
            plugin,
            folder,
            mca,
        })
    }

    /// Runs all cases.
    ///
    /// # Errors
    /// When QEMU or LLVM fail.
    pub fn measure_all(&mut self, cases: Vec<Case>) -> Result<Vec<Measured>> {
        cases.into_iter().map(|case| self.measure(case)).collect()
    }

    /// Runs one case.
    ///
    /// # Errors
    /// When QEMU or LLVM fail.
    fn measure(&mut self, case: Case) -> Result<Measured> {
        let record = self.record(&case.file)?;
        let cycles = match &mut self.mca {
            Some(mca) => mca.cycles(&record)?.into_iter().map(Some).collect(),
            None => vec![None; record.blocks().len()],
        };
        let parts = self.stages(&record, Part::Whole, &cycles)?;
        let last_band = self.stages(&record, Part::LastBand, &cycles)?;
        Ok(Measured {
            inner_loop: self.inner_loop(&case, &record, &cycles)?,
            case,
            stages: parts,
            last_band: last_band.into_values().sum(),
            mispredictions: record.unusual_exits(),
            loads: Loads::of(&record),
        })
    }

    fn record(&self, script: &Path) -> Result<Record> {
        let (log, results) = (self.folder.join("record"), self.folder.join("results"));
        process::run_quietly(&mut qemu(&self.image, &self.plugin, script, &results, &log))?;
        let text =
            fs::read_to_string(&log).with_context(|| format!("reading {}", log.display()))?;
        Record::parse(&text)
    }

    /// What each stage costs in one part.
    fn stages(
        &mut self,
        record: &Record,
        part: Part,
        cycles: &[Option<f64>],
    ) -> Result<BTreeMap<&'static str, Cost>> {
        let mut stages = BTreeMap::<_, Cost>::new();
        let blocks = record.blocks().iter().zip(record.counts(part)).zip(cycles);
        for ((block, count), cycles) in blocks.filter(|((_, count), _)| *count > 0) {
            // A block that the compiler made of several stages is shared by their instructions.
            let share = |cycles: f64| cycles * count as f64 / block.len() as f64;
            for address in block {
                if let Some(stage) = self.stages.stage(*address)? {
                    *stages.entry(stage).or_default() += Cost {
                        instructions: count,
                        cycles: cycles.map(share),
                    };
                }
            }
        }
        Ok(stages)
    }

    /// The instructions of the network that run more often than there are neurons: those that
    /// multiply.
    fn inner_loop(&mut self, case: &Case, record: &Record, cycles: &[Option<f64>]) -> Result<Cost> {
        let Work::Network(widths) = &case.work else {
            return Ok(Cost::default());
        };
        let mut sum = Cost::default();
        let executions = record.executions();
        let blocks = record.blocks().iter().zip(record.counts(Part::Whole));
        for ((block, count), cycles) in blocks.zip(cycles) {
            // An instruction may lie in several blocks: the first round of a loop is one with what
            // comes before it.
            let share = |cycles: f64| cycles * count as f64 / block.len() as f64;
            for address in block {
                let often = executions[address] > neurons(widths);
                if often && self.stages.stage(*address)? == Some("network") {
                    sum += Cost {
                        instructions: count,
                        cycles: cycles.map(share),
                    };
                }
            }
        }
        Ok(sum)
    }
}

fn qemu(image: &Path, plugin: &Path, script: &Path, results: &Path, log: &Path) -> Command {
    let (script, results) = (script.display(), results.display());
    let mut command = Command::new("qemu-system-arm");
    command
        .args(["-M", "mps2-an500", "-display", "none", "-monitor", "none"])
        .args(["-serial", "none", "-semihosting-config"])
        .arg(format!(
            "enable=on,target=native,arg=hivtac-qemu-image,arg={script},arg={results}"
        ))
        .arg("-plugin")
        .arg(plugin)
        .args(["-d", "plugin", "-D"])
        .arg(log)
        .arg("-kernel")
        .arg(image);
    command
}

/// The version of the plugin interface that this QEMU accepts: 1 before QEMU 9, 2 from then on.
///
/// # Errors
/// When QEMU does not say its version.
pub fn plugin_version() -> Result<u32> {
    let text = process::output(Command::new("qemu-system-arm").arg("--version"))?;
    let major = major_version(&text).with_context(|| format!("no version in `{text}`"))?;
    Ok(if major < 9 { 1 } else { 2 })
}

fn major_version(text: &str) -> Option<u32> {
    let (_, version) = text.split_once("version ")?;
    version.split('.').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_of_qemu_is_found() {
        let debian = "QEMU emulator version 7.2.22 (Debian 1:7.2+dfsg-7+deb12u18+b3)\nCopyright";
        assert_eq!(major_version(debian), Some(7));
        assert_eq!(major_version("QEMU emulator version 10.0.2"), Some(10));
        assert_eq!(major_version("something else"), None);
    }

    #[test]
    fn costs_add_up() {
        let cost = |instructions, cycles| Cost {
            instructions,
            cycles,
        };
        let sum: Cost = [cost(3, Some(1.5)), cost(4, Some(2.0))].into_iter().sum();
        assert_eq!(sum, cost(7, Some(3.5)));
        assert_eq!([cost(3, None)].into_iter().sum::<Cost>().cycles, None);
    }
}
