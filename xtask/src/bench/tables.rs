//! What was measured, as tables in Markdown: for people, and for `docs/results/performance.md`.

use std::fmt::Write;

use super::cases::Work;
use super::items::{Item, steps_of};
use super::measure::{Cost, Measured};
use super::memory::{AXI_LOAD, FLASH_LINE};
use super::stages;
use crate::numbers::{decimal, grouped};

/// The core's clock, in MHz.
const CLOCK_MHZ: f64 = 480.0;
/// Cycles of a wrong prediction: LLVM's model of the core (`ARMScheduleM7.td`) gives six for a
/// forward branch.
const MISPREDICTION: u64 = 6;

/// Everything: items, the stages of the frame that the firmware takes, and what memory and branches
/// add.
pub fn all(items: &[Item], measured: &[Measured]) -> String {
    let mut text = self::items(items);
    let usual = |measured: &&Measured| measured.case.is_usual_frame();
    let reference = measured.iter().filter(usual);
    for measured in reference.filter(|measured| measured.case.frame() == "320x240") {
        let _ = write!(
            text,
            "\nThe usual frame of 320x240 {} by stages:\n\n{}",
            measured.case.format,
            stages(measured)
        );
    }
    let _ = write!(
        text,
        "\nWhat the modelled cycles leave out:\n\n{}",
        surcharges(measured)
    );
    text
}

/// Every item.
fn items(items: &[Item]) -> String {
    let mut text = "| item | frame | format | instructions = single issue | modelled cycles | \
                    floor | per pixel | µs at 480 MHz | per second |\n\
                    |---|---|---|---:|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for item in items {
        let _ = writeln!(text, "{}", row(item));
    }
    text
}

fn row(item: &Item) -> String {
    let Item {
        item: name,
        frame,
        format,
        instructions,
        modelled_cycles,
        floor_cycles,
    } = item;
    let (instructions, floor) = (number(item, *instructions), number(item, *floor_cycles));
    let Some(cycles) = modelled_cycles else {
        return format!("| {name} | {frame} | {format} | {instructions} | – | {floor} | | | |");
    };
    let modelled = number(item, *cycles);
    let start = format!("| {name} | {frame} | {format} | {instructions} | {modelled} | {floor}");
    if item.is_per_multiplication() {
        return format!("{start} | | | |");
    }
    let per_pixel = if name.starts_with("network") || name.starts_with("latency") {
        String::new()
    } else {
        format!("{:.2}", cycles / pixels(frame))
    };
    let (time, rate) = (cycles / CLOCK_MHZ, CLOCK_MHZ * 1e6 / cycles);
    format!(
        "{start} | {per_pixel} | {time:.1} | {} |",
        decimal(rate.round())
    )
}

fn number(item: &Item, number: f64) -> String {
    if item.is_per_multiplication() {
        format!("{number:.3}")
    } else {
        decimal(number)
    }
}

fn pixels(frame: &str) -> f64 {
    let sides = frame.split('x').filter_map(|side| side.parse::<f64>().ok());
    sides.product()
}

/// What follows the moments, and all calls of a library, of which some belong to what comes before.
const FROM_MOMENTS: [&str; 5] = ["markers", "features", "network", "angles, force", "library"];

/// The stages of one case.
fn stages(measured: &Measured) -> String {
    let mut text =
        "| stage | instructions | modelled cycles | floor |\n|---|---:|---:|---:|\n".to_owned();
    let known = stages::ORDER
        .iter()
        .filter_map(|stage| Some((*stage, *measured.stages.get(stage)?)));
    let sums = [
        ("from the moments to the force", measured.of(&FROM_MOMENTS)),
        ("together", measured.total()),
    ];
    for (stage, cost) in known.chain(sums) {
        let floor = cost.instructions as f64 / 2.0;
        let (instructions, cycles) = (grouped(cost.instructions), cycles(cost));
        let _ = writeln!(
            text,
            "| {stage} | {instructions} | {cycles} | {} |",
            decimal(floor.round())
        );
    }
    text
}

fn cycles(cost: Cost) -> String {
    cost.cycles
        .map_or("–".to_owned(), |cycles| decimal(cycles.round()))
}

/// What the modelled cycles leave out: memory with wait states and wrong predictions.
fn surcharges(measured: &[Measured]) -> String {
    let mut text = format!(
        "| case | modelled cycles | + wrong predictions, ≤ {MISPREDICTION} each | + rows in AXI \
         SRAM, uncached, {AXI_LOAD} a load | + weights in flash, {FLASH_LINE} for 32 bytes |\n\
         |---|---:|---:|---:|---:|\n"
    );
    for measured in measured {
        let (loads, wrong) = (&measured.loads, measured.mispredictions * MISPREDICTION);
        let weights = if loads.weights_fit() {
            format!("{} (fits DTCM)", grouped(loads.weights_in_flash()))
        } else {
            grouped(loads.weights_in_flash())
        };
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {weights} |",
            name(measured),
            cycles(measured.total()),
            grouped(wrong),
            grouped(loads.rows_in_axi()),
        );
    }
    text
}

/// A case in a few words.
fn name(measured: &Measured) -> String {
    let case = &measured.case;
    match &case.work {
        Work::Frame(special) if special.is_empty() => format!("{} {}", case.frame(), case.format),
        Work::Frame(special) => format!("{} {}, {special}", case.frame(), case.format),
        Work::Table => "the threshold's table".to_owned(),
        Work::Steps(steps) => steps_of(*steps),
        Work::Network(widths) => {
            let widths: Vec<String> = widths.iter().map(u64::to_string).collect();
            format!("network {}", widths.join("-"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(name: &str, cycles: Option<f64>) -> Item {
        Item {
            item: name.to_owned(),
            frame: "320x240".to_owned(),
            format: "rgb565".to_owned(),
            instructions: 153_600.0,
            modelled_cycles: cycles,
            floor_cycles: 76_800.0,
        }
    }

    #[test]
    fn time_and_rate_follow_from_modelled_cycles() {
        let line = row(&item("frame full", Some(96_000.0)));
        assert!(line.ends_with("| 1.25 | 200.0 | 5,000 |"), "{line}");
    }

    #[test]
    fn without_cycles_nothing_follows_from_them() {
        let line = row(&item("frame full", None));
        assert!(line.ends_with("| – | 76,800 | | | |"), "{line}");
    }
}
