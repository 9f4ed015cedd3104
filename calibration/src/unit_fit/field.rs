//! Computes how a unit's film moves its dots under any load: interpolates from finite elements at
//! few places of the tip to every place.
//!
//! The dimple under a tip moves with it. So a dot near the tip takes its motion from solutions with
//! the tip nearby, at the point that lies equally far from their tip. From solution to solution
//! this changes slowly, although the motion varies strongly within a short distance of a tip. Far
//! from the tip, the film moves alike for neighbouring tip places, and dots, which are stiffer,
//! stay where they are. There the motion of the dot itself is interpolated, with its slopes by the
//! place.

use anyhow::{Context, Result};
use hivtac_shell::{Equilibrium, Film, Response};
use hivtac_twin::film::reduced::{LARGEST_SIZE, LARGEST_TILT, Pose, Terms};

use super::problem::{At, Problem, apart_mm};
use super::view::{Rim, View};
use crate::forward::LeastSquares;
use crate::parallel;

/// Tip places along x and along y at which the film is solved: the first, their spacing, mm, and
/// their number.
const FIRST_MM: f64 = -5.0;
const APART_MM: f64 = 2.0;
const TIPS: usize = 6;
/// Distances between tip and dot, mm: up to the first the dot is in the dimple, from the second on
/// outside it.
const FAR_MM: [f64; 2] = [1.5, 3.0];
/// Solved places along each axis from which a value in the dimple is interpolated.
const SPAN: usize = 4;
/// The force of the largest size, N.
const LARGEST_N: f64 = 0.256;
/// Loads at each place: sizes in parts of the largest, without tilt; and tilted loads. A tilted
/// load has a tilt in parts of the largest, the direction of the first of four, °, and a size.
const STRAIGHT: [f64; 6] = [0.03, 0.12, 0.3, 0.52, 0.77, 1.0];
const TILTED: [(f64, f64, f64); 2] = [(0.6, 20.0, 0.4), (0.8, 65.0, 0.9)];
/// Weight of slopes relative to values.
const SLOPES_COUNT: f64 = 0.05;
/// Step by which images are differentiated along a slope, in the slope's unit.
const SLOPE_STEP: f64 = 3e-3;
/// Number of powers of size in the terms without tilt, of its first degree, and higher degrees.
const TERMS: [u8; 5] = [8, 5, 3, 1, 0];

/// A unit's film, solved under some loads at some places of the tip.
pub struct Field<'a> {
    problem: &'a Problem<'a>,
    at: &'a At,
    /// Coefficients a and b, N, of |F| = a·s + b·s³ at a size s.
    stiffness_n: [f64; 2],
    poses: Vec<Pose>,
    /// By place along y, place along x, and load.
    solved: Vec<Solved>,
    least_squares: LeastSquares,
    terms: Terms,
}

struct Solved {
    state: Equilibrium,
    /// By size, 1, and by tilt along x and y, 1/rad.
    slopes: [Response; 3],
    /// By the tip's place along x and y, per mm.
    by_place: [Response; 2],
}

/// The terms' coefficients of a dot's motion along x and y, focal lengths.
pub type Coefficients = [Vec<f64>; 2];

impl<'a> Field<'a> {
    /// Solves the film of a fitted unit.
    ///
    /// # Errors
    /// When the film finds no equilibrium.
    pub fn new(problem: &'a Problem<'a>, at: &'a At) -> Result<Self> {
        let poses = poses();
        let stiffness_n = stiffness_n(at)?;
        let terms = Terms::with_sizes(TERMS);
        let least_squares = least_squares(&terms, &poses)?;
        let mut field = Field {
            problem,
            at,
            stiffness_n,
            poses,
            solved: Vec::new(),
            least_squares,
            terms,
        };
        let solve = |k: usize| field.solve_place([k % TIPS, k / TIPS].map(tip_mm));
        let solved = parallel::try_map(TIPS * TIPS, solve)?;
        field.solved = solved.into_iter().flatten().collect();
        Ok(field)
    }

    /// Coefficients a and b, N, of |F| = a·s + b·s³ at a size s.
    pub fn stiffness_n(&self) -> [f64; 2] {
        self.stiffness_n
    }

    /// The terms that motions are sums of.
    pub fn terms(&self) -> &Terms {
        &self.terms
    }

    /// The force of a pose, N.
    pub fn force_n(&self, pose: &Pose) -> [f64; 3] {
        force_n(self.stiffness_n, pose)
    }

