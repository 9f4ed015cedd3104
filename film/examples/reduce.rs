//! Makes the reduced film's curves and checks them against the full solution.
//!
//! `cargo run --release -p hivtac-film --example reduce -- scene/data`

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use hivtac_film::{Check, Design, check, fit, solve_stuck};
use hivtac_scene::Contact;
use hivtac_scene::film::curves::Curves;
use hivtac_scene::film::stuck::{Solved, Stuck};
use hivtac_scene::film::{Family, Film};

const USAGE: &str = "reduce FOLDER [--check] [force] [stick] [slip] [force-overhang]
--check: hold the files that are there against the full solution instead of making them";

/// One file to make.
struct Task {
    name: &'static str,
    content: Content,
    contact: Contact,
    overhang_mm: f64,
    /// Loads of its check.
    checks: usize,
}

/// What a file holds.
#[derive(Clone, Copy, Debug)]
enum Content {
    Curves(Family),
    /// Full solutions on a grid.
    Stuck,
}

const TASKS: [Task; 4] = [
    Task::new(
        "force",
        Content::Curves(Family::Force),
        Contact::Force,
        0.0,
        40,
    ),
    Task::new("stick", Content::Stuck, Contact::Stick, 0.0, 60),
    Task::new(
        "slip",
        Content::Curves(Family::Slip),
        Contact::Slip { mu: 0.6 },
        0.0,
        20,
    ),
    Task::new(
        "force-overhang",
        Content::Curves(Family::Force),
        Contact::Force,
        6.0,
        12,
    ),
];

impl Task {
    const fn new(
        name: &'static str,
        content: Content,
        contact: Contact,
        overhang_mm: f64,
        checks: usize,
    ) -> Task {
        Task {
            name,
            content,
            contact,
            overhang_mm,
            checks,
        }
    }
}

fn main() -> ExitCode {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    match reduce(std::env::args().skip(1)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn reduce(mut words: impl Iterator<Item = String>) -> Result<(), Box<dyn std::error::Error>> {
    let folder = words.next().ok_or(USAGE)?;
    let (flags, names): (Vec<String>, Vec<String>) = words.partition(|word| word == "--check");
    let known = |name: &String| TASKS.iter().any(|task| task.name == name);
    if let Some(name) = names.iter().find(|name| !known(name)) {
        return Err(format!("{name}: unknown\n{USAGE}").into());
    }
    let begin = Instant::now();
    for task in &TASKS {
        if names.is_empty() || names.iter().any(|name| name == task.name) {
            make(task, Path::new(&folder), flags.is_empty())?;
        }
    }
    println!("{:.0} s", begin.elapsed().as_secs_f64());
    Ok(())
}

/// Makes one file, unless it is there already, and checks it.
fn make(task: &Task, folder: &Path, anew: bool) -> Result<(), Box<dyn std::error::Error>> {
    let threads = std::thread::available_parallelism()?.get();
    let design = Design {
        overhang_mm: task.overhang_mm,
        ..Design::default()
    };
    let path = file(folder, task.name);
    if anew {
        let progress = progress(task.name, "solutions");
        let text = match task.content {
            Content::Curves(family) => fit(family, &design, threads, progress)?.to_string(),
            Content::Stuck => solve_stuck(&design, threads, progress)?.to_string(),
        };
        std::fs::write(&path, text)?;
    }
    let (text, film) = load(task, folder)?;
    let check = check(
        &film,
        &design,
        task.contact,
        task.checks,
        threads,
        progress(task.name, "check"),
    )?;
    let notes = notes(task, text.lines().count(), &check);
    std::fs::write(path, format!("{notes}{text}"))?;
    print!("{notes}");
    println!("# The largest error is at {}.", place(&check));
    Ok(())
}

/// What a file holds, and the film with it: as rounded there.
fn load(task: &Task, folder: &Path) -> Result<(String, Film), Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string(file(folder, task.name))?;
    let film = Film::default();
    Ok(match task.content {
        Content::Curves(family) => {
            let curves: Curves = text.parse()?;
            let (text, film) = (curves.to_string(), film.with_curves(family, curves));
            match family {
                // A tip that slides has stuck before.
                Family::Slip => (text, film.with_stuck(stuck(&file(folder, "stick"))?)),
                Family::Force => (text, film),
            }
        }
        Content::Stuck => {
            let solved: Solved = text.parse()?;
            (solved.to_string(), film.with_stuck(Stuck::new(&solved)?))
        }
    })
}

/// The first lines of a file of so many lines.
fn notes(task: &Task, lines: usize, check: &Check) -> String {
    let what = match task.content {
        Content::Curves(family) => format!(
            "# The reduced film, {family:?}, overhang {} mm: {lines} curves (see scene/src/film/curves.rs).",
            task.overhang_mm
        ),
        Content::Stuck => format!(
            "# The film under a tip that sticks: {lines} lines (see scene/src/film/stuck/text.rs)."
        ),
    };
    let columns = match task.content {
        Content::Curves(_) => "# output, powers of (q_r, q_t, o_r, o_t), Chebyshev coefficients",
        Content::Stuck => {
            "# state: size, steepness, turn, solution and first derivatives by the offset; bend: …, the rest of the answer to offsets"
        }
    };
    format!(
        "{what}\n\
         # cargo run --release -p hivtac-film --example reduce -- scene/data {}\n\
         # Against the full solution at {} loads of the whole domain: at most {:.3} px, rms {:.3} px; the tip within \
         {:.4} mm.\n\
         {columns}\n",
        task.name, check.poses, check.worst_px, check.rms_px, check.worst_tip_mm
    )
}

/// The film under a tip that sticks, from its file.
fn stuck(path: &Path) -> Result<Stuck, Box<dyn std::error::Error>> {
    let solved: Solved = std::fs::read_to_string(path)?.parse()?;
    Ok(Stuck::new(&solved)?)
}

/// Which load the curves are farthest off at.
fn place(check: &Check) -> String {
    check.worst_at.map_or("nowhere".into(), |load| {
        let [x, y] = load.offset_mm();
        format!(
            "{:.4} N, {:.1}°, {:.1}°, offset {x:.2}, {y:.2} mm",
            load.magnitude_n(),
            load.alpha_deg(),
            load.beta_deg()
        )
    })
}

fn file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.csv"))
}

/// A line that counts.
fn progress(task: &str, what: &str) -> impl Fn(usize, usize) + Sync {
    const WIDTH: usize = 30;
    let begin = Instant::now();
    move |done, all| {
        let left = begin.elapsed().as_secs_f64() * (all - done) as f64 / done as f64;
        let full = "#".repeat(WIDTH * done / all);
        let end = if done == all { "\n" } else { "" };
        eprint!("\r{task} {what} [{full:WIDTH$}] {done} of {all}, {left:.0} s left   {end}");
        // A progress that cannot be shown is no reason to stop.
        let _ = std::io::stderr().flush();
    }
}
