//! `cargo xtask bench --peers`: the sensing beside the paper's pipeline in OpenCV, on the same
//! frames, on this computer, in one run. Times of a computer mean little elsewhere; their ratio
//! does.

use std::fmt::Write;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use super::document;
use crate::numbers::decimal;
use crate::toolchain::cargo;
use crate::{artifacts, process, workspace};

/// Where the paper's pipeline is, and what makes a Python that has OpenCV.
const PYTHON: &str = "studies/python";
/// Lets OpenCV keep the memory that it frees: on a busy computer, getting its pages anew costs it
/// as much as the work.
const KEEP_MEMORY: [(&str, &str); 2] = [
    ("MALLOC_MMAP_THRESHOLD_", "4000000000"),
    ("MALLOC_TRIM_THRESHOLD_", "4000000000"),
];
/// Both are run in turn so often; the fastest counts.
const ROUNDS: usize = 5;
/// How far the two may see a marker apart, px.
const TOLERANCE: f64 = 0.05;

/// What one of the two says of a frame.
#[derive(Clone, Debug, Deserialize)]
struct Timed {
    name: String,
    microseconds: f64,
    /// Four of them, or `None` when none were told.
    markers: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    opencv: Option<String>,
}

/// One frame.
struct Comparison {
    ours: Timed,
    theirs: Timed,
}

/// Compares and prints; with `write_docs` the table goes into the documentation, too.
///
/// # Errors
/// When something fails other than getting OpenCV, or the two see different markers on a frame
/// without salt.
pub fn run(write_docs: bool) -> Result<()> {
    let folder = workspace::work_folder("peers")?;
    let python = match python(&folder) {
        Ok(python) => python,
        Err(error) => {
            eprintln!("the comparison with OpenCV is skipped, as it cannot be had: {error:#}");
            return Ok(());
        }
    };
    let comparisons = compare(&folder, &python)?;
    let table = table(&comparisons);
    println!("{table}");
    if write_docs {
        document::write("peers", &table)?;
    }
    comparisons.iter().try_for_each(Comparison::check)
}

/// A Python that has OpenCV, in a virtual environment of its own.
fn python(folder: &Path) -> Result<PathBuf> {
    let script = workspace::folder(PYTHON).join("opencv_environment.py");
    let mut command = Command::new("python3");
    let path = process::output(command.arg(script).arg(folder.join("venv")))?;
    Ok(PathBuf::from(path.trim()))
}

fn compare(folder: &Path, python: &Path) -> Result<Vec<Comparison>> {
    let program = host_speed()?;
    let mut best: Vec<Comparison> = Vec::new();
    for _ in 0..ROUNDS {
        let frames = process::output(Command::new(&program).arg(folder))?;
        let list = folder.join("frames.json");
        fs::write(&list, &frames).with_context(|| format!("writing {}", list.display()))?;
        let script = workspace::folder("xtask/peers/opencv.py");
        let input = File::open(&list).with_context(|| format!("reading {}", list.display()))?;
        let mut opencv = Command::new(python);
        opencv.arg(script).stdin(input).envs(KEEP_MEMORY);
        opencv.env("PYTHONPATH", workspace::folder(PYTHON));
        let theirs = process::output(&mut opencv)?;
        let round = timed(&frames)?.into_iter().zip(timed(&theirs)?);
        let round = round.map(|(ours, theirs)| Comparison { ours, theirs });
        best = if best.is_empty() {
            round.collect()
        } else {
            best.into_iter()
                .zip(round)
                .map(|(a, b)| a.fastest(b))
                .collect()
        };
    }
    Ok(best)
}

fn host_speed() -> Result<PathBuf> {
    let mut command = cargo("build", workspace::root());
    command.args([
        "--release",
        "--package",
        "hivtac-tests",
        "--bin",
        "host-speed",
    ]);
    artifacts::build(&mut command, "host-speed")
}

