//! The film of `shell/` beside the same film in CalculiX, under the same presses.

mod compare;
mod deck;
mod film;
mod mesh;
mod mounted;
mod page;
mod presses;
mod program;
mod results;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use hivtac_shell::{Design, Film, markers_on, paper_camera};
use hivtac_twin::{Camera, MARKER_REST_MM};

use compare::{FilmObservation, Reading};
use deck::Deck;
use mesh::Mesh;
use page::Page;
use presses::{BASE, FAINT, PRESSES, Press, RUBBER, VARIANTS, VARIED, Variant};
use program::Program;
use results::Pressed;

pub use deck::RUBBERS_POISSON;
pub use film::CalculixFilm;
pub use mounted::MountedFilms;

/// What to compare, and where the page goes.
#[derive(Args)]
pub struct Calculix {
    /// The page to write.
    #[arg(long, default_value = "docs/results/calculix.md")]
    out: PathBuf,
    #[command(flatten)]
    solver: Solver,
    /// Films that CalculiX works on at a time.
    #[arg(long, default_value_t = 2)]
    threads: usize,
}

/// How CalculiX is run.
#[derive(Args, Clone)]
pub struct Solver {
    /// CalculiX's program.
    #[arg(long, default_value = "ccx")]
    ccx: PathBuf,
    /// How fine CalculiX's mesh is; 2: elements of half the sides.
    #[arg(long, default_value_t = 0.7)]
    fineness: f64,
    /// Keep decks and results in this folder.
    #[arg(long)]
    keep: Option<PathBuf>,
}

/// One press of one film in CalculiX.
#[derive(Clone, Copy)]
struct Job {
    press: Press,
    variant: Variant,
}

/// What CalculiX made of it.
#[derive(Clone)]
struct Solved {
    seen: FilmObservation,
    /// The film's thickness under the tip and at marker 2, mm.
    thickness_mm: [f64; 2],
    elements: [usize; 3],
    nodes: usize,
}

/// A press in the project's film and in CalculiX's two.
struct Compared {
    press: Press,
    own: FilmObservation,
    /// St Venant's law and neo-Hooke's; why not, where there is no equilibrium.
    theirs: [Result<Solved, String>; 2],
    /// What the project's film takes them for.
    readings: [Option<Reading>; 2],
}

/// Variations at one press.
struct Varied {
    press: Press,
    own: FilmObservation,
    /// The project's film on a mesh twice as fine.
    finer: FilmObservation,
    theirs: Vec<(Variant, Result<Solved, String>)>,
}

impl Calculix {
    /// Runs the study and writes its page.
    ///
    /// # Errors
    /// When CalculiX is not installed, the project's film finds no equilibrium, or the page cannot
    /// be written.
    pub fn run(self) -> Result<()> {
        let program = self.solver.program();
        let version = program.version()?;
        let study = Study {
            program,
            camera: paper_camera()?,
            fineness: self.solver.fineness,
            threads: self.threads,
        };
        let page = Page {
            version,
            compared: study.compare()?,
            varied: study.vary()?,
        };
        println!("{}", page.tables()?);
        write_page(&self.out, &page.text()?)
    }
}

fn write_page(out: &Path, text: &str) -> Result<()> {
    if let Some(folder) = out.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(out, text).with_context(|| format!("cannot write {}", out.display()))?;
    println!("wrote {}", out.display());
    Ok(())
}

impl Solver {
    /// The same; what is kept goes into a folder of this name.
    pub fn within(&self, folder: &str) -> Solver {
        Solver {
            keep: self.keep.as_ref().map(|keep| keep.join(folder)),
            ..self.clone()
        }
    }

    fn program(&self) -> Program {
        Program {
            ccx: self.ccx.clone(),
            keep: self.keep.clone(),
        }
    }
}

struct Study {
    program: Program,
    camera: Camera,
    fineness: f64,
    threads: usize,
}

impl Study {
    fn compare(&self) -> Result<Vec<Compared>> {
        let jobs = PRESSES.map(|press| [BASE, RUBBER].map(|variant| Job { press, variant }));
        let solved = self.solve_all(jobs.as_flattened());
        let mut film = Film::new(&Design::default())?;
        let pairs = PRESSES.into_iter().zip(solved.chunks(2));
        pairs
            .map(|(press, solved)| self.compared(&mut film, press, solved))
            .collect()
    }

    fn compared(
        &self,
        film: &mut Film,
        press: Press,
        solved: &[Result<Solved, String>],
    ) -> Result<Compared> {
        let theirs = [0, 1].map(|k| solved[k].clone());
        let readings = [0, 1].map(|k| {
            let seen = &theirs[k].as_ref().ok()?.seen;
            let design = Design::default();
            compare::read(&design, &self.camera, seen, press.force_n, press.place_mm).ok()
        });
        Ok(Compared {
            press,
            own: self.own(film, press)?,
            theirs,
            readings,
        })
    }

