//! Makes the reduced film's curves from the full solution.

use std::f64::consts::PI;

use hivtac_scene::film::Family;
use hivtac_scene::film::curves::{Curve, Curves, Output, chebyshev, product};

use crate::newton::solve_small;
use crate::parallel::in_parallel;
use crate::samples::{Sample, samples};
use crate::{Design, FilmError};

/// A curve whose part nowhere exceeds this is left out: a marker's displacement, mm (0.1 px is about 2 µm) …
const NEGLIGIBLE_MM: f64 = 1e-4;
/// … its slope, mm per mm (a rim of 0.5 mm around a place that the mean tells) …
const NEGLIGIBLE_SLOPE: f64 = 1e-3;
/// … and the tip's vector, mm or N.
const NEGLIGIBLE_TIP: f64 = 2e-5;
/// So is the end of a series that does not exceed this.
const NEGLIGIBLE_TAIL: f64 = 5e-6;
/// What a difference of slopes counts for beside one of values, the whole range of tilt and offset being 1.
const SLOPES_COUNT: f64 = 0.1;

/// How a family is made.
struct Effort {
    /// Poses (tilt and offset). Each gives four markers' samples of a term, with its four slopes.
    poses: usize,
    /// Nodes in s.
    nodes: usize,
    /// The highest degree in the tilt without offset, with its first power, with its second …
    degrees: &'static [u8],
    /// The same for the markers' slopes, which turn a disc by little: its mean says where it is.
    slope_degrees: &'static [u8],
}

fn effort(family: Family, overhang_mm: f64) -> Effort {
    type Degrees = &'static [u8];
    let (poses, nodes, degrees, slope_degrees): (_, _, Degrees, Degrees) = match family {
        // Twice as many unknowns: as few poses and nodes as will do.
        Family::Force if overhang_mm > 0.0 => (5, 18, &[3, 2, 1, 0], &[3, 2, 1, 0]),
        Family::Force => (8, 24, &[3, 2, 1, 0], &[3, 2, 1, 0]),
        Family::Slip => (12, 20, &[4, 3, 2, 1], &[4, 3, 2, 1]),
    };
    Effort {
        poses,
        nodes,
        degrees,
        slope_degrees,
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
    let poses: Vec<usize> = (0..effort.poses).collect();
    let runs = in_parallel(design, &poses, threads, progress, |film, index| {
        samples(family, film, *index, &nodes)
    })?;
    let [terms, slope_terms] = [effort.degrees, effort.slope_degrees].map(all_terms);
    let terms = |output| match output {
        Output::AlongR(_) | Output::AlongT(_) => &slope_terms,
        _ => &terms,
    };
    let mut solved: Vec<Vec<Vec<f64>>> = Vec::new();
    for node in 0..nodes.len() {
        let at_node: Vec<&Sample> = runs.iter().map(|run| &run[node]).collect();
        let each = Output::ALL.map(|output| fit_node(output, terms(output), &at_node));
        let each: Option<Vec<_>> = each.into_iter().collect();
        solved.push(each.ok_or_else(|| FilmError::Solver("too few poses for the terms".into()))?);
    }
    let curves = Output::ALL.into_iter().flat_map(|output| {
        let of_node = |at: &Vec<Vec<f64>>| at[output.index()].clone();
        let at_nodes: Vec<Vec<f64>> = solved.iter().map(of_node).collect();
        curves_of(output, terms(output), &nodes, &at_nodes)
    });
    Ok(Curves::new(curves))
}

/// Chebyshev's nodes in s, from the smallest.
fn nodes(count: usize) -> Vec<f64> {
    let node = |k: usize| (1.0 - ((k as f64 + 0.5) * PI / count as f64).cos()) / 2.0;
    (0..count).map(node).collect()
}

/// The powers of all terms.
fn all_terms(degrees: &[u8]) -> Vec<[u8; 4]> {
    let mut terms = Vec::new();
    for (offset, most) in (0u8..).zip(degrees) {
        for (qr, qt) in (0..=*most).flat_map(|qr| (0..=*most - qr).map(move |qt| (qr, qt))) {
            terms.extend((0..=offset).map(|ot| [qr, qt, offset - ot, ot]));
        }
    }
    terms
}

/// Whether the symmetry leaves a term to an output.
fn has(output: Output, [qr, qt, or, ot]: [u8; 4]) -> bool {
    let odd = (qt + ot) % 2 == 1;
    odd == output.is_odd() && output.allows_degree(qr + qt + or + ot)
}

/// The coefficient of each of an output's terms at a node: least squares over values and slopes.
fn fit_node(output: Output, terms: &[[u8; 4]], samples: &[&Sample]) -> Option<Vec<f64>> {
    let own: Vec<[u8; 4]> = terms
        .iter()
        .copied()
        .filter(|term| has(output, *term))
        .collect();
    let (mut rows, mut sides) = (Vec::new(), Vec::new());
    for (sample, marker) in samples
        .iter()
        .flat_map(|sample| (0..4).map(move |k| (sample, k)))
    {
        let products: Vec<_> = own
            .iter()
            .map(|term| product(*term, &sample.pose, marker))
            .collect();
        let s = sample.pose.size;
        rows.push(products.iter().map(|(value, _)| *value).collect());
        sides.push(sample.outputs[output.index()][marker] / s);
        for (k, slopes) in sample.slopes.iter().enumerate() {
            let row = products.iter().map(|(_, slope)| SLOPES_COUNT * slope[k]);
            rows.push(row.collect());
            sides.push(SLOPES_COUNT * slopes[output.index()][marker] / s);
        }
    }
    least_squares(&rows, &sides)
}

/// The curves of one output: Chebyshev series through what was found at the nodes.
fn curves_of(
    output: Output,
    terms: &[[u8; 4]],
    nodes: &[f64],
    at_nodes: &[Vec<f64>],
) -> Vec<Curve> {
    let own = terms.iter().filter(|term| has(output, **term));
    let negligible = match output {
        Output::Moved(_) => NEGLIGIBLE_MM,
        Output::AlongR(_) | Output::AlongT(_) => NEGLIGIBLE_SLOPE,
        Output::Tip(_) => NEGLIGIBLE_TIP,
    };
    let curve = |(k, powers): (usize, &[u8; 4])| {
        let values: Vec<f64> = at_nodes.iter().map(|solved| solved[k]).collect();
        let sizes = values.iter().zip(nodes).map(|(value, s)| (value * s).abs());
        (sizes.fold(0.0, f64::max) > negligible).then(|| Curve {
            output,
            powers: *powers,
            series: series(nodes, &values),
        })
    };
    own.enumerate().filter_map(curve).collect()
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
        let terms = all_terms(&[3, 2, 1, 0]);
        let count = |output| terms.iter().filter(|term| has(output, **term)).count();
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
