//! Figures side by side.

use std::fmt::Write;

use serde::Serialize;

use super::errors::Sums;
use super::limit::Tenth;
use super::models::Model;
use crate::scene::size::Size;

/// One contact reading.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    pub contact: String,
    pub preset: String,
    pub training_frames: usize,
    pub test_frames: usize,
    /// Held-out poses that the common frames are of.
    pub poses: usize,
    /// Test frames that everyone accepted at every size: the errors are theirs.
    pub common_frames: usize,
    /// Passes of the paper's network.
    pub epochs: usize,
    pub cells: Vec<Cell>,
    /// What the centroids allow, for each size.
    pub limits: Vec<(String, Vec<Tenth>)>,
}

/// One model at one size.
#[derive(Clone, Debug, Serialize)]
pub struct Cell {
    pub size: String,
    pub model: &'static str,
    pub direction_deg: f64,
    pub strong_direction_deg: f64,
    pub force_rmse_mn: f64,
    /// Test frames that it refused.
    pub rejected: usize,
}

impl Cell {
    pub fn new(size: Size, model: &Model, errors: &Sums, rejected: usize) -> Self {
        Self {
            size: size.to_string(),
            model: model.name,
            direction_deg: errors.direction_deg,
            strong_direction_deg: errors.strong_deg,
            force_rmse_mn: 1e3 * errors.force_rmse_n,
            rejected,
        }
    }

    fn ratios(&self, peer: &Cell) -> String {
        let ratio = |value: fn(&Cell) -> f64| format!("{:.2}", value(self) / value(peer));
        format!(
            "{}, {}, {}",
            ratio(|c| c.direction_deg),
            ratio(|c| c.strong_direction_deg),
            ratio(|c| c.force_rmse_mn)
        )
    }
}

impl Comparison {
    /// The paper's pipeline at a size.
    fn paper(&self, size: &str) -> Option<&Cell> {
        self.cells
            .iter()
            .find(|c| c.size == size && c.model == "the paper's")
    }

    fn markdown(&self) -> String {
        let mut text = format!(
            "Contact reading `{}`, preset `{}`: trained on {} frames, judged on {} of {} frames of \
             {} held-out poses that everyone accepted. The paper's network: {} passes.\n\n| frame \
             | model | direction | \\|F\\| ≥ 50 mN | RMSE of \\|F\\| | rejected | times the \
             paper's at {} | times the paper's at this size |\n|---|---|--:|--:|--:|--:|---|---|\n",
            self.contact,
            self.preset,
            self.training_frames,
            self.common_frames,
            self.test_frames,
            self.poses,
            self.epochs,
            self.cells.first().map_or("", |cell| &cell.size)
        );
        let first = self.cells.first();
        for cell in &self.cells {
            let beside = |peer: Option<&Cell>| peer.map_or(String::new(), |peer| cell.ratios(peer));
            let _ = writeln!(
                text,
                "| {} | {} | {:.3}° | {:.3}° | {:.3} mN | {} | {} | {} |",
                cell.size,
                cell.model,
                cell.direction_deg,
                cell.strong_direction_deg,
                cell.force_rmse_mn,
                cell.rejected,
                beside(first),
                beside(self.paper(&cell.size))
            );
        }
        for (size, tenths) in &self.limits {
            let _ = write!(text, "\n{}", limits(&self.contact, size, tenths));
        }
        text
    }
}

/// Our models beside the Cramér–Rao bound, as multiples of it.
fn limits(contact: &str, size: &str, tenths: &[Tenth]) -> String {
    let Some(first) = tenths.first() else {
        return String::new();
    };
    let names: Vec<_> = first.found.iter().map(|(name, _)| *name).collect();
    let mut text = format!(
        "The limit, `{contact}`, {size}: root mean squares by tenths of the frames, direction and \
         \\|F\\|; models as multiples of the bound.\n\n| \\|F\\|, mN | scatter, px | noise alone | \
         bound | bound of noise alone | {} |\n|---|--:|--:|---|---|{}\n",
        names.join(" | "),
        "---|".repeat(names.len())
    );
    for tenth in tenths {
        let [low, high] = tenth.force_mn;
        let pair = |[direction, force]: [f64; 2]| format!("{direction:.3}°, {force:.3} mN");
        let over = |(_, found): &(&str, [f64; 2])| {
            let [direction, force] = [0, 1].map(|i| found[i] / tenth.bound[i]);
            format!("{direction:.2}, {force:.2}")
        };
        let found: Vec<_> = tenth.found.iter().map(over).collect();
        let _ = writeln!(
            text,
            "| {low:.0}–{high:.0} | {:.3} | {:.3} | {} | {} | {} |",
            tenth.scatter_px,
            tenth.repeat_px,
            pair(tenth.bound),
            pair(tenth.noise_bound),
            found.join(" | ")
        );
    }
    text
}

/// All comparisons as Markdown. A cell with three ratios has direction, direction from 50 mN up,
/// and RMSE of |F|.
pub fn markdown(comparisons: &[Comparison]) -> String {
    let texts: Vec<_> = comparisons.iter().map(Comparison::markdown).collect();
    texts.join("\n")
}
