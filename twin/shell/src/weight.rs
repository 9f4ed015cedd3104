//! The effect of the film's own weight on its markers, from full solutions with and without it.

use std::array::from_fn;

use faer::prelude::*;
use hivtac_twin::Camera;
use hivtac_twin::film::DiscMotion;
use hivtac_twin::film::reduced::{LARGEST_SIZE, Pose, Pull, Unit, Weight};

use crate::parallel::in_parallel;
use crate::path::Path;
use crate::sweep::{answered_by, discs, octant, tilts};
use crate::tables::{Known, Mirror, nearest, same, splines};
use crate::{Change, Contact, Design, Film, ShellError, paper_camera};

/// Sizes at which the film is solved, in parts of the largest: 1.5 mN to 0.25 N.
const SIZES: [f64; 6] = [0.14, 0.25, 0.375, 0.5, 0.75, 1.0];
/// Gravity towards the camera and away from it, in parts of g.
const BOTH: [f64; 2] = [-1.0, 1.0];
/// Number of directions of gravity in the plane of x and z for which the film's rest is solved:
/// along z, across it, and between.
const DIRECTIONS: usize = 24;

/// A load, and the effect of weight on the markers' discs under it.
struct Weighed {
    pose: Pose,
    /// Effect of 1 g along −z and along z.
    along_z: [[DiscMotion; 4]; 2],
    /// Effect per g along x and y.
    sideways: [[DiscMotion; 4]; 2],
}

/// Returns the table of the effect of weight on the nominal film.
///
/// # Errors
/// If no equilibrium is found.
pub fn weight(
    design: &Design,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Weight, ShellError> {
    let axis = Weight::axis();
    let inner: Vec<f64> = axis
        .nodes()
        .iter()
        .copied()
        .filter(|node| *node >= 0.0)
        .collect();
    let camera = paper_camera()?;
    let work: Vec<(usize, [f64; 2])> = octant(&inner)
        .into_iter()
        .flat_map(|place| (0..tilts().len()).map(move |tilt| (tilt, place)))
        .collect();
    let solved = in_parallel(design, &work, threads, progress, |film, (tilt, place)| {
        solve(film, &camera, *place, tilts()[*tilt])
    })?;
    let at_rest = rest(design, &camera)?;
    let solved: Vec<Weighed> = solved.into_iter().flatten().collect();
    let mut rows = Vec::new();
    for y in axis.nodes() {
        let mut line = Vec::new();
        for x in axis.nodes() {
            line.push(nearest(
                &Weight::terms(),
                &known(&solved, &at_rest, [*x, *y]),
            )?);
        }
        rows.push(line);
    }
    let coefficients = splines(&axis, rows).into_iter().flatten().flatten();
    Ok(Weight::new(at_rest, &coefficients.collect::<Vec<_>>()))
}

/// Returns the effect of weight with the tip at a place, for all sizes of a tilt.
fn solve(
    film: &mut Film,
    camera: &Camera,
    place_mm: [f64; 2],
    tilt: [f64; 2],
) -> Result<Vec<Weighed>, ShellError> {
    let mut beside = Vec::new();
    for z in BOTH {
        beside.push(film.changed(&Design {
            down: [0.0, 0.0, z],
            ..film.design().clone()
        })?);
    }
    for film in beside.iter_mut().chain([&mut *film]) {
        film.move_tip(place_mm, film.design().tip_radius_mm)?;
    }
    let mut path = Path::from_rest(film);
    let mut solved = Vec::new();
    for part in SIZES {
        let pose = Pose {
            size: part * LARGEST_SIZE,
            tilt,
            place_mm,
        };
        let contact = Contact::Force(pose.force_n());
        let state = path.go(film, contact, pose.size)?;
        let without = discs(film, &state, 0.0, camera);
        let mut along_z = [without; 2];
        for (film, slot) in beside.iter().zip(&mut along_z) {
            let with = discs(film, &film.press(contact, &state)?, 0.0, camera);
            *slot = from_fn(|k| sum(&[(1.0, with[k]), (-1.0, without[k])]));
        }
        let changes = [Change::Down(0), Change::Down(1)];
        let answers = film.linearize(&state, &changes)?;
        let of = |k: usize| answered_by(film, &state, camera, changes[k], &answers[k]).discs;
        solved.push(Weighed {
            pose,
            along_z,
            sideways: [of(0), of(1)],
        });
    }
    Ok(solved)
}

/// Returns the part of marker 2's disc motion for each function of [`Pull::at_rest`].
fn rest<const N: usize>(design: &Design, camera: &Camera) -> Result<[DiscMotion; N], ShellError> {
    let flat = Film::new(design)?;
    let without = discs(&flat, &flat.rest(), 0.0, camera);
    let (mut rows, mut sides) = (Vec::new(), Vec::new());
    for down in directions() {
        let film = flat.changed(&Design {
            down,
            ..design.clone()
        })?;
        let with = discs(&film, &film.rest(), 0.0, camera);
        for mirror in Mirror::all() {
            let k = mirror.corner();
            let moved = sum(&[(1.0, with[k]), (-1.0, without[k])]);
            let pull = Pull::new(0.0, mirror.vector(down), &Unit::default());
            rows.push(pull.at_rest());
            sides.push(numbers(&mirror.disc(&moved)));
        }
    }
    let matrix = Mat::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j]);
    let side = Mat::from_fn(sides.len(), sides[0].len(), |i, j| sides[i][j]);
    let found = matrix.col_piv_qr().solve_lstsq(side);
    Ok(from_fn(|f| {
        let at = |first: usize| from_fn(|c| found[(f, first + c)]);
        DiscMotion {
            moved_mm: at(0),
            along_x: at(3),
            along_y: at(6),
        }
    }))
}