    fn solve_place(&self, place_mm: [f64; 2]) -> Result<Vec<Solved>> {
        let film = &self.at.film;
        let mut solved: Vec<Solved> = Vec::new();
        for (k, pose) in self.poses.iter().enumerate() {
            let near = |other: &usize| {
                let other = &self.poses[*other];
                let tilt = [0, 1].map(|i| pose.tilt[i] - other.tilt[i]);
                (pose.size - other.size).abs() + 0.3 * tilt[0].hypot(tilt[1])
            };
            let nearest = (0..k).min_by(|a, b| near(a).total_cmp(&near(b)));
            let start = nearest.map_or_else(
                || self.at.rest.clone(),
                |other| extrapolated(film, &solved[other], &self.poses[other], pose),
            );
            let state = film.press_force(place_mm, self.force_n(pose), &start)?;
            let by_load = film.responses(&state)?;
            let slopes = self
                .per_pose(pose)
                .map(|[x, y, z]| Response::to_all(&by_load, [x, y, z, 0.0, 0.0]));
            let [.., by_x, by_y] = by_load;
            solved.push(Solved {
                state,
                slopes,
                by_place: [by_x, by_y],
            });
        }
        Ok(solved)
    }

    /// Derivatives of the force by size and by tilt, N and N/rad.
    fn per_pose(&self, pose: &Pose) -> [[f64; 3]; 3] {
        const STEP: f64 = 1e-5;
        [0, 1, 2].map(|axis| {
            let [back, forth] = [-STEP, STEP].map(|step| {
                let mut there = *pose;
                match axis {
                    0 => there.size += step,
                    _ => there.tilt[axis - 1] += step,
                }
                self.force_n(&there)
            });
            [0, 1, 2].map(|i| (forth[i] - back[i]) / (2.0 * STEP))
        })
    }

    /// Coefficients of the terms of a dot's image motion, with the tip at a place of the resting
    /// film, mm.
    pub fn coefficients(&self, dot_mm: [f64; 2], place_mm: [f64; 2]) -> Coefficients {
        let At {
            film, rest, made, ..
        } = self.at;
        let view = View {
            film,
            camera: &self.problem.bench.camera,
            farther_mm: made.farther_mm,
        };
        let place_mm = film.material_point(rest, place_mm);
        let (around, between) = (Around::new(place_mm), Between::new(place_mm));
        let far = far_part(apart_mm(dot_mm, place_mm));
        let still = |point: [f64; 2]| film.displacement(rest, point);
        let at_rest = view.image_of(&Rim::of(dot_mm, still));
        let mut samples = [Vec::new(), Vec::new()];
        for load in 0..self.poses.len() {
            let displaced = |point: [f64; 2]| {
                let rested = still(point);
                let mut sum = rested;
                if far < 1.0 {
                    around.add(&mut sum, |tip, shift, part| {
                        let there = self.on_film([0, 1].map(|i| point[i] + shift[i]));
                        let moved = film.displacement(&self.solved(tip, load).state, there);
                        let rested = film.displacement(rest, there);
                        [0, 1, 2].map(|i| (1.0 - far) * part * (moved[i] - rested[i]))
                    });
                }
                if far > 0.0 {
                    between.add(&mut sum, |tip, parts| {
                        let Solved {
                            state, by_place, ..
                        } = self.solved(tip, load);
                        let moved = film.displacement(state, point);
                        let rates =
                            [0, 1].map(|way| film.surface_rate(state, &by_place[way], point));
                        [0, 1, 2].map(|i| {
                            let value = parts[0] * (moved[i] - rested[i]);
                            far * (value + parts[1] * rates[0][i] + parts[2] * rates[1][i])
                        })
                    });
                }
                sum
            };
            let rim = Rim::of(dot_mm, displaced);
            let image = view.image_of(&rim);
            for i in [0, 1] {
                samples[i].push(image[i] - at_rest[i]);
            }
            for slope in 0..3 {
                let rate = |point: [f64; 2]| {
                    let mut sum = [0.0; 3];
                    around.add(&mut sum, |tip, shift, part| {
                        let there = [0, 1].map(|i| point[i] + (1.0 - far) * shift[i]);
                        let Solved { state, slopes, .. } = self.solved(tip, load);
                        let rate = film.surface_rate(state, &slopes[slope], self.on_film(there));
                        rate.map(|component| part * component)
                    });
                    sum
                };
                let rate = Rim::of(dot_mm, rate);
                let [back, forth] =
                    [-SLOPE_STEP, SLOPE_STEP].map(|step| view.image_of(&rim.beside(&rate, step)));
                for i in [0, 1] {
                    let rate = (forth[i] - back[i]) / (2.0 * SLOPE_STEP);
                    samples[i].push(SLOPES_COUNT * rate);
                }
            }
        }
        samples.map(|samples| self.least_squares.coefficients(&samples))
    }

