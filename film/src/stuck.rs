//! The full solutions that a scene's film under a tip that sticks is made of.

use hivtac_scene::Camera;
use hivtac_scene::film::curves::Answer;
use hivtac_scene::film::stuck::{Bend, Numbers, Shift, Solved, State, Way, odd, tangent};
use hivtac_scene::film::{MAX_OFFSET_MM, MAX_STUCK_N};

use crate::film::Response;
use crate::newton::solve_small;
use crate::parallel::in_parallel;
use crate::samples::Path;
use crate::view::{paper_camera, seen_motions};
use crate::{Contact, Design, Equilibrium, Film, FilmError};

/// Sizes: dense where a steep way's slack side buckles.
const SIZES: [f64; 22] = [
    0.05, 0.1, 0.15, 0.2, 0.225, 0.25, 0.275, 0.2875, 0.3, 0.3125, 0.325, 0.35, 0.4, 0.45, 0.5,
    0.55, 0.625, 0.7, 0.775, 0.85, 0.925, 1.0,
];
/// Steepnesses; the first is half a step, for its mirror image is as far on the other side.
const STEEPNESSES: [f64; 11] = [
    0.07, 0.21, 0.35, 0.47, 0.57, 0.65, 0.725, 0.8, 0.87, 0.935, 1.0,
];
const TURNS_DEG: [f64; 6] = [0.0, 9.0, 18.0, 27.0, 36.0, 45.0];

/// Where the rest of the answer to offsets is taken.
const BEND_SIZES: [f64; 7] = [0.2, 0.3, 0.4, 0.55, 0.7, 0.85, 1.0];
const BEND_STEEPNESSES: [f64; 5] = [0.15, 0.45, 0.65, 0.82, 1.0];
const BEND_TURNS_DEG: [f64; 3] = [0.0, 22.5, 45.0];

/// A ray of ways: every size at one steepness and turn.
struct Ray {
    steepness: f64,
    turn_deg: f64,
    bends: bool,
}

/// What was solved along a ray.
struct Found {
    states: Vec<(Way, State)>,
    bends: Vec<(Way, Bend)>,
}