/// Iterates over directions of gravity all around, in the plane of x and z.
fn directions() -> impl Iterator<Item = [f64; 3]> {
    (0..DIRECTIONS).map(|k| {
        let angle = k as f64 * std::f64::consts::TAU / DIRECTIONS as f64;
        [angle.sin(), 0.0, angle.cos()]
    })
}

/// Returns the part that a load adds to marker 2's motion along x and z per function of
/// [`Pull::under_load`], with the tip at a place.
fn known<const N: usize>(
    solved: &[Weighed],
    at_rest: &[DiscMotion; N],
    place_mm: [f64; 2],
) -> Vec<Known> {
    let mut all = Vec::new();
    for mirror in Mirror::all() {
        for weighed in solved {
            let pose = mirror.pose(&weighed.pose);
            if same(pose.place_mm, place_mm) {
                let values = added(weighed, &mirror, at_rest);
                all.push(Known {
                    pose,
                    values,
                    slopes: None,
                });
            }
        }
    }
    all
}

fn added<const N: usize>(
    weighed: &Weighed,
    mirror: &Mirror,
    at_rest: &[DiscMotion; N],
) -> Vec<f64> {
    let k = mirror.corner();
    let size = weighed.pose.size;
    let more = |disc: &DiscMotion, down: [f64; 3]| {
        let pull = Pull::new(size, down, &Unit::default());
        let parts = pull.at_rest().into_iter().zip(at_rest.iter().copied());
        let parts: Vec<(f64, DiscMotion)> = parts.collect();
        let own = sum(&parts);
        [0, 2].map(|c| mirror.disc(disc).moved_mm[c] - own.moved_mm[c])
    };
    let [toward, away] = [0, 1].map(|i| more(&weighed.along_z[i][k], [0.0, 0.0, BOTH[i]]));
    // Two directions of gravity separate the part in proportion to the load's growth from the part
    // with its square.
    let [d, e] = BOTH.map(|z| Pull::new(size, [0.0, 0.0, z], &Unit::default()).under_load()[0]);
    let square: [f64; 2] = from_fn(|c| (toward[c] / d - away[c] / e) / (d - e));
    let first: [f64; 2] = from_fn(|c| toward[c] / d - square[c] * d);
    let side = |axis: usize| {
        let [x, y] = [0, 1].map(|way| mirror.disc(&weighed.sideways[way][k]));
        let turned = mirror.components([x, y].map(|disc| numbers(&disc).to_vec()));
        let own = &at_rest[3 + axis];
        [0, 2].map(|c| turned[axis][c] - own.moved_mm[c])
    };
    [first, square, side(0), side(1)].concat()
}

fn sum(parts: &[(f64, DiscMotion)]) -> DiscMotion {
    let mut total = DiscMotion::default();
    for (part, disc) in parts {
        for c in 0..3 {
            total.moved_mm[c] += part * disc.moved_mm[c];
            total.along_x[c] += part * disc.along_x[c];
            total.along_y[c] += part * disc.along_y[c];
        }
    }
    total
}

fn numbers(disc: &DiscMotion) -> [f64; 9] {
    let all = [disc.moved_mm, disc.along_x, disc.along_y];
    from_fn(|k| all.as_flattened()[k])
}
