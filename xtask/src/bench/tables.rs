//! Formats the measurements as items and as tables in Markdown, for people and for
//! `docs/results/performance.md`.

use std::fmt::Write;

use serde::Serialize;

use super::measure::{Cost, Measured, Work, sum};
use super::stages::order;
use crate::size::grouped;

/// The core's clock, in MHz.
const CLOCK_MHZ: f64 = 480.0;

/// One measured item. Its three numbers are for a frame or an inference; those of `mac` are for a
/// multiplication.
#[derive(Serialize)]
pub struct Item {
    /// `threshold`, `blobs`, `frame full`, `latency`, `network …`, `mac` or `table` (the
    /// threshold's, of 256 × 256 values). For a special frame its name follows after a comma.
    pub item: String,
    /// Columns and rows: `320x240`.
    pub frame: String,
    /// `rgb565`, `yuv422` or `mono`.
    pub format: String,
    /// Executed instructions, exact; also the cycles of a core that issues one at a time.
    pub instructions: f64,
    /// Cycles by LLVM's model of the Cortex-M7, in memory without wait states; NaN without LLVM.
    pub modelled_cycles: f64,
    /// Cycles of a core that always issues two.
    pub floor_cycles: f64,
}

impl Item {
    fn new(measured: &Measured, item: String, cost: Cost, count: u64) -> Item {
        // Whole cycles, or thousandths of a cycle for one multiplication.
        let steps = if count > 1 { 1000.0 } else { 1.0 };
        let each = |number: f64| (number / count as f64 * steps).round() / steps;
        let instructions = cost.instructions as f64;
        let ([width, height], format) = (measured.case.size, measured.case.format.clone());
        Item {
            item,
            frame: format!("{width}x{height}"),
            format,
            instructions: each(instructions),
            modelled_cycles: each(cost.cycles),
            floor_cycles: each(instructions / 2.0),
        }
    }

    fn row(&self) -> String {
        let (item, frame, cycles) = (&self.item, &self.frame, self.modelled_cycles);
        let numbers = cells([self.instructions, cycles, self.floor_cycles]);
        let start = format!("| {item} | {frame} | {} |{numbers}", self.format);
        if item == "mac" || cycles.is_nan() {
            return format!("{start} | | |");
        }
        let sides = frame.split('x').filter_map(|side| side.parse::<f64>().ok());
        let per_pixel = match item.starts_with("network") || item.starts_with("latency") {
            true => String::new(),
            false => format!("{:.2}", cycles / sides.product::<f64>()),
        };
        let time = cycles / CLOCK_MHZ;
        let rate = decimal((1e6 / time).round());
        format!("{start} {per_pixel} | {time:.1} | {rate} |")
    }
}

/// All items of a case.
pub fn items(measured: &Measured) -> Vec<Item> {
    let stages = &measured.stages;
    let one = |name: String, cost| Item::new(measured, name, cost, 1);
    let whole = |name: String| one(name, sum(stages, &[]));
    match &measured.case.work {
        Work::Frame(special) => {
            let comma = if special.is_empty() { "" } else { ", " };
            let item = |part, cost| one(format!("{part}{comma}{special}"), cost);
            let blobs = sum(stages, &["dilation", "runs, labels, moments"]);
            vec![
                item("threshold", sum(stages, &["threshold"])),
                item("blobs", blobs),
                item("frame full", sum(stages, &[])),
                item("latency", measured.last_band),
            ]
        }
        Work::Table => vec![whole("table".to_owned())],
        Work::Steps(1) => vec![whole("network and 1 step".to_owned())],
        Work::Steps(steps) => vec![whole(format!("network and {steps} steps"))],
        Work::Network(widths) => {
            let names: Vec<String> = widths.iter().map(u64::to_string).collect();
            let mut items = vec![whole(format!("network {}", names.join("-")))];
            // Narrow layers show little of the inner loop's cost.
            if widths.iter().any(|&width| width >= 128) {
                let count = widths.windows(2).map(|pair| pair[0] * pair[1]).sum();
                let name = "mac".to_owned();
                items.push(Item::new(measured, name, measured.inner_loop, count));
            }
            items
        }
    }
}

/// The tables of all items, and of the stages of the firmware's frame.
pub fn all(items: &[Item], measured: &[Measured]) -> String {
    let mut text = "| item | frame | format | instructions = single issue | modelled cycles | \
                    floor | per pixel | µs at 480 MHz | per second |\n\
                    |---|---|---|---:|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for item in items {
        let _ = writeln!(text, "{}", item.row());
    }
    for measured in measured {
        let is_usual = matches!(&measured.case.work, Work::Frame(special) if special.is_empty());
        if is_usual && measured.case.size == [320, 240] {
            let (format, stages) = (&measured.case.format, stages(measured));
            let title = format!("The usual frame of 320x240 {format} by stages");
            let _ = write!(text, "\n{title}:\n\n{stages}");
        }
    }
    text
}

/// The stages after the moments. Of the calls of a library some belong to earlier stages.
const FROM_MOMENTS: [&str; 5] = ["markers", "features", "network", "angles, force", "library"];

fn stages(measured: &Measured) -> String {
    let stages = &measured.stages;
    let known = order().filter_map(|stage| Some((stage, *stages.get(stage)?)));
    let sums = [
        ("from the moments to the force", sum(stages, &FROM_MOMENTS)),
        ("together", sum(stages, &[])),
    ];
    let mut text = "| stage | instructions | modelled cycles | floor |\n".to_owned();
    text += "|---|---:|---:|---:|\n";
    for (stage, cost) in known.chain(sums) {
        let counted = cost.instructions as f64;
        let numbers = [counted, cost.cycles, counted / 2.0].map(f64::round);
        let _ = writeln!(text, "| {stage} |{}", cells(numbers));
    }
    text
}

fn cells(numbers: [f64; 3]) -> String {
    numbers
        .map(|number| format!(" {} |", decimal(number)))
        .concat()
}

/// A non-negative number with a comma after each three digits, and up to three decimals.
pub fn decimal(number: f64) -> String {
    if number.is_nan() {
        return "–".to_owned();
    }
    let text = format!("{number:.3}");
    let (whole, rest) = text.split_at(text.len() - 4);
    let whole = grouped(whole.parse().unwrap_or(0));
    format!(
        "{whole}{}",
        rest.trim_end_matches('0').trim_end_matches('.')
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_and_rate_follow_from_modelled_cycles_where_there_are_some() {
        let mut item = Item {
            item: "frame full".to_owned(),
            frame: "320x240".to_owned(),
            format: "rgb565".to_owned(),
            instructions: 153_600.0,
            modelled_cycles: 96_000.0,
            floor_cycles: 76_800.5,
        };
        let row = item.row();
        let end = "| 96,000 | 76,800.5 | 1.25 | 200.0 | 5,000 |";
        assert!(row.ends_with(end), "{row}");
        item.modelled_cycles = f64::NAN;
        assert!(item.row().ends_with("| – | 76,800.5 | | | |"));
        let json = serde_json::to_string(&item).unwrap();
        assert!(json.contains(r#""modelled_cycles":null"#), "{json}");
    }
}
