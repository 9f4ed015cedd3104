//! Maps over the place of the tip, as one SVG.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use hivtac_twin::MARKERS;

use crate::page;

/// Places of the tip along each side of a map, and the farthest, mm.
pub const PLACES: usize = 41;
pub const FARTHEST_MM: f64 = 5.0;
/// The calibrated places, mm.
pub const CALIBRATED_MM: f64 = 4.0;

/// From good to bad (viridis, turned round), and what has no value.
const COLOURS: [&str; 8] = [
    "#fde725", "#9fda3a", "#4ac16d", "#1fa187", "#277f8e", "#365c8d", "#46327e", "#440154",
];
const NONE: &str = "#d00000";
/// A cell, px.
const CELL: usize = 6;
/// A map's side, and the places around it, px.
const SIDE: usize = CELL * PLACES;
const LEFT: usize = 34;
const TOP: usize = 26;
const BELOW: usize = 54;
const BETWEEN: usize = 16;

/// A map: values at all places, row by row.
pub struct Map {
    /// What it shows.
    pub title: String,
    /// Where one colour ends and the next begins.
    pub levels: &'static [f64; COLOURS.len() - 1],
    /// `None` is drawn red.
    pub values: Vec<Option<f64>>,
}

/// The place with this number, mm: row by row.
pub fn place_mm(number: usize) -> [f64; 2] {
    let at = |k: usize| FARTHEST_MM * (2.0 * k as f64 / (PLACES - 1) as f64 - 1.0);
    [at(number % PLACES), at(number / PLACES)]
}

/// Writes maps in rows of so many.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, columns: usize, maps: &[Map]) -> Result<()> {
    let [across, down] = [LEFT + SIDE + BETWEEN, TOP + SIDE + BELOW];
    let (width, height) = (columns * across, maps.len().div_ceil(columns) * down);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"{width}\" height=\"{height}\" \
         fill=\"#ffffff\"/>\n"
    );
    for (number, map) in maps.iter().enumerate() {
        let (x, y) = (
            number % columns * across + LEFT,
            number / columns * down + TOP,
        );
        writeln!(svg, "<g transform=\"translate({x} {y})\">")?;
        map.draw(&mut svg)?;
        writeln!(svg, "</g>")?;
    }
    svg += "</svg>\n";
    page::write_file(path, &svg)
}

impl Map {
    fn draw(&self, svg: &mut String) -> Result<()> {
        writeln!(svg, "<text x=\"0\" y=\"-8\">{}</text>", self.title)?;
        for (row, values) in self.values.chunks(PLACES).enumerate() {
            for (from, to, colour) in runs(values, |value| self.colour(value)) {
                writeln!(
                    svg,
                    "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{CELL}\" fill=\"{colour}\"/>",
                    CELL * from,
                    CELL * row,
                    CELL * (to - from)
                )?;
            }
        }
        frame(svg)?;
        self.legend(svg)
    }

    fn colour(&self, value: Option<f64>) -> &'static str {
        match value {
            Some(value) => COLOURS[self.levels.partition_point(|level| *level <= value)],
            None => NONE,
        }
    }

    fn legend(&self, svg: &mut String) -> Result<()> {
        let step = SIDE / COLOURS.len();
        for (k, colour) in COLOURS.iter().enumerate() {
            let (x, y) = (k * step, SIDE + 24);
            writeln!(
                svg,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{step}\" height=\"8\" fill=\"{colour}\"/>"
            )?;
            if let Some(level) = self.levels.get(k) {
                writeln!(
                    svg,
                    "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"9\">{level}</text>",
                    x + step,
                    y + 18
                )?;
            }
        }
        Ok(())
    }
}

/// The calibrated places, the markers, and the axes' ends.
fn frame(svg: &mut String) -> Result<()> {
    let px_per_mm = (SIDE - CELL) as f64 / (2.0 * FARTHEST_MM);
    let at = |mm: f64| (mm + FARTHEST_MM) * px_per_mm + CELL as f64 / 2.0;
    writeln!(
        svg,
        "<rect x=\"{0:.1}\" y=\"{0:.1}\" width=\"{1:.1}\" height=\"{1:.1}\" fill=\"none\" \
         stroke=\"#000000\" stroke-dasharray=\"3 3\"/>",
        at(-CALIBRATED_MM),
        2.0 * CALIBRATED_MM * px_per_mm
    )?;
    for disc in MARKERS {
        let [x, y] = disc.centre_mm;
        writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.1}\" fill=\"none\" stroke=\"#d00000\"/>",
            at(x),
            at(y),
            disc.radius_mm * px_per_mm
        )?;
    }
    for mm in [-4.0, 0.0, 4.0] {
        writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\" font-size=\"9\">{mm}</text>\
             <text x=\"-4\" y=\"{:.1}\" text-anchor=\"end\" font-size=\"9\">{mm} mm</text>",
            at(mm),
            SIDE + 12,
            at(mm) + 3.0
        )?;
    }
    Ok(())
}

/// Neighbours of one colour: from, to (not with), colour.
fn runs(
    values: &[Option<f64>],
    colour: impl Fn(Option<f64>) -> &'static str,
) -> Vec<(usize, usize, &'static str)> {
    let mut runs: Vec<(usize, usize, &'static str)> = Vec::new();
    for (k, value) in values.iter().enumerate() {
        let colour = colour(*value);
        match runs.last_mut() {
            Some((_, to, last)) if *last == colour => *to = k + 1,
            _ => runs.push((k, k + 1, colour)),
        }
    }
    runs
}
