//! Makes the reduced film's curves from the full solution.

use std::f64::consts::PI;

use hivtac_scene::film::curves::{Answer, Curve, Curves, Output, Pose, chebyshev, product};
use hivtac_scene::film::{Family, MAX_DEPTH_MM, MAX_FORCE_N};

use crate::newton::solve_small;
use crate::parallel::in_parallel;
use crate::view::disc_motions;
use crate::{Contact, Design, Film, FilmError};

/// A curve whose part nowhere exceeds this is left out: mm, mm per 0.5 mm (0.1 px is about 2 µm) or N.
const NEGLIGIBLE: f64 = 3e-4;
/// So is the end of a series that does not exceed this.
const NEGLIGIBLE_TAIL: f64 = 5e-6;

/// How a family is made.
struct Effort {
    /// Poses (tilt and offset). Each gives four markers' samples of a term.
    poses: usize,
    /// Nodes in s.
    nodes: usize,
    /// The highest degree in the tilt without offset, with its first power, with its second …
    degrees: &'static [u8],
}

fn effort(family: Family, overhang_mm: f64) -> Effort {
    match family {
        // Twice as many unknowns: as few poses and nodes as will do.
        Family::Force if overhang_mm > 0.0 => Effort {
            poses: 10,
            nodes: 18,
            degrees: &[3, 2, 1, 0],
        },
        Family::Force => Effort {
            poses: 20,
            nodes: 24,
            degrees: &[3, 2, 1, 0],
        },
        Family::Stick => Effort {
            poses: 56,
            nodes: 16,
            degrees: &[8, 5, 2],
        },
        Family::Slip => Effort {
            poses: 56,
            nodes: 16,
            degrees: &[5, 4, 3, 2],
        },
    }
}

fn contact(family: Family, pose: &Pose) -> Contact {
    let [x, y] = family.tangents(pose.size, pose.tilt);
    match family {
        Family::Force => {
            let size = MAX_FORCE_N * pose.size.powi(3) / (1.0 + x * x + y * y).sqrt();
            Contact::Force([size * x, size * y, -size])
        }
        Family::Stick | Family::Slip => {
            let depth = MAX_DEPTH_MM * pose.size;
            Contact::Travel([depth * x, depth * y, -depth])
        }
    }
}

/// Makes the curves of a film on `threads` threads; `progress` is told (poses done, poses) now and then.
///
/// # Errors
/// When the film cannot be made or an equilibrium is not found.
pub fn fit(
    family: Family,
    design: &Design,
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Curves, FilmError> {
    let effort = effort(family, design.overhang_mm);
    let nodes = nodes(effort.nodes);
    let poses: Vec<Pose> = (0..effort.poses)
        .map(|index| training_pose(family, index))
        .collect();
    let runs = in_parallel(design, &poses, threads, progress, |film, pose| {
        run(family, film, pose, &nodes)
    })?;
    let mut curves = Vec::new();
    for output in Output::ALL {
        curves.extend(curves_of(output, effort.degrees, &nodes, &poses, &runs)?);
    }
    Ok(Curves::new(curves))
}

/// Chebyshev's nodes in s, from the smallest.
fn nodes(count: usize) -> Vec<f64> {
    let node = |k: usize| (1.0 - ((k as f64 + 0.5) * PI / count as f64).cos()) / 2.0;
    (0..count).map(node).collect()
}

/// Presses the film at one pose, harder and harder: the outputs at each node of s.
fn run(
    family: Family,
    film: &mut Film,
    pose: &Pose,
    nodes: &[f64],
) -> Result<Vec<[[f64; 4]; 12]>, FilmError> {
    film.move_tip(pose.offset.map(|part| family.offset_mm() * part))?;
    let mut state = film.rest();
    let mut run = Vec::new();
    for &size in nodes {
        state = film.press(contact(family, &Pose { size, ..*pose }), &state)?;
        let answer = Answer {
            tip: match family {
                Family::Force => state.tip_mm,
                Family::Stick | Family::Slip => state.force_n,
            },
            discs: disc_motions(film, &state),
        };
        run.push(answer.outputs());
    }
    Ok(run)
}

/// Spread evenly in four dimensions and denser towards the limits, where a polynomial would stray first.
fn training_pose(family: Family, index: usize) -> Pose {
    let part = |base| halton(index + 1, base);
    let spread = |base| -(PI * part(base)).cos();
    let (radius, angle) = ((PI / 2.0 * part(2)).sin(), 2.0 * PI * part(3));
    Pose {
        size: 1.0,
        tilt: match family {
            Family::Force => [2, 3].map(spread),
            Family::Stick | Family::Slip => [radius * angle.cos(), radius * angle.sin()],
        },
        offset: [5, 7].map(spread),
    }
}

/// Halton's sequence: the digits of `index` in `base` behind the point, reversed.
pub(crate) fn halton(mut index: usize, base: usize) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= base as f64;
        value += place * (index % base) as f64;
        index /= base;
    }
    value
}

