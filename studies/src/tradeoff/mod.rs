//! `hivtac-studies tradeoff`: speed against accuracy, and the best under a user's limits
//! (`docs/tradeoff.md`).
//!
//! ```text
//! plan → frames → sweep (train, judge) → results ┐
//!        cargo xtask bench --tradeoff → costs ───┴→ table → front, pick → report, model
//! ```

mod costs;
mod frames;
mod model;
mod pick;
mod plan;
mod report;
mod results;
mod sweep;
mod table;
#[cfg(test)]
mod tests;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Args;

use crate::document;
pub use costs::Costs;
pub use pick::{Limits, best};
pub use plan::Plan;
pub use results::Results;
pub use sweep::{Step, sweep};
pub use table::{Configuration, configurations};

/// How much to sweep, under which limits to pick, and where everything lies.
#[derive(Args)]
pub struct TradeoffArgs {
    /// Pick the best that takes at most so many µs a frame, at 480 MHz, modelled.
    #[arg(long)]
    budget_us: Option<f64>,
    /// Pick the best that the core can do at least so often a second, modelled.
    #[arg(long)]
    min_rate: Option<f64>,
    /// Pick the fastest whose mean direction error from 50 mN up is at most this, simulated; the
    /// upper end of its interval counts.
    #[arg(long)]
    max_error_deg: Option<f64>,
    /// Train the pick on as many frames as the default model, and write its model and settings into
    /// this folder. Without any limit the pick is the default.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Frames of each size; of another number than the results' file has, name another file.
    #[arg(long)]
    rows: Option<usize>,
    /// Seeds, at most five.
    #[arg(long)]
    seeds: Option<usize>,
    /// Passes over the data in floats.
    #[arg(long)]
    epochs: Option<usize>,
    /// Passes after that with the chip's rounding, for each arithmetic.
    #[arg(long)]
    rounded_epochs: Option<usize>,
    /// What is finished; what is missing is added. Remove it to begin anew.
    #[arg(long, default_value = "studies/tradeoff/results.jsonl")]
    results: PathBuf,
    /// What `cargo xtask bench --tradeoff` counted.
    #[arg(long, default_value = "studies/tradeoff/costs.json")]
    costs: PathBuf,
    /// Where rendered frames are kept.
    #[arg(long, default_value = "target/tradeoff")]
    work: PathBuf,
    /// The folder of the documents: tradeoff.md, pictures/tradeoff.svg.
    #[arg(long, default_value = "docs")]
    docs: PathBuf,
}

impl TradeoffArgs {
    fn plan(&self) -> Option<Plan> {
        let usual = Plan::default();
        let asked = [self.rows, self.seeds, self.epochs, self.rounded_epochs];
        if asked == [None; 4] {
            return None;
        }
        Some(Plan {
            rows: self.rows.unwrap_or(usual.rows),
            seeds: self.seeds.unwrap_or(usual.seeds),
            epochs: [
                self.epochs.unwrap_or(usual.epochs[0]),
                self.rounded_epochs.unwrap_or(usual.epochs[1]),
            ],
            ..usual
        })
    }

    fn limits(&self) -> Limits {
        Limits {
            budget_us: self.budget_us,
            min_rate: self.min_rate,
            max_error_deg: self.max_error_deg,
        }
    }

    /// What is still to do: frames to render at most, and trainings.
    fn left(results: &Results) -> [usize; 2] {
        let sizes = results
            .plan
            .sizes
            .iter()
            .map(|&size| results.missing(size).len());
        sizes.fold([0; 2], |[frames, trainings], missing| {
            [
                frames + usize::from(missing > 0) * results.plan.rows,
                trainings + missing,
            ]
        })
    }

    /// Does what is missing of the sweep, and then picks, or writes the documents.
    ///
    /// `begins` is told the numbers of frames and trainings ahead, and gives what to call at every
    /// step.
    ///
    /// # Errors
    /// When a file cannot be read or written or holds something else, a training fails, or nothing
    /// is within the limits.
    pub fn run<P: Fn(Step) + Sync>(&self, begins: impl Fn([usize; 2]) -> P) -> Result<()> {
        if let Some(folder) = self.results.parent() {
            fs::create_dir_all(folder)?;
        }
        // Read first: they are needed in the end.
        let costs = Costs::load(&self.costs)?;
        let mut results = Results::open(&self.results, self.plan().as_ref())?;
        let left = Self::left(&results);
        if left[1] > 0 {
            sweep(&mut results, &self.work, begins(left))?;
        }
        let all = configurations(&results, &costs)?;
        if self.limits() == Limits::default() && self.out.is_none() {
            return self.write_documents(&results, &all);
        }
        let picked = best(&all, &self.limits())?;
        println!("{}", told(picked));
        if let Some(folder) = &self.out {
            let step = begins([model::FRAMES, 0]);
            println!("{}", model::write(picked, folder, || step(Step::Frame))?);
        }
        Ok(())
    }

    fn write_documents(&self, results: &Results, all: &[Configuration]) -> Result<()> {
        let file = self.docs.join("tradeoff.md");
        document::write_into(&file, "tradeoff", &report::markdown(results, all))?;
        write(&self.docs.join("pictures/tradeoff.svg"), &report::plot(all))?;
        write(
            &self.results.with_file_name("configurations.csv"),
            &report::csv(all),
        )
    }
}

fn write(file: &Path, text: &str) -> Result<()> {
    fs::write(file, text).with_context(|| format!("cannot write {}", file.display()))?;
    println!("wrote {}", file.display());
    Ok(())
}

fn told(picked: &Configuration) -> String {
    let half = |mean: &table::Mean| mean.half_width.unwrap_or(0.0);
    let (strong, force) = (&picked.strong_direction_deg, &picked.force_rmse_mn);
    let mut text = format!(
        "picked: {picked}\n  simulated: direction {:.3}° ± {:.3}° from 50 mN up, {:.3}° over all; \
         |F| {:.3} ± {:.3} mN RMSE; place {:.1} µm along x and y each",
        strong.value,
        half(strong),
        picked.direction_deg.value,
        force.value,
        half(force),
        picked.place_rmse_um.value
    );
    if let Some(cost) = &picked.cost {
        text += &format!(
            "\n  modelled: {} cycles, {:.0} µs, {:.0} frames a second, {:.0} µs from the last \
             pixel to the sample",
            cost.cycles,
            cost.microseconds(),
            cost.rate(),
            cost.latency_microseconds()
        );
    }
    text
}
