//! Draws maps over the place of the tip as one SVG.

use std::path::Path;

use anyhow::Result;
use hivtac_twin::MARKERS;

use crate::page;

/// Places of the tip along each side of a map, and the largest coordinate, mm.
pub const PLACES: usize = 41;
const FARTHEST_MM: f64 = 5.0;
/// Largest coordinate of the calibrated places, mm.
pub const CALIBRATED_MM: f64 = 4.0;

/// Colours from good to bad (viridis, reversed).
const COLOURS: [&str; 8] = [
    "#fde725", "#9fda3a", "#4ac16d", "#1fa187", "#277f8e", "#365c8d", "#46327e", "#440154",
];
/// Sizes in px: a cell, a map's side, and the margins.
const CELL: usize = 6;
const SIDE: usize = CELL * PLACES;
const LEFT: usize = 34;
const TOP: usize = 26;
const ACROSS: usize = LEFT + SIDE + 16;
const DOWN: usize = TOP + SIDE + 54;

/// A map: values at all places, row by row.
pub struct Map {
    /// The text above it.
    pub title: String,
    /// The value where each colour ends and the next begins.
    pub levels: &'static [f64; COLOURS.len() - 1],
    pub values: Vec<f64>,
}

/// The coordinates of a place, mm, by its number, which counts row by row.
pub fn place_mm(number: usize) -> [f64; 2] {
    let at = |k: usize| FARTHEST_MM * (2.0 * k as f64 / (PLACES - 1) as f64 - 1.0);
    [at(number % PLACES), at(number / PLACES)]
}

/// Writes maps in rows of `columns`.
pub fn write(path: &Path, columns: usize, maps: &[Map]) -> Result<()> {
    let (width, height) = (columns * ACROSS, maps.len().div_ceil(columns) * DOWN);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"{width}\" height=\"{height}\" \
         fill=\"#ffffff\"/>\n"
    );
    for (number, map) in maps.iter().enumerate() {
        let (x, y) = (
            number % columns * ACROSS + LEFT,
            number / columns * DOWN + TOP,
        );
        svg += &format!("<g transform=\"translate({x} {y})\">\n{}</g>\n", map.svg());
    }
    page::write_file(path, &(svg + "</svg>\n"))
}

impl Map {
    fn svg(&self) -> String {
        let mut svg = format!("<text x=\"0\" y=\"-8\">{}</text>\n", self.title);
        let colour = |value: &f64| COLOURS[self.levels.partition_point(|level| level <= value)];
        for (row, values) in self.values.chunks(PLACES).enumerate() {
            let mut x = 0;
            for run in values.chunk_by(|a, b| colour(a) == colour(b)) {
                let (y, width) = (CELL * row, CELL * run.len());
                svg += &format!(
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{CELL}\" \
                     fill=\"{}\"/>\n",
                    colour(&run[0])
                );
                x += width;
            }
        }
        let px_per_mm = (SIDE - CELL) as f64 / (2.0 * FARTHEST_MM);
        let at = |mm: f64| (mm + FARTHEST_MM) * px_per_mm + CELL as f64 / 2.0;
        svg += &format!(
            "<rect x=\"{0:.1}\" y=\"{0:.1}\" width=\"{1:.1}\" height=\"{1:.1}\" fill=\"none\" \
             stroke=\"#000000\" stroke-dasharray=\"3 3\"/>\n",
            at(-CALIBRATED_MM),
            2.0 * CALIBRATED_MM * px_per_mm
        );
        for disc in MARKERS {
            let ([x, y], radius) = (disc.centre_mm.map(at), disc.radius_mm * px_per_mm);
            svg += &format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"none\" \
                 stroke=\"#d00000\"/>\n"
            );
        }
        let step = SIDE / COLOURS.len();
        for (k, colour) in COLOURS.iter().enumerate() {
            let (x, y) = (k * step, SIDE + 24);
            let level = self.levels.get(k).map_or(String::new(), f64::to_string);
            svg += &format!(
                "<rect x=\"{x}\" y=\"{y}\" width=\"{step}\" height=\"8\" fill=\"{colour}\"/>\n\
                 <text x=\"{}\" y=\"{}\" text-anchor=\"middle\" font-size=\"9\">{level}</text>\n",
                x + step,
                y + 18
            );
        }
        svg
    }
}