/// The terms that the symmetry leaves to an output.
fn terms(output: Output, degrees: &[u8]) -> Vec<[u8; 4]> {
    let mut terms = Vec::new();
    for (offset, most) in (0u8..).zip(degrees) {
        for (qr, qt) in (0..=*most).flat_map(|qr| (0..=*most - qr).map(move |qt| (qr, qt))) {
            for ot in 0..=offset {
                let odd = (qt + ot) % 2 == 1;
                if odd == output.is_odd() && output.allows_degree(qr + qt + offset) {
                    terms.push([qr, qt, offset - ot, ot]);
                }
            }
        }
    }
    terms
}

/// The curves of one output: least squares over the poses at each node, then Chebyshev series through the nodes.
fn curves_of(
    output: Output,
    degrees: &[u8],
    nodes: &[f64],
    poses: &[Pose],
    runs: &[Vec<[[f64; 4]; 12]>],
) -> Result<Vec<Curve>, FilmError> {
    let terms = terms(output, degrees);
    let seen = poses.iter().flat_map(|pose| (0..4).map(move |k| (pose, k)));
    let rows: Vec<Vec<f64>> = seen
        .map(|(pose, k)| terms.iter().map(|term| product(*term, pose, k)).collect())
        .collect();
    let mut at_nodes = Vec::new();
    for (node, s) in nodes.iter().enumerate() {
        let values = runs.iter().flat_map(|run| run[node][output.index()]);
        let values: Vec<f64> = values.map(|value| value / s).collect();
        let solved = least_squares(&rows, &values);
        at_nodes
            .push(solved.ok_or_else(|| FilmError::Solver("too few poses for the terms".into()))?);
    }
    let mut curves = Vec::new();
    for (k, powers) in terms.iter().enumerate() {
        let values: Vec<f64> = at_nodes.iter().map(|solved| solved[k]).collect();
        let sizes = values.iter().zip(nodes).map(|(value, s)| (value * s).abs());
        let negligible = match output {
            Output::Tip(_) => NEGLIGIBLE / 10.0,
            _ => NEGLIGIBLE,
        };
        if sizes.fold(0.0, f64::max) > negligible {
            curves.push(Curve {
                output,
                powers: *powers,
                series: series(nodes, &values),
            });
        }
    }
    Ok(curves)
}

/// Solves the normal equations; the terms are of size 1, and few.
fn least_squares(rows: &[Vec<f64>], values: &[f64]) -> Option<Vec<f64>> {
    let count = rows.first()?.len();
    let mut matrix = vec![vec![0.0; count]; count];
    let mut side = vec![0.0; count];
    for (row, value) in rows.iter().zip(values) {
        for i in 0..count {
            side[i] += row[i] * value;
            for j in 0..count {
                matrix[i][j] += row[i] * row[j];
            }
        }
    }
    solve_small(matrix, side)
}

/// The Chebyshev series through values at the nodes, without a negligible end.
fn series(nodes: &[f64], values: &[f64]) -> Vec<f64> {
    let mut series = vec![0.0; nodes.len()];
    for (s, value) in nodes.iter().zip(values) {
        for (k, (part, t)) in series.iter_mut().zip(chebyshev(*s)).enumerate() {
            let weight = if k == 0 { 1.0 } else { 2.0 };
            *part += weight / nodes.len() as f64 * value * t;
        }
    }
    let is_small = |part: &f64| part.abs() < NEGLIGIBLE_TAIL;
    while series.len() > 1 && series.last().is_some_and(is_small) {
        series.pop();
    }
    series
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_scene::film::curves::Part;

    #[test]
    fn symmetry_leaves_these_terms() {
        let count = |output| terms(output, &[3, 2, 1, 0]).len();
        assert_eq!(count(Output::Moved(Part::R)), 19);
        assert_eq!(count(Output::Moved(Part::T)), 16);
        assert_eq!(count(Output::AlongT(Part::T)), 19);
        assert_eq!(count(Output::Tip(Part::Z)), 7);
    }

    #[test]
    fn series_go_through_their_nodes() {
        let nodes = nodes(24);
        let values: Vec<f64> = nodes.iter().map(|s| (3.0 * s).sin()).collect();
        let series = series(&nodes, &values);
        for s in [0.0, 0.03, 0.4, 1.0] {
            let sum: f64 = series.iter().zip(chebyshev(s)).map(|(c, t)| c * t).sum();
            assert!((sum - (3.0 * s).sin()).abs() < 1e-5);
        }
        assert!(series.len() < nodes.len());
    }
}
