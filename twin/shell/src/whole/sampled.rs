//! Full solutions sampled on a grid of places around the tip, with their derivatives.

use hivtac_twin::film::reduced::Pose;

use crate::sweep::at_all_loads;
use crate::{Change, Design, Equilibrium, Film, Response, ShellError};

/// Distances from the tip, along x and along y, at which a solution is sampled: these, their
/// negatives and all pairs, mm.
pub const HALF_GRID_MM: [f64; 15] = [
    0.0, 0.25, 0.5, 0.75, 1.05, 1.4, 1.9, 2.6, 3.6, 5.0, 7.0, 9.2, 11.6, 14.2, 17.0,
];
/// Fineness of the mesh: a dot next to the tip is within 0.03 px of twice as fine a mesh.
const FINENESS: f64 = 1.4;
/// The largest distance from the middle that a tip's disc reaches, mm.
const TIP_REACH_MM: f64 = 9.0;
/// Beyond this distance from the middle, mm, the film is continued as straight as it ends.
const EDGE_MM: f64 = 13.9;

/// A full solution and its derivatives, each as numbers: the tip's displacement, then that of the
/// camera side at each point of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// The load.
    pub pose: Pose,
    /// The displacements, mm.
    pub moved: Vec<f32>,
    /// Their derivatives by each of [`changes`].
    pub rates: Vec<Vec<f32>>,
}

/// Iterates over the changes by which solutions are differentiated, in the order of a record.
pub fn changes() -> impl Iterator<Item = Change> {
    Change::of_sweep()
        .filter(|change| !matches!(change, Change::Place(_)))
        .chain((0..3).map(Change::Down))
}

/// Returns the design that is sampled, pressed by a tip of a radius.
pub fn design(tip_radius_mm: f64) -> Design {
    Design {
        tip_radius_mm,
        tip_reach_mm: TIP_REACH_MM,
        fineness: FINENESS,
        gauss_points: 2,
        ..Design::default()
    }
}

/// Returns the nodes of the grid along x and along y, mm from the tip, in increasing order.
pub fn nodes_mm() -> Vec<f64> {
    both_sides(&HALF_GRID_MM)
}

/// Returns nodes that begin at 0, with their negatives in front.
pub fn both_sides(half: &[f64]) -> Vec<f64> {
    let below = half.iter().skip(1).rev().map(|node| -node);
    below.chain(half.iter().copied()).collect()
}

/// Solves the film with the tip at one place, for all sizes and tilts of a sweep, and samples it.
///
/// # Errors
/// If no equilibrium is found.
pub fn sample_place(film: &mut Film, place_mm: [f64; 2]) -> Result<Vec<Sampled>, ShellError> {
    at_all_loads(film, place_mm, sample)
}

fn sample(film: &Film, pose: Pose, state: &Equilibrium) -> Result<Sampled, ShellError> {
    let changes: Vec<Change> = changes().collect();
    let answers = film.linearize(state, &changes)?;
    let points = points(pose.place_mm);
    let moved = |point| film.displacement(state, point);
    let rates = answers
        .iter()
        .map(|answer| rate(film, state, answer, &points));
    Ok(Sampled {
        pose,
        moved: numbers(
            state.tip_mm,
            points.iter().map(|point| continued(moved, *point)),
        ),
        rates: rates.collect(),
    })
}

fn rate(film: &Film, state: &Equilibrium, answer: &Response, points: &[[f64; 2]]) -> Vec<f32> {
    let rate = |point| film.surface_rate(state, answer, point);
    numbers(
        answer.tip_mm,
        points.iter().map(|point| continued(rate, *point)),
    )
}

fn numbers(tip_mm: [f64; 3], points: impl Iterator<Item = [f64; 3]>) -> Vec<f32> {
    let all = std::iter::once(tip_mm).chain(points);
    all.flatten().map(|part| part as f32).collect()
}

/// Returns the points of the grid around a tip, mm: along y and, within, along x.
fn points([x, y]: [f64; 2]) -> Vec<[f64; 2]> {
    let nodes = nodes_mm();
    let row = |down: &f64| {
        let at = y + down;
        nodes
            .iter()
            .map(move |along| [x + along, at])
            .collect::<Vec<_>>()
    };
    nodes.iter().flat_map(row).collect()
}

/// Returns a quantity at a point of the film, or beyond its edge, where it is continued straight.
fn continued(of: impl Fn([f64; 2]) -> [f64; 3], point: [f64; 2]) -> [f64; 3] {
    const STEP_MM: f64 = 1e-2;
    let edge = point.map(|part| part.clamp(-EDGE_MM, EDGE_MM));
    let mut here = of(edge);
    for way in 0..2 {
        let beyond = point[way] - edge[way];
        if beyond != 0.0 {
            let mut back = edge;
            back[way] -= STEP_MM * beyond.signum();
            let (there, before) = (of(edge), of(back));
            for c in 0..3 {
                here[c] += (there[c] - before[c]) / STEP_MM * beyond.abs();
            }
        }
    }
    here
}

/// Returns the count of numbers of a record.
pub fn length() -> usize {
    5 + (1 + changes().count()) * columns()
}

/// Returns the count of numbers of one displacement of tip and grid.
pub fn columns() -> usize {
    let count = nodes_mm().len();
    3 * (1 + count * count)
}

impl Sampled {
    /// Returns the numbers that a file stores.
    pub fn numbers(&self) -> Vec<f32> {
        let Pose {
            size,
            tilt: [x, y],
            place_mm: [px, py],
        } = self.pose;
        let pose = [size, x, y, px, py].map(|part| part as f32);
        let rows = std::iter::once(&self.moved).chain(&self.rates);
        pose.into_iter().chain(rows.flatten().copied()).collect()
    }

    /// Returns the solution from its numbers; `None` if the record has another length.
    pub fn of_numbers(numbers: &[f32]) -> Option<Sampled> {
        if numbers.len() != length() {
            return None;
        }
        let (pose, rows) = numbers.split_first_chunk::<5>()?;
        let [size, x, y, px, py] = pose.map(f64::from);
        let mut rows = rows.chunks_exact(columns()).map(<[f32]>::to_vec);
        Some(Sampled {
            pose: Pose {
                size,
                tilt: [x, y],
                place_mm: [px, py],
            },
            moved: rows.next()?,
            rates: rows.collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back() {
        let numbers: Vec<f32> = (0..length()).map(|k| k as f32).collect();
        let read = Sampled::of_numbers(&numbers).unwrap();
        assert_eq!(read.numbers(), numbers);
        assert_eq!(read.rates.len(), changes().count());
        assert!(Sampled::of_numbers(&numbers[1..]).is_none());
    }

    #[test]
    fn beyond_the_edge_a_plane_goes_on() {
        let plane = |[x, y]: [f64; 2]| [x, 2.0 * y, x - y];
        for point in [[3.0, -4.0], [15.0, -4.0], [-20.0, 17.0]] {
            let expected = plane(point);
            for (a, b) in continued(plane, point).into_iter().zip(expected) {
                assert!((a - b).abs() < 1e-9, "{point:?}: {a} {b}");
            }
        }
    }
}
