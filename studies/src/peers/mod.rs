//! `hivtac-studies peers`: the sensing and its models beside the paper's own pipeline, on the same
//! rendered frames.
//!
//! The paper's pipeline is its Section 5: OpenCV's HSV, threshold, dilation, contours and moments,
//! and a float network of three hidden layers of 512 that answers with angles and |F|. Both are
//! trained on the same frames of four fifths of the paper's poses and judged on the same frames of
//! the others.

mod errors;
mod frames;
pub mod limit;
mod models;
mod opencv;
mod table;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use hivtac_terms::geometry::Preset;
use hivtac_twin::Contact;

use crate::document;
use crate::scene::size::Size;
use frames::{Frames, Open};
use models::How;
use opencv::Python;
use table::{Cell, Comparison};

/// What to compare.
#[derive(Args, Clone, Debug)]
pub struct PeersArgs {
    /// What the labels mean, one comparison each.
    #[arg(long, value_delimiter = ',', default_values = ["force", "stick", "slip:0.6"])]
    contacts: Vec<Contact>,
    /// Frame sizes; the paper's pipeline at the first is what the goals compare with.
    #[arg(long, value_delimiter = ',', default_values = ["800x600", "320x240"])]
    sizes: Vec<Size>,
    /// Geometry preset: paper or ov7725.
    #[arg(long, default_value = "paper")]
    preset: Preset,
    /// Frames to train on for each of 286 poses.
    #[arg(long, default_value_t = 42)]
    training: usize,
    /// Frames to judge on for each of the other 71.
    #[arg(long, default_value_t = 282)]
    test: usize,
    /// Passes of the paper's network over its data (the paper: 100).
    #[arg(long, default_value_t = 100)]
    epochs: usize,
    /// Its hidden layers.
    #[arg(long, value_delimiter = ',', default_values_t = [512, 512, 512])]
    hidden: Vec<usize>,
    /// Passes of our networks in floats.
    #[arg(long, default_value_t = 1000)]
    our_epochs: usize,
    /// And with the chip's rounding.
    #[arg(long, default_value_t = 100)]
    our_rounded_epochs: usize,
    /// Where Python, frames and networks are kept.
    #[arg(long, default_value = "target/peers")]
    folder: PathBuf,
    /// Render nothing more: judge on the test frames that an interrupted run left in the folder.
    #[arg(long)]
    kept_frames: bool,
    /// Write the figures as JSON, too.
    #[arg(long)]
    json: Option<PathBuf>,
    /// Write the tables into this document, between its lines `<!-- peers: begin … -->` and
    /// `<!-- peers: end -->`.
    #[arg(long)]
    document: Option<PathBuf>,
}

impl PeersArgs {
    /// Does it, and prints the tables.
    ///
    /// # Errors
    /// When OpenCV cannot be had, files are of another run, or the scene cannot render what is
    /// asked for.
    pub fn run(&self) -> Result<()> {
        let python = Python::in_folder(&self.folder)
            .context("without OpenCV there is nothing to compare with")?;
        let detector: &Open = &|width, height| Ok(Box::new(python.detector(width, height)?));
        let comparisons = self.compare(detector)?;
        let text = table::markdown(&comparisons);
        println!("{text}");
        if let Some(path) = &self.json {
            let json = serde_json::to_string_pretty(&comparisons)? + "\n";
            fs::write(path, json).with_context(|| format!("cannot write {}", path.display()))?;
        }
        match &self.document {
            Some(file) => document::write_into(file, "peers", &text),
            None => Ok(()),
        }
    }

    /// Compares with whatever finds the markers for the paper's network.
    fn compare(&self, detector: &Open) -> Result<Vec<Comparison>> {
        ensure!(!self.sizes.is_empty(), "name at least one frame size");
        self.contacts
            .iter()
            .map(|&contact| self.reading(contact, detector))
            .collect()
    }

    fn reading(&self, contact: Contact, detector: &Open) -> Result<Comparison> {
        let seen = |size: &Size| Frames::make(self, contact, *size, detector);
        let sizes: Vec<Frames> = self.sizes.iter().map(seen).collect::<Result<_>>()?;
        let rendered = frames::rendered_everywhere(&sizes);
        let everywhere = frames::seen_everywhere(&sizes);
        let (mut cells, mut limits) = (Vec::new(), Vec::new());
        for (size, frames) in self.sizes.iter().zip(&sizes) {
            let mut ours = Vec::new();
            for model in models::all(self, contact, *size, frames)? {
                let answers = model.answers(frames)?;
                let errors = errors::Sums::of(&answers, &everywhere);
                cells.push(Cell::new(
                    *size,
                    &model,
                    &errors,
                    frames.rejected(model.how, rendered),
                ));
                if model.how == How::Chip {
                    ours.push((model.name, answers));
                }
            }
            let tenths = limit::tenths(frames, &everywhere, &ours)?;
            limits.push((size.to_string(), tenths));
        }
        Ok(Comparison {
            contact: contact.to_string(),
            preset: self.preset.name().to_owned(),
            training_frames: sizes[0].ours.training.rows.len(),
            test_frames: rendered,
            poses: frames::poses(&sizes[0], &everywhere),
            common_frames: everywhere.len(),
            epochs: self.epochs,
            cells,
            limits,
        })
    }

    /// A file of this study.
    fn file(&self, contact: Contact, size: Size, name: &str) -> PathBuf {
        let contact = contact.to_string().replace(':', "-");
        let preset = self.preset.name();
        self.folder
            .join(format!("{contact}-{preset}-{size}-{name}"))
    }
}

/// Whether a file is there.
fn there(path: &Path) -> bool {
    path.try_exists().unwrap_or(false)
}

#[cfg(test)]
mod tests;
