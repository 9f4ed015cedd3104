//! Films as they are mounted, in `shell/` and in CalculiX.

mod films;
mod page;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_shell::{Contact, Film};
use hivtac_twin::{Camera, Preset};

use super::compare::{self, FilmObservation, Reading, Scaled};
use super::deck::Deck;
use super::mesh::{Cut, Mesh};
use super::program::Program;
use super::results::Pressed;
use super::{Solver, folder, in_order, seen, timed, write_page};
use films::{FORCE_N, MountedFilm, PLACE_MM, SIZES, films};
use page::Page;

/// Columns and rows of the camera in which pixels are stated.
const CAMERA: (Preset, u32, u32) = (Preset::Ov7725, 320, 240);

/// What to compare, and where the page goes.
#[derive(Args)]
pub struct MountedFilms {
    /// The page to write.
    #[arg(long, default_value = "docs/results/mounted-films.md")]
    out: PathBuf,
    #[command(flatten)]
    solver: Solver,
    /// Films that CalculiX works on at a time.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

/// A film at rest and pressed.
struct Course {
    rest: FilmObservation,
    /// One for each of [`SIZES`].
    presses: Vec<FilmObservation>,
}

/// A film in both programs. CalculiX's is as if it had come to rest where the project's does: all
/// that is compared of presses is motion since then.
struct Compared {
    own: Course,
    theirs: Course,
    /// Where CalculiX's film comes to rest indeed.
    their_rest: FilmObservation,
    /// The project's film, its force scaled so that it comes nearest.
    scaled: Scaled,
    /// What it takes each press for.
    readings: Vec<Reading>,
}

impl MountedFilms {
    /// Runs the study and writes its page.
    ///
    /// # Errors
    /// When CalculiX is not installed or gives no film that is only cut, or the page cannot be
    /// written.
    pub fn run(self) -> Result<()> {
        let program = self.solver.program();
        let version = program.version()?;
        let (preset, columns, rows) = CAMERA;
        let study = Study {
            program,
            camera: Camera::new(preset, columns, rows)?,
            fineness: self.solver.fineness,
        };
        let films = films();
        let compared = in_order(self.threads, &films, |film| {
            timed(&film.job(), || study.compare(film))
        });
        let page = Page {
            version,
            films: films.into_iter().zip(compared).collect(),
        };
        println!("{}", page.tables()?);
        write_page(&self.out, &page.text()?)
    }
}

struct Study {
    program: Program,
    camera: Camera,
    fineness: f64,
}

impl Study {
    fn compare(&self, mounted: &MountedFilm) -> Result<Compared> {
        let film = Film::new(&mounted.design)?;
        let own = self.own(&film)?;
        let theirs = self.theirs(mounted, &film)?;
        let on_own_rest = |press: &FilmObservation| press.rebased(&theirs.rest, &own.rest);
        let presses: Vec<FilmObservation> = theirs.presses.iter().map(on_own_rest).collect();
        let scaled = compare::scale(&film, &self.camera, &forces(), &presses)?;
        let readings = forces().into_iter().zip(&presses).map(|(force_n, seen)| {
            compare::read(&mounted.design, &self.camera, seen, force_n, PLACE_MM)
        });
        Ok(Compared {
            readings: readings.collect::<Result<_>>()?,
            theirs: Course {
                rest: own.rest.clone(),
                presses,
            },
            their_rest: theirs.rest,
            own,
            scaled,
        })
    }

    fn own(&self, film: &Film) -> Result<Course> {
        let mut state = film.rest();
        let rest = compare::seen(film, &state, &self.camera);
        let mut presses = Vec::new();
        for force_n in forces() {
            state = film.press(Contact::Force(force_n), &state)?;
            presses.push(compare::seen(film, &state, &self.camera));
        }
        Ok(Course { rest, presses })
    }

    fn theirs(&self, mounted: &MountedFilm, film: &Film) -> Result<Course> {
        let design = &mounted.design;
        let mesh = Mesh::new(design, Cut::Bricks(1), self.fineness);
        let deck = Deck {
            design,
            mesh: &mesh,
            law: mounted.law,
            force_n: FORCE_N,
            sizes: &SIZES,
        };
        let results = self.program.run(&folder(&mounted.job()), &deck.text())?;
        let seen = |pressed: &Pressed<'_>| {
            seen(design, pressed, &self.camera, |place| {
                film.half_thickness_mm(place)
            })
        };
        let rest = match deck.mounted() {
            0.0 => Pressed::cut(&mesh),
            end => Pressed::read(&mesh, &results, end)?,
        };
        let presses = deck
            .ends()
            .into_iter()
            .map(|end| Ok(seen(&Pressed::read(&mesh, &results, end)?)));
        Ok(Course {
            presses: presses.collect::<Result<_>>()?,
            rest: seen(&rest),
        })
    }
}

/// Each press's force, N.
fn forces() -> [[f64; 3]; SIZES.len()] {
    SIZES.map(|size| FORCE_N.map(|part| size * part))
}
