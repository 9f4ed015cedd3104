//! `cargo xtask bench --paper`: the paper's Figure 14 and Table 1 with this sensor's rows.
//!
//! *Overall* is what the host receives from the firmware in the rig, by the device's clock: what
//! the camera's rate leaves. *Processing* is what the core could do with frames of the same scene
//! at the same times, by modelled cycles.

use std::fmt::Write;
use std::fs;

use anyhow::{Context, Result, ensure};

use super::document;
use super::items::Item;
use super::measure::Measured;
use crate::numbers::decimal;
use crate::toolchain::Toolchain;
use crate::{demo, workspace};

/// Frames of the figure.
const FRAMES: u64 = 40;
/// The core's clock, in Hz.
const CLOCK: f64 = 480e6;
const PICTURE: &str = "docs/pictures/figure14.svg";

/// The paper's Table 1: method, markers, Hz; a star where only the camera's rate is known.
const TABLE_1: [(&str, &str, &str); 10] = [
    ("Zhang et al.", ">100", "15"),
    ("GelSight *", ">100", "30"),
    ("Viko", ">100", "40"),
    ("Sferrazza et al. (2019)", ">100", "50"),
    ("Sferrazza et al. (2020)", ">100", "60"),
    ("Lambeta et al. *", "10–100", "60"),
    ("Yamaguchi et al.", "10–100", "63"),
    ("Sato et al.", "10–100", "67"),
    ("HiVTac (the paper, overall)", "4", "100"),
    (
        "HiVTac (the paper, processing on a laptop, 800×600)",
        "4",
        "1300",
    ),
];
/// Our rows: item, frame, and what it is.
const OURS: [(&str, &str, &str); 2] = [
    ("frame full", "320x240", "every pixel of 320×240"),
    ("frame full", "800x600", "every pixel of 800×600"),
];

/// Frequencies at one time.
struct Point {
    seconds: f64,
    hertz: f64,
}

/// Runs the rig and gives the device's times of its samples, in µs.
///
/// # Errors
/// When the rig or the host tool fail, or too few samples come.
pub fn sample_times(toolchain: &Toolchain) -> Result<Vec<u64>> {
    let lines = demo::json_lines(toolchain, FRAMES)?;
    let time = |line: &str| -> Result<u64> {
        let sample: serde_json::Value = serde_json::from_str(line)?;
        sample["time_us"]
            .as_u64()
            .context("a sample without its time")
    };
    let times: Vec<u64> = lines
        .lines()
        .map(|line| time(line).with_context(|| format!("reading `{line}`")))
        .collect::<Result<_>>()?;
    ensure!(times.len() > 2, "the rig gave {} samples", times.len());
    Ok(times)
}

/// Draws the figure, and writes it and the table into the documentation.
///
/// # Errors
/// When LLVM is missing, or something cannot be written.
pub fn write(times_us: &[u64], frames: &[Measured], items: &[Item]) -> Result<()> {
    let overall = overall(times_us);
    let processing = processing(times_us, frames)?;
    let file = workspace::folder(PICTURE);
    fs::write(&file, figure(&overall, &processing))
        .with_context(|| format!("writing {}", file.display()))?;
    let table = table(mean(&overall), items)?;
    println!("{table}");
    document::write("paper", &table)
}

/// One over the time from sample to sample.
fn overall(times_us: &[u64]) -> Vec<Point> {
    let pairs = times_us.windows(2);
    let point = |pair: &[u64]| Point {
        seconds: pair[1] as f64 * 1e-6,
        hertz: 1e6 / (pair[1].saturating_sub(pair[0]).max(1)) as f64,
    };
    pairs.map(point).collect()
}

fn processing(times_us: &[u64], frames: &[Measured]) -> Result<Vec<Point>> {
    let points = times_us.iter().zip(frames).map(|(time, frame)| {
        let cycles = frame.total().cycles;
        Ok(Point {
            seconds: *time as f64 * 1e-6,
            hertz: CLOCK / cycles.context("modelled cycles need LLVM")?,
        })
    });
    points.collect()
}

fn mean(points: &[Point]) -> f64 {
    points.iter().map(|point| point.hertz).sum::<f64>() / points.len().max(1) as f64
}

