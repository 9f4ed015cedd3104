//! The gate: instruction counts against those that are committed, exact under the compiler that
//! they name.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};

use super::items::Item;
use crate::numbers::decimal;
use crate::workspace;

/// The command that makes the baseline what is measured now.
pub const REFRESH: &str = "cargo xtask bench --write-baseline";

/// Counts that were measured, and by which compiler's image.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// As `rustc -V` says it.
    pub compiler: String,
    /// Instructions by the item's label.
    pub instructions: BTreeMap<String, f64>,
}

/// One count that is not what it was.
#[derive(Debug, PartialEq)]
struct Change {
    label: String,
    before: Option<f64>,
    now: Option<f64>,
}

impl Baseline {
    /// What was measured now.
    pub fn of(compiler: String, items: &[Item]) -> Baseline {
        let counts = items.iter().map(|item| (item.label(), item.instructions));
        Baseline {
            compiler,
            instructions: counts.collect(),
        }
    }

    /// The committed one.
    ///
    /// # Errors
    /// When it is missing or cannot be read.
    pub fn committed() -> Result<Baseline> {
        let file = file();
        let text = fs::read_to_string(&file)
            .with_context(|| format!("reading {}; `{REFRESH}` makes it", file.display()))?;
        serde_json::from_str(&text).with_context(|| format!("reading {}", file.display()))
    }

    /// Makes this the committed one.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self) -> Result<()> {
        let file = file();
        let text = serde_json::to_string_pretty(self)? + "\n";
        fs::write(&file, text).with_context(|| format!("writing {}", file.display()))?;
        eprintln!("wrote {}", file.display());
        Ok(())
    }

    /// Compares what was measured now with this, the committed one, and prints every difference.
    ///
    /// # Errors
    /// When a count differs under the same compiler, or an item is new or gone.
    pub fn check(&self, now: &Baseline) -> Result<()> {
        let changes = self.changes(now);
        for change in &changes {
            eprintln!("{}", change.line());
        }
        if self.compiler != now.compiler {
            eprintln!(
                "instruction counts are not gated: the baseline is for {}, this is {}",
                self.compiler, now.compiler
            );
        } else if changes.is_empty() {
            eprintln!(
                "all {} instruction counts are the baseline's",
                now.instructions.len()
            );
        } else {
            bail!(
                "{} instruction counts differ from the baseline's; when they are meant to, \
                 `{REFRESH}` and commit it",
                changes.len()
            );
        }
        Ok(())
    }

    fn changes(&self, now: &Baseline) -> Vec<Change> {
        let labels = self.instructions.keys().chain(now.instructions.keys());
        let labels: std::collections::BTreeSet<&String> = labels.collect();
        let changes = labels.into_iter().map(|label| Change {
            label: label.clone(),
            before: self.instructions.get(label).copied(),
            now: now.instructions.get(label).copied(),
        });
        changes
            .filter(|change| change.before != change.now)
            .collect()
    }
}

impl Change {
    fn line(&self) -> String {
        let number = |count: Option<f64>| count.map_or("none".to_owned(), decimal);
        let percent = match (self.before, self.now) {
            (Some(before), Some(now)) => format!(" ({:+.2} %)", 100.0 * (now - before) / before),
            _ => String::new(),
        };
        let (before, now) = (number(self.before), number(self.now));
        format!("{}: {before} → {now} instructions{percent}", self.label)
    }
}

fn file() -> PathBuf {
    workspace::folder("xtask/baseline.json")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn baseline(compiler: &str, counts: &[(&str, f64)]) -> Baseline {
        let counts = counts
            .iter()
            .map(|(label, count)| ((*label).to_owned(), *count));
        Baseline {
            compiler: compiler.to_owned(),
            instructions: counts.collect(),
        }
    }

    #[test]
    fn one_instruction_more_or_less_is_refused() {
        let committed = baseline("rustc 1", &[("blobs", 100.0)]);
        assert!(committed.check(&committed).is_ok());
        for count in [99.0, 101.0] {
            let now = baseline("rustc 1", &[("blobs", count)]);
            assert!(committed.check(&now).is_err());
        }
    }

    #[test]
    fn an_item_that_is_new_or_gone_is_refused() {
        let (one, two) = (
            baseline("rustc 1", &[("blobs", 100.0)]),
            baseline("rustc 1", &[("blobs", 100.0), ("mac", 1.0)]),
        );
        assert!(one.check(&two).is_err() && two.check(&one).is_err());
    }

    #[test]
    fn another_compiler_is_not_gated() {
        let committed = baseline("rustc 1", &[("blobs", 100.0)]);
        assert!(
            committed
                .check(&baseline("rustc 2", &[("blobs", 99.0)]))
                .is_ok()
        );
    }
}
