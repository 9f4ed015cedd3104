//! Solves pairs of contacts on the nominal film with the dots of `8v`, for `python/train_pairs.py`:
//! `cargo run --release -p hivtac-calibration --example pairs -- pairs.csv 3000`, half an hour of
//! two cores. A line has the forces and the places of both, and the motion of the dots and of the
//! mirrored layout's dots: by both, and the mean of single contacts.

use std::fs::File;
use std::io::Write;

use anyhow::{Context, Result};
use hivtac_calibration::forward::pairs::{Pair, PairFilm, SolvedPair, places_and_mirrored};
use rayon::prelude::*;

/// The seed of the draws.
const SEED: u64 = 1;
/// Fineness of the mesh. Pair and single contacts have the same error: their difference is within
/// 0.005 px of a fine mesh.
const FINENESS: f64 = 0.5;
/// Pairs that are solved between two writes.
const AT_ONCE: u64 = 100;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().context("name a file")?;
    let count: u64 = arguments
        .next()
        .context("give a number of pairs")?
        .parse()?;
    let layout = "8v".parse()?;
    let film = PairFilm::new(&places_and_mirrored(&layout), FINENESS)?;
    let mut file = File::create(path)?;
    for first in (0..count).step_by(AT_ONCE as usize) {
        let numbers = (first..count.min(first + AT_ONCE)).into_par_iter();
        // A pair beyond the film's reach is left out.
        let solved = numbers.filter_map(|number| film.solved(&Pair::draw(SEED, number)).ok());
        for line in solved.map(|pair| line(&pair)).collect::<Vec<_>>() {
            writeln!(file, "{line}")?;
        }
        println!("{first}");
    }
    Ok(())
}

fn line(solved: &SolvedPair) -> String {
    let SolvedPair { pair, both, mean } = solved;
    let loads = pair
        .forces_n
        .as_flattened()
        .iter()
        .chain(pair.places_mm.as_flattened());
    let images = both.as_flattened().iter().chain(mean.as_flattened());
    let all: Vec<String> = loads
        .chain(images)
        .map(|part| format!("{part:.9e}"))
        .collect();
    all.join(",")
}