    fn solved(&self, [i, j]: [usize; 2], load: usize) -> &Solved {
        &self.solved[(j * TIPS + i) * self.poses.len() + load]
    }

    /// The nearest point of the film.
    fn on_film(&self, point_mm: [f64; 2]) -> [f64; 2] {
        let edge = self.at.made.design.half_edge_mm();
        point_mm.map(|part| part.clamp(-edge, edge))
    }
}

/// The force of a pose, N, on a film with |F| = a·s + b·s³: a and b, N.
pub fn force_n([a, b]: [f64; 2], pose: &Pose) -> [f64; 3] {
    let size_n = a * pose.size + b * pose.size * pose.size * pose.size;
    pose.direction().map(|part| size_n * part)
}

/// The state under `pose`, extrapolated by the slopes of the solved state under `there`.
fn extrapolated(film: &Film, from: &Solved, there: &Pose, pose: &Pose) -> Equilibrium {
    let steps = [
        pose.size - there.size,
        pose.tilt[0] - there.tilt[0],
        pose.tilt[1] - there.tilt[1],
    ];
    let slopes = from.slopes.iter().zip(steps);
    slopes.fold(from.state.clone(), |state, (slope, step)| {
        film.beside(&state, slope, step)
    })
}

/// The solved places around a place, and the weight of each.
struct Around {
    first: [usize; 2],
    parts: [[f64; SPAN]; 2],
    place_mm: [f64; 2],
}

impl Around {
    fn new(place_mm: [f64; 2]) -> Around {
        let at = place_mm.map(|part| (part - FIRST_MM) / APART_MM);
        let first =
            at.map(|at| (at.floor() as isize - 1).clamp(0, (TIPS - SPAN) as isize) as usize);
        // Lagrange's polynomials.
        let parts = [0, 1].map(|axis| {
            let x = at[axis] - first[axis] as f64;
            std::array::from_fn(|k| {
                let others = (0..SPAN).filter(|other| *other != k);
                let factor = |other: usize| (x - other as f64) / (k as f64 - other as f64);
                others.map(factor).product()
            })
        });
        Around {
            first,
            parts,
            place_mm,
        }
    }

    /// Adds a vector of each solved place. `of` takes its index along x and y, its distance from
    /// the place, mm, and its weight.
    fn add(&self, sum: &mut [f64; 3], of: impl Fn([usize; 2], [f64; 2], f64) -> [f64; 3]) {
        for (j, down) in self.parts[1].iter().enumerate() {
            for (i, right) in self.parts[0].iter().enumerate() {
                let tip = [self.first[0] + i, self.first[1] + j];
                let shift = [0, 1].map(|axis| tip_mm(tip[axis]) - self.place_mm[axis]);
                for (sum, value) in sum.iter_mut().zip(of(tip, shift, right * down)) {
                    *sum += value;
                }
            }
        }
    }
}

/// The four solved places around a place, and the weights of their values and slopes along x and y:
/// Adini's polynomials, of the third degree.
struct Between {
    corners: [([usize; 2], [f64; 3]); 4],
}

impl Between {
    fn new(place_mm: [f64; 2]) -> Between {
        let at = place_mm.map(|part| (part - FIRST_MM) / APART_MM);
        let first = at.map(|at| at.floor().clamp(0.0, (TIPS - 2) as f64));
        // From −1 to 1 between the four.
        let [x, y] = [0, 1].map(|axis| 2.0 * (at[axis] - first[axis]) - 1.0);
        let half_mm = APART_MM / 2.0;
        let corner = |k: usize| {
            let [i, j] = [k % 2, k / 2];
            let [sx, sy] = [i, j].map(|side| 2.0 * side as f64 - 1.0);
            let (u, v) = (x * sx, y * sy);
            let parts = [
                (1.0 + u) * (1.0 + v) * (2.0 + u + v - x * x - y * y),
                half_mm * sx * (1.0 + u) * (1.0 + u) * (u - 1.0) * (1.0 + v),
                half_mm * sy * (1.0 + v) * (1.0 + v) * (v - 1.0) * (1.0 + u),
            ];
            let tip = [first[0] as usize + i, first[1] as usize + j];
            (tip, parts.map(|part| part / 8.0))
        };
        Between {
            corners: [0, 1, 2, 3].map(corner),
        }
    }

