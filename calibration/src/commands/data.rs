//! The command that renders data sets.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_calibration::data::dataset::{Dataset, Recipe, generate, generate_file};
use hivtac_calibration::progress::bar;

/// Options of `dataset`.
#[derive(Args)]
pub struct DatasetArgs {
    #[command(flatten)]
    recipe: Recipe,
    /// The CSV file to write.
    #[arg(long)]
    out: PathBuf,
}

impl DatasetArgs {
    pub fn run(&self) -> Result<()> {
        let bar = bar("rendering", self.recipe.rows());
        let dataset = generate_file(&self.recipe, &self.out, |rows| bar.inc(rows))?;
        bar.finish_and_clear();
        say(&dataset);
        Ok(())
    }
}

/// Renders a data set without writing a file.
pub fn rendered(recipe: &Recipe) -> Result<Dataset> {
    let bar = bar("rendering", recipe.rows());
    let dataset = generate(recipe, || bar.inc(1))?;
    bar.finish_and_clear();
    say(&dataset);
    Ok(dataset)
}

fn say(dataset: &Dataset) {
    let rejected = dataset.rejected();
    println!(
        "data set: {} frames, {} rejected; contact reading `{}`",
        dataset.rows.len(),
        rejected.values().sum::<usize>(),
        dataset.about.conditions.contact
    );
    rejected
        .iter()
        .for_each(|(status, count)| println!("  {status}: {count}"));
}
