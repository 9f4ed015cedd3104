//! The table of effects as text, Markdown and JSON.

use std::path::Path;

use anyhow::Result;
use serde_json::{Value, json};

use crate::document;

use super::compare::{Change, Spread};
use super::{EffectsArgs, Row};

/// All effects, those that move centroids most first, and the noise floor.
pub struct Table {
    /// Preset and frame size.
    conditions: String,
    frames: u32,
    rows: Vec<Row>,
    floor: Change,
    has_model: bool,
}

/// Titles of the columns of numbers.
const TITLES: [&str; 7] = [
    "centroid, px",
    "worst",
    "motion, px",
    "worst",
    "force, mN",
    "direction, °",
    "rejected",
];

impl Table {
    pub fn new(args: &EffectsArgs, mut rows: Vec<Row>, floor: Change, has_model: bool) -> Table {
        let key = |row: &Row| row.change.motion_px.rms().unwrap_or(f64::INFINITY);
        rows.sort_by(|a, b| key(b).total_cmp(&key(a)));
        Table {
            conditions: format!("{} {}", args.preset, args.size),
            frames: args.frames,
            rows,
            floor,
            has_model,
        }
    }

    /// Whether a row moves centroids, after a tare, by more than other noise does, or makes frames
    /// useless.
    fn is_above_floor(&self, change: &Change) -> bool {
        let floor = self.floor.motion_px.rms().unwrap_or(0.0);
        change.rejected > 0 || change.motion_px.rms().is_none_or(|rms| rms > floor)
    }

    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}, {} frames; rms of the change, and the worst\n\n{:18} {:5}",
            self.conditions, self.frames, "effect", "usual"
        );
        for title in TITLES {
            text += &format!(" {title:>12}");
        }
        let mut line = |name: &str, usual: &str, change: &Change, what: &str| {
            text += &format!("\n{name:18} {usual:5}");
            for number in self.numbers(change) {
                text += &format!(" {number:>12}");
            }
            text += &format!("  {what}");
        };
        for row in &self.rows {
            line(row.name, usual(row), &row.change, row.what);
        }
        line(
            "noise floor",
            "",
            &self.floor,
            "the same frames with other noise",
        );
        text + "\n"
    }

    /// A row's numbers as words.
    fn numbers(&self, change: &Change) -> [String; 7] {
        let word = |number: Option<f64>, digits: usize| {
            number.map_or("–".to_owned(), |number| format!("{number:.digits$}"))
        };
        let worst = |spread: Spread| spread.rms().map(|_| spread.worst);
        [
            word(change.centroid_px.rms(), 3),
            word(worst(change.centroid_px), 3),
            word(change.motion_px.rms(), 3),
            word(worst(change.motion_px), 3),
            word(change.force_mn.rms(), 2),
            word(change.direction_deg.rms(), 2),
            change.rejected.to_string(),
        ]
    }

    fn to_markdown(&self) -> String {
        let cells = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        // Without a model there are no forces to tell.
        let shown = |column: &usize| self.has_model || !(4..6).contains(column);
        let columns: Vec<usize> = (0..TITLES.len()).filter(shown).collect();
        let row = |name: &str, what: &str, usual: &str, change: &Change| {
            let numbers = self.numbers(change);
            let numbers = columns.iter().map(|&column| numbers[column].clone());
            let words = [name, what, usual].map(str::to_owned);
            cells(&words.into_iter().chain(numbers).collect::<Vec<_>>())
        };
        let titles = ["effect", "switched to", "usual"].into_iter();
        let titles = titles.chain(columns.iter().map(|&column| TITLES[column]));
        let titles: Vec<String> = titles.map(str::to_owned).collect();
        let mut text = cells(&titles) + &"|---".repeat(titles.len()) + "|\n";
        let (above, below): (Vec<&Row>, Vec<&Row>) = self
            .rows
            .iter()
            .partition(|row| self.is_above_floor(&row.change));
        let line = |each: &&Row| row(each.name, each.what, usual(each), &each.change);
        text.extend(above.iter().map(line));
        let floor = "the same frames with other noise";
        text += &row("**noise floor**", floor, "", &self.floor);
        text.extend(below.iter().map(line));
        text
    }

    pub fn to_json(&self) -> Value {
        let spread = |spread: &Spread| match spread.rms() {
            Some(rms) => json!({ "rms": rms, "worst": spread.worst }),
            None => Value::Null,
        };
        let numbers = |change: &Change| {
            json!({
                "centroid_px": spread(&change.centroid_px),
                "motion_px": spread(&change.motion_px),
                "force_mn": spread(&change.force_mn),
                "direction_deg": spread(&change.direction_deg),
                "rejected": change.rejected,
            })
        };
        let row = |row: &Row| {
            json!({
                "name": row.name,
                "switched_to": row.what,
                "in_default": row.in_default,
                "above_floor": self.is_above_floor(&row.change),
                "change": numbers(&row.change),
            })
        };
        json!({
            "conditions": self.conditions,
            "frames": self.frames,
            "noise_floor": numbers(&self.floor),
            "effects": self.rows.iter().map(row).collect::<Vec<_>>(),
        })
    }

    /// Puts the table into a document, between the lines that are there for it.
    ///
    /// # Errors
    /// When the document cannot be read or written, or has no such lines.
    pub fn write_into(&self, file: &Path) -> Result<()> {
        let name = format!("effects {}", self.conditions);
        document::write_into(file, &name, &self.to_markdown())
    }
}

fn usual(row: &Row) -> &'static str {
    if row.in_default { "on" } else { "off" }
}
