//! `cargo xtask kit`: writes the sensor's printed parts.

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Args;

use crate::python;

/// Options of `cargo xtask kit`.
#[derive(Args)]
pub struct Kit {
    /// Folder to write to.
    #[arg(default_value = "target/kit")]
    out: PathBuf,
    /// What bought parts measure: `--pupil-mm 1.6 --lens-front-mm 21`; `--help` after `--` lists
    /// all.
    #[arg(last = true)]
    bought: Vec<String>,
}

impl Kit {
    /// Installs build123d if it is missing, and writes all files.
    pub fn run(&self) -> Result<()> {
        let written = python::write_kit(&self.out, &self.bought);
        written.context("the kit was not written; with build123d, `python -m kit OUT` does it")
    }
}