    fn vary(&self) -> Result<Vec<Varied>> {
        let presses = [FAINT]
            .into_iter()
            .chain(VARIED.map(|index| PRESSES[index]));
        let presses: Vec<Press> = presses.collect();
        let jobs: Vec<Job> = presses
            .iter()
            .flat_map(|press| {
                VARIANTS.map(|variant| Job {
                    press: *press,
                    variant,
                })
            })
            .collect();
        let solved = self.solve_all(&jobs);
        let mut film = Film::new(&Design::default())?;
        let mut finer = Film::new(&Design {
            fineness: 2.0,
            ..Design::default()
        })?;
        let pairs = presses.into_iter().zip(solved.chunks(VARIANTS.len()));
        let varied = pairs.map(|(press, solved)| {
            Ok(Varied {
                press,
                own: self.own(&mut film, press)?,
                finer: self.own(&mut finer, press)?,
                theirs: VARIANTS.into_iter().zip(solved.iter().cloned()).collect(),
            })
        });
        varied.collect()
    }

    fn own(&self, film: &mut Film, press: Press) -> Result<FilmObservation> {
        let state = compare::press(film, press.force_n, press.place_mm)?;
        Ok(compare::seen(film, &state, &self.camera))
    }

    fn solve_all(&self, jobs: &[Job]) -> Vec<Result<Solved, String>> {
        in_order(self.threads, jobs, |job| {
            timed(&job.name(), || self.solve(job))
        })
    }

    fn solve(&self, job: &Job) -> Result<Solved> {
        let Variant {
            cut, law, fineness, ..
        } = job.variant;
        let design = Design {
            tip_offset_mm: job.press.place_mm,
            ..Design::default()
        };
        let mesh = Mesh::new(&design, cut, fineness * self.fineness);
        let deck = Deck {
            design: &design,
            mesh: &mesh,
            law,
            force_n: job.press.force_n,
            sizes: &[1.0],
        };
        let results = self.program.run(&job.name(), &deck.text())?;
        let pressed = Pressed::read(&mesh, &results, 1.0)?;
        let places = [job.press.place_mm, [MARKER_REST_MM; 2]];
        Ok(Solved {
            seen: seen(&design, &pressed, &self.camera, |_| {
                design.material.thickness_mm / 2.0
            }),
            thickness_mm: places.map(|place| pressed.thickness_mm(place)),
            elements: mesh.counts(),
            nodes: mesh.nodes.len(),
        })
    }
}

/// Every job's result, in the jobs' order, several at a time.
fn in_order<J: Sync, T: Send>(threads: usize, jobs: &[J], work: impl Fn(&J) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let take = || {
        let index = next.fetch_add(1, Ordering::Relaxed);
        jobs.get(index).map(|job| (index, job))
    };
    let worker = || {
        let taken = std::iter::from_fn(take);
        taken
            .map(|(index, job)| (index, work(job)))
            .collect::<Vec<_>>()
    };
    let mut all: Vec<_> = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(worker)).collect();
        handles
            .into_iter()
            .flat_map(|handle| handle.join().unwrap_or_default())
            .collect()
    });
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, solved)| solved).collect()
}

/// What a job gives, and how long it took, told on the terminal.
fn timed<T>(name: &str, job: impl FnOnce() -> Result<T>) -> Result<T, String> {
    let begin = Instant::now();
    let solved = job().map_err(|error| format!("{error:#}"));
    let seconds = begin.elapsed().as_secs_f64();
    match &solved {
        Ok(_) => eprintln!("{name}: {seconds:.0} s"),
        Err(why) => eprintln!("{name}: {seconds:.0} s, {why}"),
    }
    solved
}

/// What is compared of CalculiX's film, whose camera side is so far below the middle surface where
/// the film is flat and mounted, mm.
fn seen(
    design: &Design,
    pressed: &Pressed<'_>,
    camera: &Camera,
    half_mm: impl Fn([f64; 2]) -> f64,
) -> FilmObservation {
    let mut tip_mm = [0.0; 3];
    for ([x, y], share) in design.tip_points() {
        let [to_x, to_y, to_z] = pressed.at([x, y, 0.0]);
        for (sum, part) in tip_mm.iter_mut().zip([to_x - x, to_y - y, to_z]) {
            *sum += share * part;
        }
    }
    let camera_side = |place| pressed.camera_side(place, half_mm(place));
    FilmObservation {
        tip_mm,
        markers: markers_on(camera_side, camera),
    }
}

impl Job {
    /// A name for a folder.
    fn name(&self) -> String {
        folder(&format!("{} {}", self.press.name, self.variant.name))
    }
}

/// A folder's name of words.
fn folder(words: &str) -> String {
    words.replace(|letter: char| !letter.is_alphanumeric(), "-")
}
