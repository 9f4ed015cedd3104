//! Solves pairs of contacts on the nominal film with the dots of `8v`, for `python/train_pairs.py`:
//! `cargo run --release -p hivtac-calibration --example pairs -- pairs.csv 7600`, 25 minutes of one
//! core. A line has forces and places of both contacts, then motions of the dots and of the
//! mirrored layout's dots with their slopes: under both, and the mean of single contacts. With
//! `unseen` after the number, it solves other pairs, on a fine mesh.

use std::fs::File;
use std::io::Write;

use anyhow::{Context, Result, bail};
use hivtac_calibration::forward::pairs::{Pair, PairFilm, SolvedPair, places_and_mirrored};
use rayon::prelude::*;

/// The seed of the draws, and the fineness of the mesh. Pair and single contacts have the same
/// error on a coarse one.
const USUAL: (u64, f64) = (1, 0.5);
const UNSEEN: (u64, f64) = (2, 1.0);
/// Pairs that are solved between two writes.
const AT_ONCE: u64 = 100;

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().context("name a file")?;
    let count: u64 = arguments
        .next()
        .context("give a number of pairs")?
        .parse()?;
    let (seed, fineness) = match arguments.next().as_deref() {
        None => USUAL,
        Some("unseen") => UNSEEN,
        Some(other) => bail!("{other:?} is neither nothing nor `unseen`"),
    };
    let layout = "8v".parse()?;
    let film = PairFilm::new(&places_and_mirrored(&layout), fineness)?;
    let mut file = File::create(path)?;
    for first in (0..count).step_by(AT_ONCE as usize) {
        let numbers = (first..count.min(first + AT_ONCE)).into_par_iter();
        // A pair beyond the film's reach is left out.
        let solved = numbers.filter_map(|number| film.solved(&Pair::draw(seed, number)).ok());
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
    let motions = [both, mean].map(|motion| [&motion.moved].into_iter().chain(&motion.slopes));
    let images = motions.into_iter().flatten();
    let images = images.flat_map(|images| images.as_flattened());
    let all: Vec<String> = loads
        .chain(images)
        .map(|part| format!("{part:.7e}"))
        .collect();
    all.join(",")
}
