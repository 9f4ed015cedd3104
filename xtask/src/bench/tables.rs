//! What was measured, as items, and as tables in Markdown: for people, and for
//! `docs/results/performance.md`.

use std::fmt::Write;

use serde::Serialize;

use super::cases::Work;
use super::measure::{Cost, Measured};
use super::stages::ORDER;
use crate::size::grouped;

/// The core's clock, in MHz.
const CLOCK_MHZ: f64 = 480.0;

/// One measured item. Its three numbers are per frame, or per inference; those of `mac` are per
/// multiplication.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Item {
    /// `threshold`, `blobs`, `frame full`, `latency`, `network …`, `mac` or `table` (the
    /// threshold's, of 256 × 256 values); of a frame that is not the usual one, what it is follows
    /// after a comma.
    pub item: String,
    /// Columns and rows: `320x240`.
    pub frame: String,
    /// `rgb565`, `yuv422` or `mono`.
    pub format: String,
    /// Executed instructions, exact; also the cycles of a core that issues one at a time.
    pub instructions: f64,
    /// Cycles by LLVM's model of the Cortex-M7, in memory without wait states; none without LLVM.
    pub modelled_cycles: f64,
    /// Cycles of a core that always issues two.
    pub floor_cycles: f64,
}

impl Item {
    fn new(measured: &Measured, name: &str, cost: Cost, count: f64) -> Item {
        // Whole cycles, or thousandths of them for one multiplication.
        let steps = if count > 1.0 { 1000.0 } else { 1.0 };
        let each = |number: f64| (number / count * steps).round() / steps;
        let instructions = cost.instructions as f64;
        Item {
            item: name.to_owned(),
            frame: measured.case.frame(),
            format: measured.case.format.clone(),
            instructions: each(instructions),
            modelled_cycles: each(cost.cycles),
            floor_cycles: each(instructions / 2.0),
        }
    }

    /// What it is, in one line.
    pub fn label(&self) -> String {
        format!("{}, {} {}", self.item, self.frame, self.format)
    }

    fn row(&self) -> String {
        let Item {
            item,
            frame,
            format,
            instructions,
            modelled_cycles: cycles,
            floor_cycles,
        } = self;
        let [counted, modelled, floor] = [*instructions, *cycles, *floor_cycles].map(decimal);
        let start = format!("| {item} | {frame} | {format} | {counted} | {modelled} | {floor}");
        if item == "mac" || cycles.is_nan() {
            return format!("{start} | | | |");
        }
        let sides = frame.split('x').filter_map(|side| side.parse::<f64>().ok());
        let is_of_pixels = !item.starts_with("network") && !item.starts_with("latency");
        let per_pixel = is_of_pixels.then(|| format!("{:.2}", cycles / sides.product::<f64>()));
        let (time, rate) = (
            cycles / CLOCK_MHZ,
            decimal((CLOCK_MHZ * 1e6 / cycles).round()),
        );
        format!(
            "{start} | {} | {time:.1} | {rate} |",
            per_pixel.unwrap_or_default()
        )
    }
}

/// All items of all cases.
pub fn items(measured: &[Measured]) -> Vec<Item> {
    measured.iter().flat_map(items_of).collect()
}

fn items_of(measured: &Measured) -> Vec<Item> {
    let total = measured.total();
    let one = |name: &str| Item::new(measured, name, total, 1.0);
    match &measured.case.work {
        Work::Frame(special) => {
            let comma = if special.is_empty() { "" } else { ", " };
            let costs = [
                ("threshold", measured.of(&["threshold"])),
                ("blobs", measured.of(&["dilation", "runs, labels, moments"])),
                ("frame full", total),
                ("latency", measured.last_band),
            ];
            let item =
                |(part, cost)| Item::new(measured, &format!("{part}{comma}{special}"), cost, 1.0);
            costs.map(item).into()
        }
        Work::Table => vec![one("table")],
        Work::Steps(1) => vec![one("network and 1 step")],
        Work::Steps(steps) => vec![one(&format!("network and {steps} steps"))],
        Work::Network(widths) => {
            let names: Vec<String> = widths.iter().map(u64::to_string).collect();
            let mut items = vec![one(&format!("network {}", names.join("-")))];
            // The loops of narrow layers say little about the loop.
            if widths.iter().any(|&width| width >= 128) {
                let count: u64 = widths.windows(2).map(|pair| pair[0] * pair[1]).sum();
                items.push(Item::new(
                    measured,
                    "mac",
                    measured.inner_loop,
                    count as f64,
                ));
            }
            items
        }
    }
}

/// Everything: items, and the stages of the frame that the firmware takes.
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
        if is_usual && measured.case.frame() == "320x240" {
            let (format, stages) = (&measured.case.format, stages(measured));
            let _ = write!(
                text,
                "\nThe usual frame of 320x240 {format} by stages:\n\n{stages}"
            );
        }
    }
    text
}

/// What follows the moments, and all calls of a library, of which some belong to what comes before.
const FROM_MOMENTS: [&str; 5] = ["markers", "features", "network", "angles, force", "library"];

fn stages(measured: &Measured) -> String {
    let head = "| stage | instructions | modelled cycles | floor |\n|---|---:|---:|---:|\n";
    let known = ORDER
        .iter()
        .filter_map(|stage| Some((*stage, *measured.stages.get(stage)?)));
    let sums = [
        ("from the moments to the force", measured.of(&FROM_MOMENTS)),
        ("together", measured.total()),
    ];
    let row = |(stage, cost): (&str, Cost)| {
        let counted = cost.instructions as f64;
        let [counted, cycles, floor] =
            [counted, cost.cycles, counted / 2.0].map(|number| decimal(number.round()));
        format!("| {stage} | {counted} | {cycles} | {floor} |\n")
    };
    let rows: String = known.chain(sums).map(row).collect();
    format!("{head}{rows}")
}

/// A number that is not negative, with a comma after each three digits, and with up to three
/// decimals if it has some.
pub fn decimal(number: f64) -> String {
    if number.is_nan() {
        return "–".to_owned();
    }
    let thousandths = (number * 1000.0).round() as u64;
    let whole = grouped(thousandths / 1000);
    match thousandths % 1000 {
        0 => whole,
        rest => format!("{whole}.{rest:03}")
            .trim_end_matches('0')
            .to_owned(),
    }
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
        assert!(
            item.row()
                .ends_with("| 96,000 | 76,800.5 | 1.25 | 200.0 | 5,000 |")
        );
        item.modelled_cycles = f64::NAN;
        assert!(item.row().ends_with("| – | 76,800.5 | | | |"));
        let json = serde_json::to_string(&item).unwrap();
        assert!(json.contains(r#""modelled_cycles":null"#), "{json}");
    }
}
