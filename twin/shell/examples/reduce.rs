//! Makes the reduced film's tables and checks them against the full solution.
//!
//! `cargo run --release -p hivtac-shell --example reduce -- twin/data`

use std::error::Error;
use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use clap::Parser;
use hivtac_shell::parallel::in_parallel;
use hivtac_shell::sweep::{Solved, octant, solve_place};
use hivtac_shell::{
    Check, Design, Domain, ShellError, check, paper_camera, record, tables, weight,
};
use hivtac_twin::film::reduced::{
    Kind, LARGEST_RADIUS_MM, NOMINAL_RADIUS_MM, SMALLEST_RADIUS_MM, Unit,
};

/// Makes FOLDER/film.bin from solutions in target/film-RADIUS.bin, which it adds to where they are
/// incomplete.
#[derive(Parser)]
struct Request {
    folder: PathBuf,
    /// Make FOLDER/weight.bin, what the film's own weight does, instead
    #[arg(long, conflicts_with = "check")]
    weight: bool,
    /// Hold the film that is built in against the full solution instead
    #[arg(long)]
    check: bool,
}

/// Number of loads of a check.
const LOADS: usize = 100;
/// Largest distance of the places from the middle, mm, and the tips' radii, mm. They cover the
/// whole film, the range where a sensor is calibrated, and other tips.
const DOMAINS_MM: [(f64, [f64; 2]); 4] = [
    (5.0, [NOMINAL_RADIUS_MM; 2]),
    (4.0, [NOMINAL_RADIUS_MM; 2]),
    (4.0, [SMALLEST_RADIUS_MM, 1.0]),
    (4.0, [1.0, LARGEST_RADIUS_MM]),
];

/// Forces under which weight is checked, N, their largest tilt, and the directions of gravity.
const WEIGHT_N: [[f64; 2]; 2] = [[0.002, 0.02], [0.02, 0.2]];
const WEIGHT_RATIO: f64 = 0.4;
const DOWN: [[f64; 3]; 3] = [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [0.8, 0.0, 0.6]];

fn main() -> Result<(), Box<dyn Error>> {
    // The reader of the output may close it early.
    sigpipe::reset();
    let request = Request::parse();
    match (request.weight, request.check) {
        (true, _) => weigh(&request.folder),
        (_, true) => look(),
        _ => reduce(&request.folder),
    }
}

fn reduce(folder: &Path) -> Result<(), Box<dyn Error>> {
    let nominal = sweep(NOMINAL_RADIUS_MM, Kind::Tip)?;
    let largest = sweep(LARGEST_RADIUS_MM, Kind::TipRadius)?;
    let bytes = tables(&nominal, &largest)?.to_bytes();
    let path = folder.join("film.bin");
    std::fs::write(&path, &bytes)?;
    println!(
        "{}: {} bytes; build again and hold it against --check",
        path.display(),
        bytes.len()
    );
    Ok(())
}

fn weigh(folder: &Path) -> Result<(), Box<dyn Error>> {
    let design = Design {
        gauss_points: 2,
        ..Design::default()
    };
    let bytes = weight(&design, threads()?, progress("weight"))?.to_bytes();
    let path = folder.join("weight.bin");
    std::fs::write(&path, &bytes)?;
    println!("{}: {} bytes", path.display(), bytes.len());
    Ok(())
}

/// Returns all solutions under a tip of a radius at the places of a table. They come from its file;
/// the missing ones are solved and added to the file.
fn sweep(radius_mm: f64, kind: Kind) -> Result<Vec<Solved>, Box<dyn Error>> {
    let path = PathBuf::from(format!("target/film-{radius_mm}.bin"));
    let known = read(&path)?;
    let is_new = |place: &[f64; 2]| !known.iter().any(|solved| solved.pose.place_mm == *place);
    let places: Vec<[f64; 2]> = octant(kind.axis().nodes())
        .into_iter()
        .filter(is_new)
        .collect();
    let design = Design {
        tip_radius_mm: radius_mm,
        ..Design::default()
    };
    let camera = paper_camera()?;
    let file = Mutex::new(OpenOptions::new().create(true).append(true).open(&path)?);
    let task = format!("tip of {radius_mm} mm");
    in_parallel(
        &design,
        &places,
        threads()?,
        progress(&task),
        |film, place| {
            let solved = solve_place(film, &camera, *place)?;
            let numbers = solved.iter().flat_map(record::numbers);
            let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            let written = file.lock().map(|mut file| file.write_all(&bytes));
            match written {
                Ok(Ok(())) => Ok(()),
                _ => Err(ShellError::Solver(format!(
                    "{}: cannot be written",
                    path.display()
                ))),
            }
        },
    )?;
    read(&path)
}

fn read(path: &Path) -> Result<Vec<Solved>, Box<dyn Error>> {
    let mut bytes = Vec::new();
    if path.exists() {
        File::open(path)?.read_to_end(&mut bytes)?;
    }
    let numbers = bytes
        .as_chunks()
        .0
        .iter()
        .map(|eight| f64::from_le_bytes(*eight));
    let numbers: Vec<f64> = numbers.collect();
    let records = numbers.chunks(record::length()).map(record::solved);
    let all: Option<Vec<Solved>> = records.collect();
    all.ok_or_else(|| format!("{}: cut off; delete it", path.display()).into())
}

fn look() -> Result<(), Box<dyn Error>> {
    let weightless = DOMAINS_MM.map(|(reach_mm, radii_mm)| Domain::within(reach_mm, radii_mm));
    let heavy = WEIGHT_N.iter().flat_map(|force_n| {
        DOWN.map(|down| Domain {
            force_n: *force_n,
            ratio: WEIGHT_RATIO,
            down: Some(down),
            ..Domain::within(4.0, [NOMINAL_RADIUS_MM; 2])
        })
    });
    for domain in weightless.into_iter().chain(heavy) {
        let found = check(
            &Unit::default(),
            &domain,
            LOADS,
            threads()?,
            progress("check"),
        )?;
        let Check {
            loads,
            worst_px,
            rms_px,
            worst_tip_mm,
            ..
        } = found;
        let Domain {
            force_n: [least_n, most_n],
            reach_mm,
            radii_mm: [from, to],
            down,
            ..
        } = domain;
        let weight = down.map_or("no weight".to_owned(), |down| format!("down {down:?}"));
        println!(
            "{loads} loads of {least_n} to {most_n} N within ±{reach_mm} mm, tips of {from} to \
             {to} mm, {weight}: rms {rms_px:.4} px, at most {worst_px:.3} px; the tip within \
             {worst_tip_mm:.3} mm"
        );
        if let Some(load) = found.worst_at {
            println!("  the largest at {load:?}");
        }
    }
    Ok(())
}

fn threads() -> Result<usize, std::io::Error> {
    Ok(std::thread::available_parallelism()?.get())
}

/// Shows a counting line.
fn progress(task: &str) -> impl Fn(usize, usize) + Sync {
    const WIDTH: usize = 30;
    let (begin, task) = (Instant::now(), task.to_owned());
    move |done, all| {
        let left = begin.elapsed().as_secs_f64() * (all - done) as f64 / done as f64;
        let full = "#".repeat(WIDTH * done / all);
        let end = if done == all { "\n" } else { "" };
        eprint!("\r{task} [{full:WIDTH$}] {done} of {all}, {left:.0} s left   {end}");
        // A line that cannot be shown must not stop the work.
        let _ = std::io::stderr().flush();
    }
}
