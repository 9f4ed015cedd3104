//! What each effect of the simulated sensor is worth: switched, and compared with the default.

mod catalogue;
mod compare;
mod table;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_twin::Preset;
use indicatif::ProgressBar;
use rayon::prelude::*;

use self::catalogue::effects;
use self::compare::{Change, Nominal};
use self::table::Table;
use super::size::Size;

/// Arguments of `scene effects`.
#[derive(Args)]
pub struct EffectsArgs {
    /// Geometry preset: paper or ov7725.
    #[arg(long, default_value = "ov7725")]
    preset: Preset,
    /// Frame size, such as 320x240. Forces are measured where the default model fits: ov7725 at
    /// 320x240.
    #[arg(long, default_value = "320x240")]
    size: Size,
    /// Frames of the scene `sweep` for each effect, at 12 per second.
    #[arg(long, default_value_t = 240, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    frames: u32,
    /// Print JSON.
    #[arg(long, conflicts_with = "document")]
    json: bool,
    /// Write the table into this document instead, between its lines
    /// `<!-- effects PRESET SIZE: begin … -->` and `… end -->`.
    #[arg(long)]
    document: Option<PathBuf>,
}

/// One row of the table.
struct Row {
    name: &'static str,
    what: &'static str,
    in_default: bool,
    change: Change,
}

impl EffectsArgs {
    pub(super) fn run(&self) -> Result<()> {
        let table = self.measure()?;
        match &self.document {
            Some(file) => table.write_into(file),
            None if self.json => {
                println!("{}", serde_json::to_string_pretty(&table.to_json())?);
                Ok(())
            }
            None => {
                print!("{}", table.to_text());
                Ok(())
            }
        }
    }

    fn measure(&self) -> Result<Table> {
        let nominal = Nominal::new(self.preset, self.size, self.frames)?;
        let effects = effects();
        let bar = ProgressBar::new(effects.len() as u64);
        let rows = effects.par_iter().map(|effect| {
            let change = nominal.change(effect)?;
            bar.inc(1);
            Ok(Row {
                name: effect.name,
                what: effect.what,
                in_default: effect.in_default,
                change,
            })
        });
        let rows = rows.collect::<Result<Vec<_>>>()?;
        let floor = nominal.noise_floor()?;
        bar.finish_and_clear();
        Ok(Table::new(self, rows, floor, nominal.has_model()))
    }
}