    /// Adds a vector of each corner. `of` takes its index along x and y, and the weights of value
    /// and slopes.
    fn add(&self, sum: &mut [f64; 3], of: impl Fn([usize; 2], &[f64; 3]) -> [f64; 3]) {
        for (tip, parts) in &self.corners {
            for (sum, value) in sum.iter_mut().zip(of(*tip, parts)) {
                *sum += value;
            }
        }
    }
}

/// The part of a dot's motion that is interpolated at the dot itself: 0 in the dimple, 1 far from
/// the tip. The remainder is interpolated at equal distance from the tip.
fn far_part(apart_mm: f64) -> f64 {
    let [from_mm, to_mm] = FAR_MM;
    let along = ((apart_mm - from_mm) / (to_mm - from_mm)).clamp(0.0, 1.0);
    along * along * (3.0 - 2.0 * along)
}

fn tip_mm(number: usize) -> f64 {
    FIRST_MM + APART_MM * number as f64
}

fn poses() -> Vec<Pose> {
    let straight = STRAIGHT.map(|part| (part, [0.0; 2]));
    let tilted = TILTED.into_iter().flat_map(|(radius, turn, part)| {
        (0..4).map(move |k| {
            let (sin, cos) = libm::sincos((turn + 90.0 * f64::from(k)).to_radians());
            (part, [cos, sin].map(|along| radius * LARGEST_TILT * along))
        })
    });
    let pose = |(part, tilt): (f64, [f64; 2])| Pose {
        size: part * LARGEST_SIZE,
        tilt,
        place_mm: [0.0; 2],
    };
    straight.into_iter().chain(tilted).map(pose).collect()
}

/// Fits the terms' coefficients to values and slopes under the poses.
fn least_squares(terms: &Terms, poses: &[Pose]) -> Result<LeastSquares> {
    let of_pose = |pose: &Pose| {
        let [value, slopes @ ..] = terms.rows(pose);
        let weighed = |row: Vec<f64>| row.iter().map(|part| SLOPES_COUNT * part).collect();
        [value].into_iter().chain(slopes.map(weighed))
    };
    let rows: Vec<Vec<f64>> = poses.iter().flat_map(of_pose).collect();
    LeastSquares::new(&rows).context("the tables' loads")
}

/// Coefficients of force by size: sizes grow like the depth of a tip in the film's middle.
fn stiffness_n(at: &At) -> Result<[f64; 2]> {
    let mut start = at.rest.clone();
    let mut pairs = Vec::new();
    let mut deepest = 0.0;
    for part in [0.02, 0.1, 0.4, 1.0] {
        let force = part * LARGEST_N;
        start = at.film.press_force([0.0; 2], [0.0, 0.0, -force], &start)?;
        deepest = depth(at, &start);
        pairs.push((deepest, force));
    }
    let [a, b] = cubic_law(pairs);
    // Both must stay positive; either may be near 0.
    let (a, b) = (
        a.max(1e-3 * LARGEST_N / deepest),
        b.max(1e-3 * LARGEST_N / deepest.powi(3)),
    );
    let unscaled = [a * deepest, b * deepest.powi(3)];
    let of_largest = LARGEST_N / (unscaled[0] + unscaled[1]);
    let mm = deepest / LARGEST_SIZE;
    Ok([of_largest * a * mm, of_largest * b * mm.powi(3)])
}

fn depth(at: &At, state: &Equilibrium) -> f64 {
    let [here, rest] = [state, &at.rest].map(|state| at.film.displacement(state, [0.0; 2])[2]);
    rest - here
}

/// Coefficients a and b of f = a·x + b·x³ with the least relative squared errors at these pairs
/// (x, f), with f > 0.
fn cubic_law(pairs: impl IntoIterator<Item = (f64, f64)>) -> [f64; 2] {
    let [mut xx, mut xy, mut yy, mut xf, mut yf] = [0.0; 5];
    for (x, f) in pairs {
        let (x, y) = (x / f, x * x * x / f);
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        (xf, yf) = (xf + x, yf + y);
    }
    let whole = xx * yy - xy * xy;
    [(yy * xf - xy * yf) / whole, (xx * yf - xy * xf) / whole]
}
