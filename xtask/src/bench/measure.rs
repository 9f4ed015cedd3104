//! One case in QEMU: what each of its stages costs.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Context, Result};

use super::cases::{Case, Work};
use super::cycles::Model;
use super::record::Record;
use super::stages::Stages;
use crate::{artifacts, process};

/// The emulator, up to how scripts are handed to the image.
const QEMU: &str = "qemu-system-arm -M mps2-an500 -display none -monitor none -serial none \
    -d plugin -semihosting-config";

/// Executed instructions, and what LLVM's model of the core makes of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Exact.
    pub instructions: u64,
    /// Modelled, in memory without wait states; not a number without LLVM.
    pub cycles: f64,
}

impl Cost {
    /// Of some costs together.
    pub fn sum<'c>(costs: impl Iterator<Item = &'c Cost>) -> Cost {
        costs.fold(Cost::default(), |sum, cost| Cost {
            instructions: sum.instructions + cost.instructions,
            cycles: sum.cycles + cost.cycles,
        })
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
}

impl Measured {
    /// Everything together.
    pub fn total(&self) -> Cost {
        Cost::sum(self.stages.values())
    }

    /// Some stages together.
    pub fn of(&self, stages: &[&str]) -> Cost {
        Cost::sum(stages.iter().filter_map(|stage| self.stages.get(stage)))
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
        let everything = |_: u64, _: &str| true;
        let last_band = self.costs(&record, true, &cycles, everything)?;
        let mut inner_loop = Cost::default();
        if let Work::Network(widths) = &case.work {
            // What runs more often than there are neurons multiplies. An instruction may lie in
            // several blocks: the first round of a loop is one with what comes before it.
            let (executions, neurons) = (record.executions(), widths[1..].iter().sum());
            let multiplies =
                |address: u64, stage: &str| stage == "network" && executions[&address] > neurons;
            inner_loop = Cost::sum(self.costs(&record, false, &cycles, multiplies)?.values());
        }
        Ok(Measured {
            stages: self.costs(&record, false, &cycles, everything)?,
            last_band: Cost::sum(last_band.values()),
            inner_loop,
            case,
        })
    }

    fn record(&self, case: &Case) -> Result<Record> {
        let (log, results) = (self.folder.join("record"), self.folder.join("results"));
        let (script, results) = (case.file.display(), results.display());
        let arguments = format!("arg=hivtac-qemu-image,arg={script},arg={results}");
        let mut command = process::command(QEMU);
        command.arg(format!("enable=on,target=native,{arguments}"));
        command.arg("-kernel").arg(&self.image);
        command.arg("-plugin").arg(&self.plugin).arg("-D").arg(&log);
        process::output(&mut command)?;
        Record::parse(&process::read(&log)?)
    }

    /// What each stage costs, in all or in the last band, of the instructions that count.
    fn costs(
        &mut self,
        record: &Record,
        only_last_band: bool,
        cycles: &[f64],
        counts: impl Fn(u64, &str) -> bool,
    ) -> Result<BTreeMap<&'static str, Cost>> {
        let mut stages = BTreeMap::<_, Cost>::new();
        let blocks = record
            .blocks
            .iter()
            .zip(record.counts(only_last_band))
            .zip(cycles);
        for ((block, count), cycles) in blocks.filter(|((_, count), _)| *count > 0) {
            // A block that the compiler made of several stages is shared by their instructions.
            let cycles = cycles * count as f64 / block.len() as f64;
            for address in block {
                let stage = self.stages.stage(*address)?;
                if let Some(stage) = stage.filter(|stage| counts(*address, stage)) {
                    let sum = stages.entry(stage).or_default();
                    *sum = Cost::sum(
                        [
                            *sum,
                            Cost {
                                instructions: count,
                                cycles,
                            },
                        ]
                        .iter(),
                    );
                }
            }
        }
        Ok(stages)
    }
}

/// The version of the plugin interface that this QEMU accepts: 1 before QEMU 9, 2 from then on.
fn plugin_version() -> Result<u32> {
    let text = process::output(&mut process::command("qemu-system-arm --version"))?;
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
}
