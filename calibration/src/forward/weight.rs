//! What a film's own weight does, as a model file has it.

use anyhow::Result;
use hivtac_film::reduced::{AS_A_PRESS_N, LARGEST_SIZE, LARGEST_TILT, Pose};
use hivtac_sensing::forward::weight::{AT_REST, Functions, SIZES, TERMS, UNDER_LOAD, soft, terms};
use hivtac_sensing::forward::{EQUATIONS, Gravity, Stiffness};
use hivtac_sensing::model::WeightSpec;
use rayon::prelude::*;

use super::covariances::Moved;
use super::nearest::Nearest;

/// Directions of gravity around the film, in the planes of x and z and of y and z, at which it is
/// known how it rests.
const AROUND: usize = 24;
/// Places of the tip along each axis, and tilts of its force, in parts of the largest.
const PLACES_MM: [f64; 7] = [-4.5, -3.2, -1.6, 0.0, 1.6, 3.2, 4.5];
const TILTS: [[f64; 2]; 5] = [[0.0, 0.0], [0.6, 0.0], [-0.6, 0.0], [0.0, 0.6], [0.0, -0.6]];
/// Standard uncertainty of what weight does, in parts of that: of a film that was fitted to its
/// loads, and of any other.
const UNSURE: [f32; 2] = [0.05, 0.5];

/// A film of which it can be told how its images move.
pub trait Weighed: Sync {
    /// How the images of all markers are moved under a load when gravity pulls so, from where they
    /// are when the film weighs nothing and nothing presses it, focal lengths.
    ///
    /// # Errors
    /// When no equilibrium is found.
    fn moved(&self, pose: &Pose, down: [f64; 3]) -> Result<Moved>;
}

/// What weight does on a film, of whose tables and own rest position gravity is `down`.
///
/// # Errors
/// When no equilibrium is found.
pub fn weight(film: &impl Weighed, stiffness: Stiffness, down: [f64; 3]) -> Result<WeightSpec> {
    let functions = Functions {
        stiffness,
        press_n: AS_A_PRESS_N as f32,
    };
    let at_rest = at_rest(film, &functions)?;
    let mut under_load = [[[[0.0; TERMS]; EQUATIONS]; UNDER_LOAD]; SIZES];
    for (number, of_size) in under_load.iter_mut().enumerate() {
        let root = (number + 1) as f64 / SIZES as f64;
        *of_size = added(film, &functions, &at_rest, LARGEST_SIZE * root * root)?;
    }
    Ok(WeightSpec {
        down: single(down),
        press_n: functions.press_n,
        unsure: UNSURE,
        at_rest,
        under_load,
    })
}

fn at_rest(film: &impl Weighed, functions: &Functions) -> Result<[Moved; AT_REST]> {
    let pose = Pose::default();
    let weightless = film.moved(&pose, [0.0; 3])?;
    let around = (0..AROUND).flat_map(|k| {
        let (sin, cos) = libm::sincos(k as f64 * std::f64::consts::TAU / AROUND as f64);
        [[sin, 0.0, cos], [0.0, sin, cos]]
    });
    let around: Vec<[f64; 3]> = around.collect();
    let sides: Vec<Moved> = around
        .par_iter()
        .map(|down| Ok(less(&film.moved(&pose, *down)?, &weightless)))
        .collect::<Result<_>>()?;
    let rows = around
        .iter()
        .map(|down| functions.at(0.0, single(*down)).map(f64::from));
    nearest(&rows.collect::<Vec<_>>(), |i, c| sides[i][c])
}

/// What is added under loads of a size, by function of gravity, coordinate and term.
fn added(
    film: &impl Weighed,
    functions: &Functions,
    at_rest: &[Moved; AT_REST],
    size: f64,
) -> Result<[[[f64; TERMS]; EQUATIONS]; UNDER_LOAD]> {
    let places = PLACES_MM
        .into_iter()
        .flat_map(|y| PLACES_MM.map(|x| [x, y]));
    let poses = places.flat_map(|place_mm| {
        TILTS.map(|tilt| Pose {
            size,
            tilt: tilt.map(|part| LARGEST_TILT * part),
            place_mm,
        })
    });
    let poses: Vec<Pose> = poses.collect();
    let sides: Vec<[Moved; UNDER_LOAD]> = poses
        .par_iter()
        .map(|pose| of_pose(film, functions, at_rest, pose))
        .collect::<Result<_>>()?;
    let softness = f64::from(soft(&functions.stiffness, size as f32));
    let rows = poses.iter().map(|pose| {
        let [place, tilt] = [pose.place_mm, pose.tilt].map(|pair| pair.map(|part| part as f32));
        terms(place, tilt).map(f64::from)
    });
    let rows: Vec<[f64; TERMS]> = rows.collect();
    let mut added = [[[0.0; TERMS]; EQUATIONS]; UNDER_LOAD];
    for (f, of_function) in added.iter_mut().enumerate() {
        let found = nearest(&rows, |i, c| sides[i][f][c] / softness)?;
        for (c, of_coordinate) in of_function.iter_mut().enumerate() {
            *of_coordinate = found.map(|of_term| of_term[c]);
        }
    }
    Ok(added)
}

/// The parts of each of `N` functions, whose values are rows, that sum up nearest to what is known
/// of each coordinate.
fn nearest<const N: usize>(
    rows: &[[f64; N]],
    known: impl Fn(usize, usize) -> f64,
) -> Result<[Moved; N]> {
    let through = Nearest::new(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())?;
    let of_coordinate = |c: usize| {
        let samples: Vec<f64> = (0..rows.len()).map(|i| known(i, c)).collect();
        through.coefficients(&samples)
    };
    let found: [Vec<f64>; EQUATIONS] = std::array::from_fn(of_coordinate);
    Ok(std::array::from_fn(|f| {
        std::array::from_fn(|c| found[c][f])
    }))
}

/// What a load adds to what gravity does at rest by each function of it. Gravity along z and −z
/// tells what goes with Δ and with its square, gravity along the film is in proportion.
fn of_pose(
    film: &impl Weighed,
    functions: &Functions,
    at_rest: &[Moved; AT_REST],
    pose: &Pose,
) -> Result<[Moved; UNDER_LOAD]> {
    let weightless = film.moved(pose, [0.0; 3])?;
    let more = |down: [f64; 3]| -> Result<(f64, Moved)> {
        let parts = functions.at(pose.size as f32, single(down)).map(f64::from);
        let mut more = less(&film.moved(pose, down)?, &weightless);
        for (part, column) in parts.iter().zip(at_rest) {
            for (sum, value) in more.iter_mut().zip(column) {
                *sum -= part * value;
            }
        }
        Ok((parts[0], more))
    };
    let (d, toward) = more([0.0, 0.0, -1.0])?;
    let (e, away) = more([0.0, 0.0, 1.0])?;
    let (_, along_x) = more([1.0, 0.0, 0.0])?;
    let (_, along_y) = more([0.0, 1.0, 0.0])?;
    let square: Moved = std::array::from_fn(|c| (toward[c] / d - away[c] / e) / (d - e));
    let first = std::array::from_fn(|c| toward[c] / d - square[c] * d);
    Ok([first, square, along_x, along_y])
}

fn less(a: &Moved, b: &Moved) -> Moved {
    std::array::from_fn(|c| a[c] - b[c])
}

fn single(down: [f64; 3]) -> Gravity {
    down.map(|part| part as f32)
}
