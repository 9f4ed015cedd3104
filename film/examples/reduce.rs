//! Makes the reduced film's curves and checks them against the full solution.
//!
//! `cargo run --release -p hivtac-film --example reduce -- scene/data`

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use hivtac_film::{Check, Design, check, fit};
use hivtac_scene::Contact;
use hivtac_scene::film::curves::Curves;
use hivtac_scene::film::{Family, Film};

const USAGE: &str = "reduce FOLDER [--check] [force] [stick] [slip] [force-overhang]
--check: hold the files that are there against the full solution instead of making them";

/// One file to make.
struct Task {
    name: &'static str,
    family: Family,
    contact: Contact,
    overhang_mm: f64,
    /// Loads of its check.
    checks: usize,
}

const TASKS: [Task; 4] = [
    Task::new("force", Family::Force, Contact::Force, 0.0, 40),
    Task::new("stick", Family::Stick, Contact::Stick, 0.0, 60),
    Task::new("slip", Family::Slip, Contact::Slip { mu: 0.6 }, 0.0, 20),
    Task::new("force-overhang", Family::Force, Contact::Force, 6.0, 12),
];

impl Task {
    const fn new(
        name: &'static str,
        family: Family,
        contact: Contact,
        overhang_mm: f64,
        checks: usize,
    ) -> Task {
        Task {
            name,
            family,
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
        let curves = fit(task.family, &design, threads, progress(task.name, "curves"))?;
        std::fs::write(&path, curves.to_string())?;
    }
    let curves: Curves = std::fs::read_to_string(&path)?.parse()?;
    let text = curves.to_string();
    // As rounded in the file. A tip that slides has stuck before.
    let mut film = Film::default().with_curves(task.family, curves);
    if task.family == Family::Slip {
        let stick = std::fs::read_to_string(file(folder, "stick"))?;
        film = film.with_curves(Family::Stick, stick.parse()?);
    }
    let check = check(
        &film,
        &design,
        task.contact,
        task.checks,
        threads,
        progress(task.name, "check"),
    )?;
    let notes = format!(
        "# The reduced film, {:?}, overhang {} mm: {} curves (see scene/src/film/curves.rs).\n\
         # cargo run --release -p hivtac-film --example reduce -- scene/data {}\n\
         # Against the full solution at {} loads of the whole domain: at most {:.3} px, rms {:.3} px; the tip within \
         {:.4} mm.\n\
         # output, powers of (q_r, q_t, o_r, o_t), Chebyshev coefficients\n",
        task.family,
        task.overhang_mm,
        text.lines().count(),
        task.name,
        check.poses,
        check.worst_px,
        check.rms_px,
        check.worst_tip_mm
    );
    std::fs::write(path, format!("{notes}{text}"))?;
    print!("{notes}");
    println!("# The largest error is at {}.", place(&check));
    Ok(())
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
