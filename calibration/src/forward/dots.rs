//! The forward model of any layout of dots: its tables come from those of the whole film, so a
//! layout needs no new finite elements.

use crate::parallel;
use anyhow::{Result, anyhow};
use hivtac_sensor::force::forward::{
    Forward, Markers, Noise, Pose as ChipPose, Stiffness, between,
};
use hivtac_sensor::force::model::{CovarianceSpec, ForwardSpec};
use hivtac_twin::Camera;
use hivtac_twin::film::reduced::{LARGEST_SIZE, NOMINAL_RADIUS_MM, Pose, Unit};
use hivtac_twin::film::{Film, Layout};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::tables::{Dot, UnitSetup, tables};
use super::{limits, rest_image};

/// Nodes of a dot's table along each axis, and the distance from the dot, mm, at which they are
/// twice as far apart as there. A tip of 0.5 mm moves a dot of 1 mm sharply when it is near.
const NODES: usize = 19;
const TWICE_MM: f64 = 0.6;
/// The most functions of a load. Nodes need the room: fewer functions of more nodes are more exact.
const FUNCTIONS: usize = 12;
/// Loads of the largest tilt weigh less than those without by this factor plus one: they are far
/// beyond the calibrated range.
const STEEP_COUNTS_LESS: f64 = 60.0;
/// Knots along the size, y and x of the tables' own error.
const KNOTS: [usize; 3] = [4, 4, 4];
/// Loads by which that error is measured, and their largest tilt along each axis, rad.
const LOADS: usize = 6_000;
const TILT: f64 = 0.2;

/// The nominal film with the dots of a layout, under a needle anywhere that it may press. Also the
/// error of its tables, root mean square over loads as steep as the film allows, focal lengths.
/// `noise_px` is that of a dot's coordinates, px of the camera.
///
/// # Errors
/// When the motion does not fit into tables.
pub fn of_layout(
    layout: Layout,
    steps: u8,
    noise_px: f64,
    camera: &Camera,
) -> Result<(ForwardSpec, f64)> {
    let film = Film::default().with_layout(layout)?;
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm: NOMINAL_RADIUS_MM,
        camera,
    };
    let (places_mm, last_mm) = (film.markers_mm(), film.most_place_mm());
    let dots = places_mm
        .iter()
        .map(|place| Dot::within(*place, NODES, last_mm, TWICE_MM));
    let dots: Vec<Dot> = dots.collect();
    let moved = |pose: &Pose, dot| setup.moved(&film, pose, dot);
    let (tables, left) = tables(&dots, moved, FUNCTIONS, STEEP_COUNTS_LESS)?;
    let [linear_n, cubic_n] = setup.stiffness_n().map(|part| part as f32);
    let mut spec = ForwardSpec {
        steps,
        limits: limits(),
        stiffness: Stiffness { linear_n, cubic_n },
        rest_image: rest_image(&places_mm, camera),
        per_px: None,
        noise: Noise {
            rest_px: Markers::defaults(places_mm.len()),
            at_rest_px: [noise_px as f32; 2],
            at_four_areas: [1.0; 2],
        },
        tables,
        own: None,
        other: None,
        weight: None,
    };
    let bytes = spec.to_bytes();
    let chip = Forward::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
    spec.own = Some(errors(&chip, &setup, &film)?);
    Ok((spec, left))
}

/// The error that a chip's tables leave in each coordinate, by size and place, as the covariance of
/// independent errors. It is that of usual loads, and of dots that a camera sees.
fn errors(chip: &Forward<'_>, setup: &UnitSetup<'_>, film: &Film) -> Result<CovarianceSpec> {
    let last_mm = film.most_place_mm();
    let left = parallel::try_map(LOADS, |number| {
        let pose = random_pose(number as u64, last_mm);
        Ok((pose, left(chip, setup, film, &pose)?))
    })?;
    let [sizes, lines, places] = KNOTS;
    let coordinates = 2 * chip.tables.dots();
    let mut sums = vec![vec![[0.0; 2]; coordinates]; sizes * lines * places];
    for (pose, left) in &left {
        let size = (pose.size / LARGEST_SIZE).sqrt();
        let [x, y] = pose.place_mm.map(|part| 0.5 + 0.5 * part / last_mm);
        for (i, of_size) in between(size as f32, sizes) {
            for (j, of_y) in between(y as f32, lines) {
                for (k, of_x) in between(x as f32, places) {
                    let weight = f64::from(of_size * of_y * of_x);
                    let knot = &mut sums[(i * lines + j) * places + k];
                    for ([sum, whole], left) in knot.iter_mut().zip(left) {
                        if let Some(left) = left {
                            *sum += weight * left * left;
                            *whole += weight;
                        }
                    }
                }
            }
        }
    }
    let factor = |knot: &Vec<[f64; 2]>| {
        let row = |(c, [sum, whole]): (usize, &[f64; 2])| {
            let mut row = vec![0.0; coordinates];
            row[c] = if *whole > 0.0 {
                (sum / whole).sqrt()
            } else {
                0.0
            };
            row
        };
        knot.iter().enumerate().map(row).collect()
    };
    Ok(CovarianceSpec {
        counts: KNOTS.map(|count| count as u8),
        end_mm: last_mm as f32,
        factors: sums.iter().map(factor).collect(),
    })
}

/// A usual load.
fn random_pose(number: u64, last_mm: f64) -> Pose {
    let mut random = ChaCha8Rng::seed_from_u64(number);
    let root: f64 = random.random();
    let mut within = |most: f64| random.random_range(-most..most);
    Pose {
        size: LARGEST_SIZE * root * root,
        tilt: [TILT; 2].map(&mut within),
        place_mm: [last_mm; 2].map(&mut within),
    }
}

/// The error of a chip's tables under a load, by coordinate, focal lengths; `None` for dots that
/// the camera does not see.
fn left(
    chip: &Forward<'_>,
    setup: &UnitSetup<'_>,
    film: &Film,
    pose: &Pose,
) -> Result<Vec<Option<f64>>> {
    let load = setup.load(pose)?;
    let at = ChipPose {
        size: pose.size as f32,
        tilt: pose.tilt.map(|part| part as f32),
        place_mm: pose.place_mm.map(|part| part as f32),
        ..ChipPose::default()
    };
    let nowhere = Markers::defaults(chip.tables.dots());
    let predicted = chip.tables.predict(&at, &chip.limits, &nowhere);
    let mut all = Vec::new();
    for dot in 0..chip.tables.dots() {
        let moved = setup.moved_by(film, &load, dot)?;
        let is_seen = setup.sees(film, &load, dot);
        all.extend(
            [0, 1].map(|i| is_seen.then(|| moved[i] - f64::from(predicted.moved[2 * dot + i]))),
        );
    }
    Ok(all)
}