fn timed(lines: &str) -> Result<Vec<Timed>> {
    lines
        .lines()
        .map(|line| serde_json::from_str(line).with_context(|| format!("reading `{line}`")))
        .collect()
}

impl Comparison {
    fn fastest(self, other: Comparison) -> Comparison {
        let faster = |a: Timed, b: Timed| {
            if a.microseconds <= b.microseconds {
                a
            } else {
                b
            }
        };
        Comparison {
            ours: faster(self.ours, other.ours),
            theirs: faster(self.theirs, other.theirs),
        }
    }

    /// The farthest that one of our four markers lies from the nearest of theirs, px.
    fn distance(&self) -> Option<f64> {
        let theirs = self.theirs.markers.as_ref()?;
        let nearest = |[x, y]: [f64; 2]| {
            let distances = theirs.iter().map(|[a, b]| (a - x).hypot(b - y));
            distances.fold(f64::INFINITY, f64::min)
        };
        let ours = self.ours.markers.as_ref()?.iter();
        Some(ours.map(|marker| nearest(*marker)).fold(0.0, f64::max))
    }

    fn has_salt(&self) -> bool {
        self.ours.name.contains(',')
    }

    fn check(&self) -> Result<()> {
        let same = self
            .distance()
            .is_some_and(|distance| distance <= TOLERANCE);
        ensure!(
            self.has_salt() || same,
            "{}: the sensing and OpenCV see different markers: {:?} and {:?}",
            self.ours.name,
            self.ours.markers,
            self.theirs.markers
        );
        Ok(())
    }

    fn row(&self) -> String {
        let (ours, theirs) = (self.ours.microseconds, self.theirs.microseconds);
        let distance = match self.distance() {
            Some(distance) => format!("{distance:.3} px"),
            None => "a status instead".to_owned(),
        };
        format!(
            "| {} | {} | {} | {:.1} | {distance} |",
            self.ours.name,
            decimal(ours.round()),
            decimal(theirs.round()),
            theirs / ours
        )
    }
}

fn table(comparisons: &[Comparison]) -> String {
    let version = comparisons
        .first()
        .and_then(|first| first.theirs.opencv.clone());
    let mut text = format!(
        "| frame | the sensing, µs | OpenCV {}, µs | times as fast | markers apart \
         |\n|---|---:|---:|---:|---:|\n",
        version.unwrap_or_default()
    );
    for comparison in comparisons {
        let _ = writeln!(text, "{}", comparison.row());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timed(microseconds: f64, markers: Option<Vec<[f64; 2]>>) -> Timed {
        Timed {
            name: "320x240".to_owned(),
            microseconds,
            markers,
            opencv: None,
        }
    }

    fn comparison(moved: f64) -> Comparison {
        let four = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]];
        let mut theirs = four.to_vec();
        theirs.reverse();
        theirs[0][0] += moved;
        Comparison {
            ours: timed(20.0, Some(four.to_vec())),
            theirs: timed(200.0, Some(theirs)),
        }
    }

    #[test]
    fn markers_are_compared_whatever_their_order() {
        assert!(comparison(0.04).check().is_ok());
        assert!(comparison(0.06).check().is_err());
        assert!(comparison(0.04).row().contains("| 10.0 | 0.040 px |"));
    }

    #[test]
    fn missing_markers_are_an_error_without_salt() {
        let mut missing = comparison(0.0);
        missing.ours.markers = None;
        assert!(missing.check().is_err());
        missing.ours.name.push_str(", 5 % salt");
        assert!(missing.check().is_ok());
    }

    #[test]
    fn the_fastest_round_counts() {
        let (mut slow, mut fast) = (comparison(0.0), comparison(0.0));
        (slow.ours.microseconds, fast.theirs.microseconds) = (30.0, 100.0);
        let best = slow.fastest(fast);
        assert_eq!(
            (best.ours.microseconds, best.theirs.microseconds),
            (20.0, 100.0)
        );
    }
}