fn table(overall: f64, items: &[Item]) -> Result<String> {
    let mut text = "| method | markers | Hz |\n|---|---|---:|\n".to_owned();
    for (method, markers, rate) in TABLE_1 {
        let _ = writeln!(text, "| {method} | {markers} | {rate} |");
    }
    let rate = decimal(overall.round());
    let _ = writeln!(
        text,
        "| this sensor, overall: 320×240, simulated in the rig, at its camera's rate | 4 | {rate} |"
    );
    for (name, frame, what) in OURS {
        let item = items
            .iter()
            .find(|item| item.item == name && item.frame == frame);
        let cycles = item.and_then(|item| item.modelled_cycles);
        let cycles = cycles.with_context(|| format!("{name}, {frame} has no modelled cycles"))?;
        let rate = decimal((CLOCK / cycles).round());
        let _ = writeln!(
            text,
            "| this sensor, processing on its 480 MHz Cortex-M7: {what}, modelled | 4 | {rate} |"
        );
    }
    Ok(text)
}

/// Frequency over time, on a logarithmic scale from 10 Hz to 10 kHz.
fn figure(overall: &[Point], processing: &[Point]) -> String {
    let all = || overall.iter().chain(processing);
    let begin = all()
        .map(|point| point.seconds)
        .fold(f64::INFINITY, f64::min);
    let end = all()
        .map(|point| point.seconds)
        .fold(begin + 1e-3, f64::max);
    let x = |seconds: f64| 60.0 + 520.0 * (seconds - begin) / (end - begin);
    let line = |points: &[Point], color: &str| {
        let points = points
            .iter()
            .map(|point| format!("{:.1},{:.1} ", x(point.seconds), y(point.hertz)));
        let points: String = points.collect();
        format!(
            "<polyline fill=\"none\" stroke=\"{color}\" stroke-width=\"2\" points=\"{}\"/>\n",
            points.trim_end()
        )
    };
    let mut text = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 620 340\" \
                    font-family=\"sans-serif\" font-size=\"12\">\n\
                    <rect width=\"620\" height=\"340\" fill=\"white\"/>\n"
        .to_owned();
    for hertz in [10.0, 100.0, 1_000.0, 10_000.0] {
        let (at, label) = (y(hertz), decimal(hertz));
        let _ = writeln!(
            text,
            "<path d=\"M60 {at:.1}H580\" stroke=\"#ccc\"/><text x=\"54\" y=\"{:.1}\" \
             text-anchor=\"end\">{label}</text>",
            at + 4.0
        );
    }
    text += &line(overall, "#1f77b4");
    text += &line(processing, "#ff7f0e");
    let label = |text: &str, at: f64, color: &str| {
        format!("<text x=\"70\" y=\"{at:.1}\" fill=\"{color}\">{text}</text>\n")
    };
    text += &label(
        "processing, from modelled cycles at 480 MHz",
        y(mean(processing)) - 8.0,
        "#ff7f0e",
    );
    text += &label(
        "overall, from the simulated device\u{2019}s clock in the rig",
        y(mean(overall)) - 8.0,
        "#1f77b4",
    );
    let _ = write!(
        text,
        "<text x=\"60\" y=\"330\">{begin:.2} s</text><text x=\"580\" y=\"330\" \
         text-anchor=\"end\">{end:.2} s, device time</text>\n\
                          <text x=\"16\" y=\"170\" transform=\"rotate(-90 16 170)\" \
                          text-anchor=\"middle\">frequency, Hz</text>\n</svg>\n"
    );
    text
}

fn y(hertz: f64) -> f64 {
    310.0 - 95.0 * (hertz.clamp(10.0, 10_000.0).log10() - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_overall_rate_is_that_between_samples() {
        let points = overall(&[1_000_000, 1_025_000, 1_075_000]);
        let rates: Vec<f64> = points.iter().map(|point| point.hertz).collect();
        assert_eq!(rates, [40.0, 20.0]);
    }

    #[test]
    fn a_table_needs_every_item() {
        let mut items: Vec<Item> = OURS
            .iter()
            .map(|(name, frame, _)| Item {
                item: (*name).to_owned(),
                frame: (*frame).to_owned(),
                format: "rgb565".to_owned(),
                instructions: 0.0,
                modelled_cycles: Some(480_000.0),
                floor_cycles: 0.0,
            })
            .collect();
        assert!(
            table(39.0, &items)
                .unwrap()
                .ends_with("modelled | 4 | 1,000 |\n")
        );
        items[1].modelled_cycles = None;
        assert!(table(39.0, &items).is_err());
    }

    #[test]
    fn the_figure_has_both_lines() {
        let point = |seconds, hertz| Point { seconds, hertz };
        let svg = figure(&[point(0.0, 39.0), point(1.0, 39.0)], &[point(0.0, 1000.0)]);
        assert_eq!(svg.matches("<polyline").count(), 2);
        assert!(
            svg.contains("60.0,119.9") || svg.contains("60.0,120.0"),
            "{svg}"
        );
    }
}
