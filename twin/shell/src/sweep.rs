//! Full solutions for loads of many sizes, tilts and places, with their derivatives. The reduced
//! film is made from them.

use hivtac_twin::film::DiscMotion;
use hivtac_twin::film::reduced::{LARGEST_SIZE, LARGEST_TILT, Pose};
use hivtac_twin::{Camera, MARKERS, seen_motion};

use crate::path::Path;
use crate::{Change, Contact, Equilibrium, Film, Response, ShellError};

/// Sizes at which the film is solved, in parts of the largest: Chebyshev's, without 0, at which the
/// film does not move.
const SIZES: [f64; 4] = [0.146_446_609_406_726_24, 0.5, 0.853_553_390_593_273_8, 1.0];
/// Rings of tilts: radius in parts of the largest, and the angle of the first of their four tilts,
/// °.
const TILTS: [(f64, f64); 2] = [(0.6, 65.0), (1.0, 20.0)];
/// Step of finite differences of motions: the change of the largest unknown, mm.
const STEP_MM: f64 = 1e-4;

/// Motions of tip and markers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// The tip's displacement, mm.
    pub tip_mm: [f64; 3],
    /// The motion of the film around each marker.
    pub discs: [DiscMotion; 4],
}

/// A full solution in the form that the reduced film needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// Its load.
    pub pose: Pose,
    /// Its motions.
    pub moved: Moved,
    /// The derivatives of the motions by each [`Change`].
    pub answers: Vec<Moved>,
}

/// Solves the film with the tip at one place, for all sizes and tilts.
///
/// # Errors
/// If no equilibrium is found.
pub fn solve_place(
    film: &mut Film,
    camera: &Camera,
    place_mm: [f64; 2],
) -> Result<Vec<Solved>, ShellError> {
    let look = |film: &Film, pose, state: &_| look(film, camera, pose, state);
    at_all_loads(film, place_mm, look)
}

/// Solves the film with the tip at one place, at rest and for all sizes and tilts, and returns
/// `look` of each solution.
///
/// # Errors
/// If no equilibrium is found, or `look` fails.
pub(crate) fn at_all_loads<T>(
    film: &mut Film,
    place_mm: [f64; 2],
    look: impl Fn(&Film, Pose, &Equilibrium) -> Result<T, ShellError>,
) -> Result<Vec<T>, ShellError> {
    let radius_mm = film.design().tip_radius_mm;
    film.move_tip(place_mm, radius_mm)?;
    let at_rest = Pose {
        place_mm,
        ..Pose::default()
    };
    let mut solved = vec![look(film, at_rest, &film.rest())?];
    for tilt in tilts() {
        let mut path = Path::from_rest(film);
        for part in SIZES {
            let pose = Pose {
                size: part * LARGEST_SIZE,
                tilt,
                place_mm,
            };
            let state = path.go(film, Contact::Force(pose.force_n()), pose.size)?;
            solved.push(look(film, pose, &state)?);
        }
    }
    Ok(solved)
}

pub(crate) fn tilts() -> Vec<[f64; 2]> {
    let ring = |(radius, turn): (f64, f64)| {
        (0..4).map(move |k| {
            let angle = (turn + 90.0 * f64::from(k)).to_radians();
            [angle.cos(), angle.sin()].map(|part| radius * LARGEST_TILT * part)
        })
    };
    let rings = TILTS.into_iter().flat_map(ring);
    [[0.0; 2]].into_iter().chain(rings).collect()
}

fn look(
    film: &Film,
    camera: &Camera,
    pose: Pose,
    state: &Equilibrium,
) -> Result<Solved, ShellError> {
    let changes: Vec<Change> = Change::of_sweep().collect();
    let answers = film.linearize(state, &changes)?;
    let answered = changes.iter().zip(&answers);
    Ok(Solved {
        pose,
        moved: Moved {
            tip_mm: state.tip_mm,
            discs: discs(film, state, 0.0, camera),
        },
        answers: answered
            .map(|(change, answer)| answered_by(film, state, camera, *change, answer))
            .collect(),
    })
}

pub(crate) fn discs(
    film: &Film,
    state: &Equilibrium,
    thicker: f64,
    camera: &Camera,
) -> [DiscMotion; 4] {
    MARKERS.map(|disc| seen_motion(|rest| film.surface(state, rest, thicker), &disc, camera))
}

pub(crate) fn answered_by(
    film: &Film,
    state: &Equilibrium,
    camera: &Camera,
    change: Change,
    answer: &Response,
) -> Moved {
    let step = STEP_MM / answer.size().max(0.1);
    let thicker = |sign: f64| match change {
        Change::Thickness => sign * step,
        _ => 0.0,
    };
    let [back, forth] = [-1.0, 1.0].map(|sign| {
        let there = film.beside(state, answer, sign * step);
        discs(film, &there, thicker(sign), camera)
    });
    let slope = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|c| (b[c] - a[c]) / (2.0 * step))
    };
    Moved {
        tip_mm: answer.tip_mm,
        discs: std::array::from_fn(|k| DiscMotion {
            moved_mm: slope(back[k].moved_mm, forth[k].moved_mm),
            along_x: slope(back[k].along_x, forth[k].along_x),
            along_y: slope(back[k].along_y, forth[k].along_y),
        }),
    }
}

/// Returns places of the tip, 0 ≤ y ≤ x of `knots_mm`, whose mirror images cover a whole grid.
/// `knots_mm` begin at 0.
pub fn octant(knots_mm: &[f64]) -> Vec<[f64; 2]> {
    let below = |(i, &x): (usize, &f64)| {
        let ys = knots_mm[..=i].iter();
        ys.map(move |&y| [x, y]).collect::<Vec<_>>()
    };
    knots_mm.iter().enumerate().flat_map(below).collect()
}