/// Solves the grids of ways of a film on `threads` threads; `progress` is told (rays done, rays) now and then.
///
/// # Errors
/// When the film cannot be made or an equilibrium is not found.
pub fn solve_stuck(
    design: &Design,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Solved, FilmError> {
    let rays = |steepnesses: &'static [f64], turns: &'static [f64], bends: bool| {
        steepnesses.iter().flat_map(move |steepness| {
            turns.iter().map(move |turn_deg| Ray {
                steepness: *steepness,
                turn_deg: *turn_deg,
                bends,
            })
        })
    };
    let of_states = rays(&STEEPNESSES, &TURNS_DEG, false);
    let rays: Vec<Ray> = of_states
        .chain(rays(&BEND_STEEPNESSES, &BEND_TURNS_DEG, true))
        .collect();
    let found = in_parallel(design, &rays, threads, progress, |film, ray| {
        ray.solve(film)
    })?;
    let mut solved = Solved::default();
    for ray in found {
        solved.states.extend(ray.states);
        solved.bends.extend(ray.bends);
    }
    // Within a size they stay in the order of the rays.
    solved
        .states
        .sort_by(|(a, _), (b, _)| a.size.total_cmp(&b.size));
    solved
        .bends
        .sort_by(|(a, _), (b, _)| a.size.total_cmp(&b.size));
    Ok(solved)
}

impl Ray {
    fn solve(&self, film: &mut Film) -> Result<Found, FilmError> {
        let mut found = Found {
            states: Vec::new(),
            bends: Vec::new(),
        };
        let camera = paper_camera()?;
        film.move_tip([0.0; 2])?;
        let mut path = Path::from_rest(film);
        let sizes: &[f64] = if self.bends { &BEND_SIZES } else { &SIZES };
        for &size in sizes {
            let way = Way {
                size,
                steepness: self.steepness,
                turn_deg: self.turn_deg,
            };
            let state = path.go(film, contact(&way), size)?;
            if self.bends {
                found.bends.push((way, bend(film, &camera, &way, &state)?));
            } else {
                found
                    .states
                    .push((way, solution(film, &camera, &way, &state)?));
            }
        }
        Ok(found)
    }
}

fn tangents(way: &Way) -> [f64; 2] {
    let (sin, cos) = way.turn_deg.to_radians().sin_cos();
    [cos, sin].map(|part| tangent(way.size, way.steepness) * part)
}

fn contact(way: &Way) -> Contact {
    let [x, y] = tangents(way);
    Contact::Stick {
        direction: [x, y, -1.0],
        force_n: MAX_STUCK_N * way.size.powi(3),
        slid_mm: [0.0; 2],
    }
}

/// A state and its first derivatives by the tip's offset.
fn solution(
    film: &Film,
    camera: &Camera,
    way: &Way,
    state: &Equilibrium,
) -> Result<State, FilmError> {
    let responses = film.responses(state)?;
    let changes = changes_by_offset(tangents(way), &responses)?;
    let by_offset = changes.map(|change| {
        let response = Response::to_all(&responses, change);
        let step = 1e-4 / response.size();
        let [back, forth] = [-step, step].map(|step| {
            let there = film.beside(state, &response, step);
            seen_motions(film, &there, camera).map(|disc| disc.moved_mm)
        });
        let slope = |k: usize, c: usize| (forth[k][c] - back[k][c]) / (2.0 * step);
        Shift {
            tip: [change[0], change[1], response.tip_mm[2]],
            moved_mm: std::array::from_fn(|k| std::array::from_fn(|c| slope(k, c))),
        }
    });
    Ok(State {
        answer: answer_of(film, camera, state),
        by_offset,
    })
}

/// For each mm of offset along x and y: the force along x, y and z (N) that keeps the tip on its way and the gauge at
/// its force, and the offset (mm).
fn changes_by_offset(
    tangents: [f64; 2],
    responses: &[Response; 5],
) -> Result<[[f64; 5]; 2], FilmError> {
    // What leaves the way for each unit of force along x, y and z, or of offset along x and y.
    let aside = |k: usize, c: usize| responses[k].tip_mm[c] + tangents[c] * responses[k].tip_mm[2];
    let matrix = vec![
        vec![aside(0, 0), aside(1, 0), aside(2, 0)],
        vec![aside(0, 1), aside(1, 1), aside(2, 1)],
        vec![tangents[0], tangents[1], -1.0],
    ];
    let mut changes = [[0.0; 5]; 2];
    for (k, change) in changes.iter_mut().enumerate() {
        let side = vec![-aside(3 + k, 0), -aside(3 + k, 1), 0.0];
        let force = solve_small(matrix.clone(), side)
            .ok_or_else(|| FilmError::Solver("a way that no force changes".into()))?;
        change[..3].copy_from_slice(&force);
        change[3 + k] = 1.0;
    }
    Ok(changes)
}

/// What first derivatives by the tip's offset leave at the largest offset, eight ways round: as coefficients of a [`Bend`].
fn bend(
    film: &mut Film,
    camera: &Camera,
    way: &Way,
    state: &Equilibrium,
) -> Result<Bend, FilmError> {
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    let State { answer, by_offset } = solution(film, camera, way, state)?;
    let here = numbers(&answer);
    let slopes = by_offset.map(|shift| shift.numbers().map(|part| MAX_OFFSET_MM * part));
    // What is even and what is odd in an offset.
    let mut both = |x: f64, y: f64| -> Result<[Numbers; 2], FilmError> {
        let offset_mm = [x, y].map(|part| MAX_OFFSET_MM * part);
        film.move_tip(offset_mm)?;
        let forth = film.press(contact(way), state)?;
        film.move_tip(offset_mm.map(|part| -part))?;
        let start = Equilibrium::foretold(&[(0.0, state), (1.0, &forth)], -1.0);
        let back = film.press(contact(way), start.as_ref().unwrap_or(state))?;
        film.move_tip([0.0; 2])?;
        let [forth, back] = [forth, back].map(|state| numbers(&answer_of(film, camera, &state)));
        let even = |k: usize| (forth[k] + back[k]) / 2.0 - here[k];
        let uneven = |k: usize| (forth[k] - back[k]) / 2.0 - (x * slopes[0][k] + y * slopes[1][k]);
        Ok([std::array::from_fn(even), std::array::from_fn(uneven)])
    };
    let ([xx, xxx], [yy, yyy]) = (both(1.0, 0.0)?, both(0.0, 1.0)?);
    let ([even_p, odd_p], [even_q, odd_q]) = (both(HALF, HALF)?, both(HALF, -HALF)?);
    let of = |at: &dyn Fn(usize) -> f64| Shift::from_numbers(std::array::from_fn(at));
    // x²y and xy² on the diagonals.
    const CUBE: f64 = HALF * HALF * HALF;
    let own = odd(HALF);
    Ok([
        of(&|k| xx[k]),
        of(&|k| even_p[k] - even_q[k]),
        of(&|k| yy[k]),
        of(&|k| xxx[k]),
        of(&|k| ((odd_p[k] - odd_q[k]) / 2.0 - own * yyy[k]) / CUBE),
        of(&|k| ((odd_p[k] + odd_q[k]) / 2.0 - own * xxx[k]) / CUBE),
        of(&|k| yyy[k]),
    ])
}

fn answer_of(film: &Film, camera: &Camera, state: &Equilibrium) -> Answer {
    Answer {
        tip: [state.force_n[0], state.force_n[1], state.tip_mm[2]],
        discs: seen_motions(film, state, camera),
    }
}

/// The tip's vector and the markers' means.
fn numbers(answer: &Answer) -> Numbers {
    let moved_mm = answer.discs.map(|disc| disc.moved_mm);
    let tip = answer.tip;
    Shift { tip, moved_mm }.numbers()
}
