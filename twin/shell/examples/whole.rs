//! Makes the tables of the whole film and checks them against the full solution.
//!
//! `cargo run --release -p hivtac-shell --example whole -- twin/data`

use std::error::Error;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use clap::Parser;
use hivtac_shell::ShellError;
use hivtac_shell::parallel::in_parallel;
use hivtac_shell::sweep::octant;
use hivtac_shell::whole::{self, Errors, Sampled, Samples, WholeCheck, WholeDomain, check_whole};
use hivtac_twin::film::reduced::{LARGEST_RADIUS_MM, NOMINAL_RADIUS_MM, SMALLEST_RADIUS_MM, Unit};
use hivtac_twin::film::whole::{Difference, WholeFilm};

/// Number of functions of the load.
const FUNCTIONS: u8 = 16;
/// The same for the motion by a film's own differences and another tip.
const OF_DIFFERENCES: usize = 8;
/// Distances of the tip from the middle within which the tables are checked, mm.
const REACHES_MM: [f64; 3] = [4.0, 6.0, 8.0];
/// Ranges of the tip's radius, mm.
const TIPS_MM: [[f64; 2]; 2] = [[SMALLEST_RADIUS_MM, 1.0], [1.0, LARGEST_RADIUS_MM]];
/// Number of loads of a check.
const LOADS: usize = 40;

/// Makes FOLDER/whole.bin and FOLDER/whole-differences.bin from solutions in
/// target/whole-RADIUS.bin, which it adds to where they are incomplete.
#[derive(Parser)]
struct Request {
    folder: PathBuf,
    /// Hold FOLDER/whole.bin against the full solution instead
    #[arg(long)]
    check: bool,
    #[arg(long, default_value_t = LOADS)]
    loads: usize,
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// How many functions of the load it has at most
    #[arg(long, default_value_t = FUNCTIONS, value_parser = clap::value_parser!(u8).range(1..))]
    functions: u8,
}

fn main() -> Result<(), Box<dyn Error>> {
    // The reader of the output may close it early.
    sigpipe::reset();
    Request::parse().run()
}

impl Request {
    fn run(&self) -> Result<(), Box<dyn Error>> {
        let path = self.folder.join("whole.bin");
        if self.check {
            return self.look(&path);
        }
        let nominal = sampled(NOMINAL_RADIUS_MM, WholeFilm::NODES.places_mm, self.threads)?;
        let bytes = whole::whole(&nominal, self.functions.into())?;
        write(&path, &bytes)?;
        let places_mm = Difference::Radius(0).nodes().places_mm;
        let samples = Samples {
            nominal: &nominal,
            largest: &sampled(LARGEST_RADIUS_MM, places_mm, self.threads)?,
        };
        let bytes = whole::differences(&samples, OF_DIFFERENCES)?;
        write(&self.folder.join("whole-differences.bin"), &bytes)
    }

    fn look(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        let film = WholeFilm::from_bytes(&std::fs::read(path)?)?;
        for domain in domains() {
            let WholeDomain {
                reach_mm,
                radii_mm: [from, to],
                unit,
            } = domain;
            let loads = self.loads;
            let task = format!("within {reach_mm} mm");
            let found = check_whole(&film, &domain, self.loads, self.threads, progress(&task))?;
            println!(
                "{loads} loads within ±{reach_mm} mm, tips of {from} to {to} mm, {unit:?}: the \
                 tip within {:.3} mm",
                found.worst_tip_mm
            );
            show(&found);
        }
        Ok(())
    }
}

/// Returns the loads with which the tables are checked: of the nominal film, of other tips, and of
/// a film as one builds it by hand.
fn domains() -> Vec<WholeDomain> {
    let nominal = REACHES_MM.map(WholeDomain::within);
    let tips = TIPS_MM.map(|radii_mm| WholeDomain {
        radii_mm,
        ..WholeDomain::within(REACHES_MM[1])
    });
    let by_hand = WholeDomain {
        unit: Unit {
            stiffness: 0.8,
            thickness: 1.1,
            grip: 1.5,
            posts_mm: [[0.3, -0.2], [-0.3, 0.1], [0.2, 0.3], [0.1, -0.3]],
            ..Unit::default()
        },
        ..WholeDomain::within(REACHES_MM[1])
    };
    nominal.into_iter().chain(tips).chain([by_hand]).collect()
}

fn show(found: &WholeCheck) {
    for (dots, errors) in [
        ("dots anywhere", found.anywhere),
        ("dots near the tip", found.near),
        ("the four dots", found.four),
        ("the four dots by their own tables", found.four_by_own),
    ] {
        let Errors {
            count, worst_px, ..
        } = errors;
        let rms_px = errors.rms_px();
        println!("  {dots}: {count} seen, rms {rms_px:.4} px, at most {worst_px:.3} px");
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
    std::fs::write(path, bytes)?;
    println!("{}: {} bytes", path.display(), bytes.len());
    Ok(())
}

/// Returns all solutions under a tip of a radius. They come from its file; the missing ones are
/// solved and added to the file.
fn sampled(
    radius_mm: f64,
    half_mm: &[f64],
    threads: usize,
) -> Result<Vec<Sampled>, Box<dyn Error>> {
    let path = PathBuf::from(format!("target/whole-{radius_mm}.bin"));
    let known = read(&path)?;
    let is_new = |place: &[f64; 2]| !known.iter().any(|one| one.pose.place_mm == *place);
    let places: Vec<[f64; 2]> = octant(half_mm).into_iter().filter(is_new).collect();
    let file = Mutex::new(OpenOptions::new().create(true).append(true).open(&path)?);
    let unwritten = || ShellError::Solver(format!("{}: cannot be written", path.display()));
    in_parallel(
        &whole::design(radius_mm),
        &places,
        threads,
        progress(&format!("tip of {radius_mm} mm")),
        |film, place| {
            let sampled = whole::sample_place(film, *place)?;
            let numbers = sampled.iter().flat_map(Sampled::numbers);
            let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
            let mut file = file.lock().map_err(|_| unwritten())?;
            file.write_all(&bytes).map_err(|_| unwritten())
        },
    )?;
    read(&path)
}

fn read(path: &Path) -> Result<Vec<Sampled>, Box<dyn Error>> {
    let mut bytes = Vec::new();
    if path.exists() {
        File::open(path)?.read_to_end(&mut bytes)?;
    }
    let numbers = bytes.as_chunks().0.iter();
    let numbers: Vec<f32> = numbers.map(|four| f32::from_le_bytes(*four)).collect();
    let records = numbers.chunks(whole::length()).map(Sampled::of_numbers);
    let all: Option<Vec<Sampled>> = records.collect();
    all.ok_or_else(|| format!("{}: cut off; delete it", path.display()).into())
}

/// Shows a counting line.
fn progress(task: &str) -> impl Fn(usize, usize) + Sync {
    let (begin, task) = (Instant::now(), task.to_owned());
    move |done, all| {
        let left = begin.elapsed().as_secs_f64() * (all - done) as f64 / done as f64;
        eprintln!("{task}: {done} of {all}, {left:.0} s left");
    }
}
