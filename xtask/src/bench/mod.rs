//! `cargo xtask bench`: measures the cost of a frame and of an inference on the microcontroller.
//! Instructions are counted in QEMU, exactly and repeatably; LLVM's model of the core gives the
//! cycles.

pub mod board;
mod cycles;
mod lowering;
mod measure;
mod stages;
mod tables;

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::{artifacts, packages, process, size, toolchain};
use tables::Item;

const BASELINE: &str = "xtask/baseline.json";
const DOCUMENT: &str = "docs/results/performance.md";

/// Options of `cargo xtask bench`.
#[derive(Args, Default)]
pub struct Bench {
    /// Print one JSON object instead of tables.
    #[arg(long)]
    json: bool,
    /// Make what is measured now the baseline that later counts are held to.
    #[arg(long)]
    write_baseline: bool,
    /// Put the tables into docs/results/performance.md.
    #[arg(long)]
    write_docs: bool,
    /// Measure on an STM32H743 that is attached by a debug probe instead.
    #[arg(long, conflicts_with_all = ["json", "write_baseline", "write_docs"])]
    board: bool,
}

impl Bench {
    /// Measures and prints every case, and compares the counts with the baseline.
    pub fn run(&self) -> Result<()> {
        if self.board {
            return board::run();
        }
        packages::ensure_qemu()?;
        let folder = toolchain::work_folder("bench")?;
        let cases = measure::cases(&folder)?.into_iter();
        let mut bench = measure::Bench::new(artifacts::qemu_image()?, folder)?;
        let measured: Result<Vec<_>> = cases.map(|case| bench.measure(case)).collect();
        let measured = measured?;
        let items: Vec<Item> = measured.iter().flat_map(tables::items).collect();
        let tables = tables::all(&items, &measured);
        match self.json {
            true => println!("{}", serde_json::json!({ "items": items })),
            false => process::print(&tables),
        }
        let (document, baseline) = (toolchain::at(DOCUMENT), toolchain::at(BASELINE));
        if self.write_docs {
            let text = replaced(&process::read(&document)?, "bench", &tables)?;
            let text = replaced(&text, "memory", &size::memories()?)?;
            process::write(&document, &text)?;
        }
        let now = Baseline::of(&items)?;
        if self.write_baseline {
            let text = serde_json::to_string_pretty(&now)? + "\n";
            return process::write(&baseline, &text);
        }
        let committed: Baseline = serde_json::from_str(&process::read(&baseline)?)?;
        committed.check(&now)
    }
}

/// Measured counts, with the compiler that built the image.
#[derive(Debug, Serialize, Deserialize)]
struct Baseline {
    /// The output of `rustc -V`.
    compiler: String,
    /// Instructions, by the item's label.
    instructions: BTreeMap<String, f64>,
}

impl Baseline {
    fn of(items: &[Item]) -> Result<Baseline> {
        let mut instructions = BTreeMap::new();
        for item in items {
            let label = format!("{}, {} {}", item.item, item.frame, item.format);
            instructions.insert(label, item.instructions);
        }
        Ok(Baseline {
            compiler: toolchain::target_compiler()?,
            instructions,
        })
    }

    /// Compares new counts with this committed baseline, and prints every difference.
    fn check(&self, now: &Baseline) -> Result<()> {
        let labels = self.instructions.keys().chain(now.instructions.keys());
        let mut changes = 0;
        for label in labels.collect::<BTreeSet<_>>() {
            let counts = [self, now].map(|it| it.instructions.get(label));
            if counts[0] != counts[1] {
                changes += 1;
                process::say(&format!(
                    "{label}: {:?} → {:?} instructions",
                    counts[0], counts[1]
                ));
            }
        }
        if self.compiler != now.compiler {
            process::say(&format!(
                "instruction counts are not gated: the baseline is for {}, this is {}",
                self.compiler, now.compiler
            ));
            return Ok(());
        }
        ensure!(
            changes == 0,
            "{changes} instruction counts differ from the baseline's; when they are meant to, \
             `cargo xtask bench --write-baseline` and commit it"
        );
        let all = now.instructions.len();
        process::say(&format!("all {all} instruction counts are the baseline's"));
        Ok(())
    }
}

/// Replaces the text between `<!-- NAME: begin … -->` and `<!-- NAME: end -->` in a document.
fn replaced(document: &str, name: &str, text: &str) -> Result<String> {
    let parts = || {
        let begin = document.find(&format!("<!-- {name}: begin"))?;
        let start = begin + document[begin..].find("-->")? + "-->".len();
        let end = start + document[start..].find(&format!("<!-- {name}: end -->"))?;
        Some((&document[..start], &document[end..]))
    };
    let (head, tail) = parts().with_context(|| format!("{DOCUMENT} has no place for `{name}`"))?;
    Ok(format!("{head}\n\n{}\n\n{tail}", text.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_instruction_or_item_more_or_less_is_refused_of_the_same_compiler() {
        let baseline = |compiler: &str, counts: &[(&str, f64)]| Baseline {
            compiler: compiler.to_owned(),
            instructions: counts
                .iter()
                .map(|(label, count)| ((*label).into(), *count))
                .collect(),
        };
        let committed = baseline("rustc 1", &[("blobs", 100.0)]);
        assert!(committed.check(&committed).is_ok());
        let two = [("blobs", 100.0), ("mac", 1.0)];
        for counts in [&[("blobs", 99.0)][..], &[("blobs", 101.0)], &two, &[]] {
            assert!(committed.check(&baseline("rustc 1", counts)).is_err());
            assert!(committed.check(&baseline("rustc 2", counts)).is_ok());
        }
    }

    #[test]
    fn only_what_lies_between_the_marks_changes() {
        let document = "one\n<!-- a: begin, by x -->\nold\n<!-- a: end -->\ntwo\n";
        let expected = document.replace("\nold\n", "\n\nnew\n\n");
        assert_eq!(replaced(document, "a", "new\n").unwrap(), expected);
        assert_eq!(replaced(&expected, "a", "new").unwrap(), expected);
        assert!(replaced(document, "c", "new").is_err());
    }
}
