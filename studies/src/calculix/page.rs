//! The study's tables, and the page around them.

use std::fmt::Write;

use anyhow::{Context, Result};
use hivtac_shell::{Design, Film};

use super::compare::{Difference, FilmObservation, difference, largest_and_rms};
use super::{Compared, Solved, Varied};
use crate::page::filled;

/// The page, with `{names}` where figures go.
const TEMPLATE: &str = include_str!("page.md");
/// The laws of CalculiX's films, in the order of their results.
const LAWS: [&str; 2] = ["St Venant", "neo-Hooke"];

/// What was found.
pub struct Page {
    /// CalculiX's version.
    pub version: String,
    /// Every press.
    pub compared: Vec<Compared>,
    /// Some of them, varied.
    pub varied: Vec<Varied>,
}

impl Page {
    /// The whole page.
    ///
    /// # Errors
    /// When the film cannot be made whose size the page states.
    pub fn text(&self) -> Result<String> {
        let figures = [
            ("version", self.version.clone()),
            ("own mesh", own_mesh()?),
            ("mesh", self.mesh()?),
            ("summary", self.summary()),
            ("presses", self.presses()),
            ("markers", self.markers()),
            ("variations", self.variations()),
            ("readings", self.readings()),
        ];
        Ok(filled(TEMPLATE, &figures))
    }

    /// The tables alone, for a terminal.
    ///
    /// # Errors
    /// As [`Page::text`].
    pub fn tables(&self) -> Result<String> {
        let tables = [
            self.presses(),
            self.variations(),
            self.readings(),
            self.summary(),
        ];
        Ok(format!(
            "{}; {}\n\n{}",
            self.version,
            self.mesh()?,
            tables.join("\n")
        ))
    }

    fn mesh(&self) -> Result<String> {
        let mut solved = self
            .compared
            .iter()
            .filter_map(|one| one.theirs[0].as_ref().ok());
        let first = solved
            .next()
            .context("CalculiX found no equilibrium at all")?;
        let [across, down, layers] = first.elements;
        Ok(format!(
            "{across} × {down} × {layers} elements C3D20R, {} nodes in the middle press",
            first.nodes
        ))
    }

    fn summary(&self) -> String {
        let mut text = String::from(
            "| film in CalculiX | presses | tip's depth, µm: largest, rms | markers in space, µm \
             | in the picture, px |\n\
             |---|---|---|---|---|\n",
        );
        for (law, name) in LAWS.iter().enumerate() {
            let found: Vec<Difference> = self.differences(law).collect();
            let depth = largest_and_rms(found.iter().map(|one| one.depth_um));
            let space = overall(found.iter().map(|one| one.space_um));
            let picture = overall(found.iter().map(|one| one.picture_px));
            row(
                &mut text,
                format_args!(
                    "{name} | {} | {:.0}, {:.0} | {:.0}, {:.0} | {:.2}, {:.2}",
                    found.len(),
                    depth[0],
                    depth[1],
                    space[0],
                    space[1],
                    picture[0],
                    picture[1]
                ),
            );
        }
        text
    }

    fn differences(&self, law: usize) -> impl Iterator<Item = Difference> {
        self.compared
            .iter()
            .filter_map(move |one| Some(difference(&one.own, &one.theirs[law].as_ref().ok()?.seen)))
    }

    fn presses(&self) -> String {
        let mut text = String::from(
            "| press | F, mN | place, mm | tip's depth, mm: own | CalculiX | apart, µm \
             | markers apart, µm: largest, rms | in the picture, px \
             | thickness under the tip; at marker 2, mm |\n\
             |---|---|---|---|---|---|---|---|---|\n",
        );
        for one in &self.compared {
            let [fx, fy, fz] = one.press.force_n.map(|part| 1e3 * part);
            let [x, y] = one.press.place_mm;
            let head = format!(
                "{} | ({fx:.0}, {fy:.0}, {fz:.0}) | ({x}, {y}) | {:.3}",
                one.press.name, -one.own.tip_mm[2]
            );
            match &one.theirs[0] {
                Ok(solved) => row(
                    &mut text,
                    format_args!("{head} | {}", apart(&one.own, solved)),
                ),
                Err(why) => row(&mut text, format_args!("{head} | {} | | | | ", short(why))),
            }
        }
        text
    }

    fn markers(&self) -> String {
        let mut text = String::from(
            "| press, marker | own: x, y, z, mm | CalculiX: x, y, z, mm | apart, µm \
             | own, px | CalculiX, px | apart, px |\n\
             |---|---|---|---|---|---|---|\n",
        );
        for one in &self.compared {
            let Ok(solved) = &one.theirs[0] else { continue };
            for (id, (own, their)) in one.own.markers.iter().zip(&solved.seen.markers).enumerate() {
                let um = [0, 1, 2].map(|axis| 1e3 * (their.moved_mm[axis] - own.moved_mm[axis]));
                let px = [0, 1].map(|axis| their.seen_px[axis] - own.seen_px[axis]);
                let [um, own_mm] = [list(&um, 0), list(&own.moved_mm, 4)];
                let their_mm = list(&their.moved_mm, 4);
                let [own_px, their_px] = [own, their].map(|marker| list(&marker.seen_px, 2));
                row(
                    &mut text,
                    format_args!(
                        "{} {id} | {own_mm} | {their_mm} | {um} | {own_px} | {their_px} | {}",
                        one.press.name,
                        list(&px, 2)
                    ),
                );
            }
        }
        text
    }

