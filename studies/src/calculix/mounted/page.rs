//! The study's tables, and the page around them.

use anyhow::{Context, Result};

use super::super::compare::{FilmObservation, Reading, difference};
use super::super::page::{overall, row, short};
use super::films::MountedFilm;
use super::{Compared, Course};
use crate::page::filled;

/// The page, with `{names}` where figures go.
const TEMPLATE: &str = include_str!("page.md");

/// What was found.
pub struct Page {
    /// CalculiX's version.
    pub version: String,
    /// Every film, the first flat; why not, where there is no equilibrium.
    pub films: Vec<(MountedFilm, Result<Compared, String>)>,
}

impl Page {
    /// The whole page.
    ///
    /// # Errors
    /// When the flat film was not found.
    pub fn text(&self) -> Result<String> {
        let figures = [
            ("version", self.version.clone()),
            ("presses", self.presses(false)),
            ("stiff across", self.presses(true)),
            ("effects", self.effects()?),
            ("rests", self.rests()),
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
            self.presses(false),
            self.presses(true),
            self.effects()?,
            self.rests(),
            self.readings(),
        ];
        Ok(format!("{}\n\n{}", self.version, tables.join("\n")))
    }

    /// Films whose CalculiX's shear and thin.
    fn found(&self) -> impl Iterator<Item = (&MountedFilm, &Compared)> {
        self.films
            .iter()
            .filter(|(film, _)| !film.is_stiff_across())
            .filter_map(|(film, compared)| Some((film, compared.as_ref().ok()?)))
    }

    fn presses(&self, stiff_across: bool) -> String {
        let mut text = String::from(
            "| film | tip's way under the largest force, mm: own | CalculiX | \
             markers move, px rms | apart under each force, µm rms | px rms | one factor on \
             \\|F\\| leaves, px: largest, rms | factor |\n\
             |---|--:|--:|--:|---|---|---|--:|\n",
        );
        let films = self.films.iter();
        for (film, compared) in films.filter(|(film, _)| film.is_stiff_across() == stiff_across) {
            let name = film.name;
            let Compared {
                own,
                theirs,
                scaled,
                ..
            } = match compared {
                Ok(compared) => compared,
                Err(why) => {
                    row(
                        &mut text,
                        format_args!("{name} | | {} | | | | | ", short(why)),
                    );
                    continue;
                }
            };
            let ways = [own, theirs].map(way_mm);
            let pairs = own.presses.iter().zip(&theirs.presses);
            let apart: Vec<_> = pairs.map(|(own, their)| difference(own, their)).collect();
            let space: Vec<String> = apart
                .iter()
                .map(|one| format!("{:.0}", one.space_um[1]))
                .collect();
            let picture: Vec<String> = apart
                .iter()
                .map(|one| format!("{:.2}", one.picture_px[1]))
                .collect();
            let [largest, rms] = apart_px(&scaled.presses, &theirs.presses);
            let moved = own
                .presses
                .iter()
                .map(|press| difference(&own.rest, press).picture_px);
            row(
                &mut text,
                format_args!(
                    "{name} | {:.3} | {:.3} | {:.1} | {} | {} | {largest:.2}, {rms:.3} | {:.3}",
                    ways[0],
                    ways[1],
                    overall(moved)[1],
                    space.join(", "),
                    picture.join(", "),
                    scaled.factor
                ),
            );
        }
        text
    }

    fn effects(&self) -> Result<String> {
        let (_, flat) = self
            .found()
            .next()
            .filter(|(film, _)| film.name == self.films[0].0.name)
            .context("the flat film found no equilibrium")?;
        let mut text = String::from(
            "| film | moves markers otherwise than the flat one, px rms: own | CalculiX | apart |\n\
             |---|--:|--:|--:|\n",
        );
        for (film, compared) in self.found().skip(1) {
            let effect = |course: &Course, flat: &Course| -> Vec<FilmObservation> {
                let pairs = course.presses.iter().zip(&flat.presses);
                let since = pairs.map(|(press, flat_press)| {
                    let since = press.rebased(&course.rest, &flat.rest);
                    since.rebased(flat_press, &flat.rest)
                });
                since.collect()
            };
            let own = effect(&compared.own, &flat.own);
            let their = effect(&compared.theirs, &flat.theirs);
            let size = |effect: &[FilmObservation]| {
                let still = vec![flat.own.rest.clone(); effect.len()];
                apart_px(&still, effect)[1]
            };
            row(
                &mut text,
                format_args!(
                    "{} | {:.2} | {:.2} | {:.2}",
                    film.name,
                    size(&own),
                    size(&their),
                    apart_px(&own, &their)[1]
                ),
            );
        }
        Ok(text)
    }

    fn rests(&self) -> String {
        let mut text = String::from(
            "| film | under the tip, z, mm: own | CalculiX | marker 0, z, mm: own | CalculiX \
             | markers apart, µm: largest, rms | in the picture, px |\n\
             |---|--:|--:|--:|--:|---|---|\n",
        );
        for (film, compared) in self.found() {
            let (own, their) = (&compared.own.rest, &compared.their_rest);
            let moved = |rest: &FilmObservation| rest.tip_mm != [0.0; 3];
            if !moved(own) {
                continue;
            }
            let apart = difference(own, their);
            let ([space, space_rms], [picture, picture_rms]) = (apart.space_um, apart.picture_px);
            row(
                &mut text,
                format_args!(
                    "{} | {:.3} | {:.3} | {:.3} | {:.3} | {space:.0}, {space_rms:.0} \
                     | {picture:.2}, {picture_rms:.2}",
                    film.name,
                    own.tip_mm[2],
                    their.tip_mm[2],
                    own.markers[0].moved_mm[2],
                    their.markers[0].moved_mm[2]
                ),
            );
        }
        text
    }

    fn readings(&self) -> String {
        let mut text = String::from(
            "| film | \\|F\\| under each force, of the true one | direction off at most, ° \
             | place off at most, mm | left over at most, px rms |\n\
             |---|---|--:|--:|--:|\n",
        );
        for (film, compared) in self.found() {
            let most = |of: &dyn Fn(&Reading) -> f64| {
                let all = compared.readings.iter().map(of);
                all.fold(0.0, f64::max)
            };
            let sizes: Vec<String> = compared
                .readings
                .iter()
                .map(|reading| format!("{:.3}", reading.size))
                .collect();
            row(
                &mut text,
                format_args!(
                    "{} | {} | {:.2} | {:.3} | {:.3}",
                    film.name,
                    sizes.join(", "),
                    most(&|reading| reading.direction_deg),
                    most(&|reading| reading.place_mm),
                    most(&|reading| reading.left_px)
                ),
            );
        }
        text
    }
}

/// How far the tip goes from rest under the largest force, mm.
fn way_mm(course: &Course) -> f64 {
    let last = course.presses.last().map_or(0.0, |press| press.tip_mm[2]);
    course.rest.tip_mm[2] - last
}

/// How far markers of the same presses are apart, px: the largest and the root mean square.
fn apart_px(ones: &[FilmObservation], others: &[FilmObservation]) -> [f64; 2] {
    let pairs: Vec<_> = ones
        .iter()
        .zip(others)
        .map(|(one, other)| difference(one, other).picture_px)
        .collect();
    overall(pairs.into_iter())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_a_place_for_every_figure() {
        for name in [
            "version",
            "presses",
            "stiff across",
            "effects",
            "rests",
            "readings",
        ] {
            assert!(TEMPLATE.contains(&format!("{{{name}}}")), "{name}");
        }
    }
}