    fn variations(&self) -> String {
        let mut text = String::from(
            "| press | film | tip's depth, mm | apart, µm (%) | markers apart, µm: largest, rms \
             | in the picture, px |\n\
             |---|---|---|---|---|---|\n",
        );
        for varied in &self.varied {
            let press = varied.press.name;
            let depth = -varied.own.tip_mm[2];
            let head = format_args!("{press} | own, default mesh | {depth:.5} | – | – | –");
            row(&mut text, head);
            let finer = against(&varied.own, &varied.finer);
            row(
                &mut text,
                format_args!("{press} | own, cells of half the size | {finer}"),
            );
            for (variant, solved) in &varied.theirs {
                let found = match solved {
                    Ok(solved) => against(&varied.own, &solved.seen),
                    Err(why) => format!("{} | | | ", short(why)),
                };
                row(
                    &mut text,
                    format_args!("{press} | CalculiX, {} | {found}", variant.name),
                );
            }
        }
        text
    }

    fn readings(&self) -> String {
        let mut text = String::from(
            "| press | film in CalculiX | \\|F\\|, of the true one | direction off, ° \
             | place off, mm | left over, px rms |\n\
             |---|---|---|---|---|---|\n",
        );
        for one in &self.compared {
            for (reading, law) in one.readings.iter().zip(LAWS) {
                let Some(reading) = reading else { continue };
                row(
                    &mut text,
                    format_args!(
                        "{} | {law} | {:.3} | {:.2} | {:.3} | {:.3}",
                        one.press.name,
                        reading.size,
                        reading.direction_deg,
                        reading.place_mm,
                        reading.left_px
                    ),
                );
            }
        }
        text
    }
}

fn own_mesh() -> Result<String> {
    let film = Film::new(&Design::default())?;
    Ok(format!("{} unknowns", film.unknowns()))
}

/// The rest of a press's row.
fn apart(own: &FilmObservation, solved: &Solved) -> String {
    let found = difference(own, &solved.seen);
    let ([space, space_rms], [picture, picture_rms]) = (found.space_um, found.picture_px);
    let [tip, marker] = solved.thickness_mm;
    format!(
        "{:.3} | {:+.0} | {space:.0}, {space_rms:.0} | {picture:.2}, {picture_rms:.2} \
         | {tip:.3}; {marker:.3}",
        -solved.seen.tip_mm[2], found.depth_um
    )
}

/// The rest of a variation's row.
fn against(own: &FilmObservation, other: &FilmObservation) -> String {
    let found = difference(own, other);
    let ([space, space_rms], [picture, picture_rms]) = (found.space_um, found.picture_px);
    let depth = -other.tip_mm[2];
    let part = -0.1 * found.depth_um / own.tip_mm[2];
    format!(
        "{depth:.5} | {:+.2} ({part:+.2}) | {space:.2}, {space_rms:.2} \
         | {picture:.3}, {picture_rms:.3}",
        found.depth_um
    )
}

/// The largest of several, and the root mean square of as many root mean squares.
pub fn overall(found: impl Iterator<Item = [f64; 2]> + Clone) -> [f64; 2] {
    let [largest, _] = largest_and_rms(found.clone().map(|[largest, _]| largest));
    let [_, rms] = largest_and_rms(found.map(|[_, rms]| rms));
    [largest, rms]
}

fn list(numbers: &[f64], digits: usize) -> String {
    let parts: Vec<String> = numbers
        .iter()
        .map(|part| format!("{part:.digits$}"))
        .collect();
    parts.join(", ")
}

/// Why there is no result, in a cell.
pub fn short(why: &str) -> &'static str {
    if why.contains("increment size smaller than minimum") {
        return "no equilibrium";
    }
    "CalculiX failed"
}

/// Writes a table's row.
pub fn row(text: &mut String, cells: std::fmt::Arguments<'_>) {
    // Writing to a string never fails.
    let _ = writeln!(text, "| {cells} |");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_a_place_for_every_figure() {
        let page = Page {
            version: "CalculiX 0".into(),
            compared: Vec::new(),
            varied: Vec::new(),
        };
        for name in [
            "version", "own mesh", "mesh", "summary", "presses", "markers",
        ] {
            assert!(TEMPLATE.contains(&format!("{{{name}}}")), "{name}");
        }
        assert!(page.text().is_err(), "nothing was found");
    }
}
