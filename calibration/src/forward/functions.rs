//! Finds the few functions of size and tilt that a film's tables are made of. They are the
//! principal components, over places, markers and directions, of the coefficients of many terms.

use anyhow::Result;
use hivtac_sensor::force::forward::{MOST_FUNCTIONS, MOST_TILTS, OUTPUTS};
use hivtac_sensor::force::model::{TableSpec, TablesSpec};
use hivtac_twin::film::reduced::{Axis, LARGEST_SIZE, LARGEST_TILT, Pose, Terms};

use super::least_squares::{self, splines};
use super::matrix::{Matrix, cholesky, principal};

/// Loads by which components are judged: the number of sizes, evenly from 0 to the largest; and the
/// directions of each size. Each ring has its part of the largest tilt and the number of directions
/// that cover it evenly. Weak forces are most of them: the same error turns them most.
const SIZES: u8 = 16;
const RINGS: [(f64, u8); 4] = [(0.0, 1), (0.4, 6), (0.7, 10), (0.95, 16)];

/// A marker's motion at the nodes of its table.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// The nodes along x and along y, mm of the tip's place, ascending; 6 to 20 each.
    pub nodes_mm: [Vec<f64>; 2],
    /// Unit vector along which the first component of the terms' tilt is; the second is across it,
    /// from x towards y. Markers to which the load looks the same, each from its own side, need few
    /// functions.
    pub away: [f64; 2],
    /// By node along y and node along x: coefficients of the terms, of motion along x and of motion
    /// along y, focal lengths.
    pub coefficients: Vec<Vec<[Vec<f64>; OUTPUTS]>>,
}

/// The tables of markers with this motion, with the fewest functions of size and tilt whose error
/// is at most `left`. That is root mean square over loads, places and directions, in focal lengths.
/// With `most` functions where more would be needed. Also returns the remaining error. Loads of the
/// largest tilt weigh less than those without by a factor of 1 + `steep`.
///
/// # Errors
/// When an axis has invalid nodes.
pub fn compressed(
    sizes: [u8; MOST_TILTS],
    dots: &[Sampled],
    left: f64,
    most: usize,
    steep: f64,
) -> Result<(TablesSpec, f64)> {
    let terms = Terms::with_sizes(sizes);
    let odd = odd_terms(sizes);
    let metric = cholesky(apart(gram(&terms, steep), &odd));
    let components = components(apart(squares(dots, &metric, terms.count()), &odd), &odd);
    let mut square: f64 = components.iter().map(|own| own.square.max(0.0)).sum();
    let mut count = 0;
    while square > left * left && count < most.min(MOST_FUNCTIONS) {
        square -= components[count].square;
        count += 1;
    }
    let mut kept: Vec<&Component> = components[..count.max(1)].iter().collect();
    kept.sort_by_key(|own| own.is_odd);
    let kept: Vec<&[f64]> = kept.iter().map(|own| &own.direction[..]).collect();
    let function = |direction: &&[f64]| -> Vec<f32> {
        let parts = back(&metric, direction);
        parts.into_iter().map(|part| part as f32).collect()
    };
    let dots = dots.iter().map(|dot| table(dot, &metric, &kept));
    let tables = TablesSpec {
        terms: sizes,
        functions: kept.iter().map(function).collect(),
        dots: dots.collect::<Result<_>>()?,
    };
    Ok((tables, square.max(0.0).sqrt()))
}

/// A principal component of the markers' motion.
struct Component {
    /// Its mean square.
    square: f64,
    direction: Vec<f64>,
    /// Whether it consists of odd powers of the tilt's second component.
    is_odd: bool,
}

/// Components of a block matrix without entries between even and odd terms; the largest first.
fn components(matrix: Matrix, odd: &[bool]) -> Vec<Component> {
    let of = |is_odd: bool| {
        let own: Vec<usize> = (0..odd.len()).filter(|k| odd[*k] == is_odd).collect();
        let part = |i: &usize| own.iter().map(|j| matrix[*i][*j]).collect();
        let all = principal(own.iter().map(part).collect());
        let component = move |(square, parts): (f64, Vec<f64>)| {
            let mut direction = vec![0.0; odd.len()];
            for (k, part) in own.iter().zip(parts) {
                direction[*k] = part;
            }
            Component {
                square,
                direction,
                is_odd,
            }
        };
        all.into_iter().map(component).collect::<Vec<_>>()
    };
    let mut all = of(false);
    all.extend(of(true));
    all.sort_by(|a, b| b.square.total_cmp(&a.square));
    all
}

/// Which terms have odd powers of the tilt's second component: those change sign when mirrored at
/// the axis of the first.
fn odd_terms(sizes: [u8; MOST_TILTS]) -> Vec<bool> {
    let of_degree = |(degree, sizes): (usize, &u8)| {
        let sizes = usize::from(*sizes);
        (0..=degree).flat_map(move |k| std::iter::repeat_n(k % 2 == 1, sizes))
    };
    sizes.iter().enumerate().flat_map(of_degree).collect()
}

/// The matrix with zeros between even and odd terms.
fn apart(mut matrix: Matrix, odd: &[bool]) -> Matrix {
    for (row, of_row) in matrix.iter_mut().zip(odd) {
        for (entry, of_entry) in row.iter_mut().zip(odd) {
            if of_row != of_entry {
                *entry = 0.0;
            }
        }
    }
    matrix
}

/// A marker's table of functions along these directions.
fn table(dot: &Sampled, metric: &[Vec<f64>], kept: &[&[f64]]) -> Result<TableSpec> {
    let at = |outputs: &[Vec<f64>; OUTPUTS]| -> Vec<f64> {
        let outputs = outputs.iter().map(|row| along(metric, row));
        let parts =
            outputs.flat_map(|row| kept.iter().map(move |own| least_squares::dot(own, &row)));
        parts.collect()
    };
    let line = |line: &Vec<_>| line.iter().map(at).collect();
    let rows: Vec<Vec<Vec<f64>>> = dot.coefficients.iter().map(line).collect();
    let [along_x, along_y] = dot.nodes_mm.each_ref().map(|nodes| Axis::new(nodes));
    let coefficients = splines([&along_x, &along_y], &rows)?;
    Ok(TableSpec {
        away: dot.away.map(|part| part as f32),
        nodes_mm: dot
            .nodes_mm
            .each_ref()
            .map(|nodes| nodes.iter().map(|node| *node as f32).collect()),
        coefficients: coefficients.into_iter().flatten().flatten().collect(),
    })
}

/// Mean products of terms over typical loads: with them, sums of terms are as large as the motions.
fn gram(terms: &Terms, steep: f64) -> Vec<Vec<f64>> {
    let count = terms.count();
    let mut sum = vec![vec![0.0; count]; count];
    let loads = loads();
    let weight = |pose: &Pose| {
        let [a, b] = pose.tilt.map(|part| part / LARGEST_TILT);
        let less = 1.0 + steep * (a * a + b * b);
        1.0 / (less * less)
    };
    let whole: f64 = loads.iter().map(weight).sum();
    for pose in &loads {
        let [values, ..] = terms.rows(pose);
        for (row, a) in sum.iter_mut().zip(&values) {
            for (sum, b) in row.iter_mut().zip(&values) {
                *sum += weight(pose) * a * b / whole;
            }
        }
    }
    sum
}

fn loads() -> Vec<Pose> {
    let mut loads = Vec::new();
    for number in 1..=SIZES {
        for (ring, count) in RINGS {
            for k in 0..count {
                let turn = (f64::from(k) + 0.37 * f64::from(number)) / f64::from(count);
                let (sin, cos) = libm::sincos(2.0 * std::f64::consts::PI * turn);
                loads.push(Pose {
                    size: LARGEST_SIZE * f64::from(number) / f64::from(SIZES),
                    tilt: [cos, sin].map(|part| ring * LARGEST_TILT * part),
                    place_mm: [0.0; 2],
                });
            }
        }
    }
    loads
}

/// Lᵀ·c: its length is the size of the sum of terms with coefficients c.
fn along(metric: &[Vec<f64>], coefficients: &[f64]) -> Vec<f64> {
    let part = |j: usize| {
        let rows = metric.iter().zip(coefficients).skip(j);
        rows.map(|(row, c)| row[j] * c).sum()
    };
    (0..coefficients.len()).map(part).collect()
}

/// The inverse of [`along`]; 0 for coefficients that the loads do not determine.
fn back(metric: &[Vec<f64>], along: &[f64]) -> Vec<f64> {
    let mut coefficients = along.to_vec();
    for j in (0..coefficients.len()).rev() {
        let known: f64 = (j + 1..coefficients.len())
            .map(|i| metric[i][j] * coefficients[i])
            .sum();
        coefficients[j] = match metric[j][j] > 0.0 {
            true => (coefficients[j] - known) / metric[j][j],
            false => 0.0,
        };
    }
    coefficients
}

/// Mean products of motion over places, markers and directions.
fn squares(dots: &[Sampled], metric: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let mut sum = vec![vec![0.0; count]; count];
    let outputs = (OUTPUTS * dots.len()) as f64;
    for dot in dots {
        let [parts_x, parts_y] = dot.nodes_mm.each_ref().map(|nodes| parts(nodes));
        for (line, part_y) in dot.coefficients.iter().zip(&parts_y) {
            for (at, part_x) in line.iter().zip(&parts_x) {
                for row in at {
                    add_square(&mut sum, &along(metric, row), part_x * part_y / outputs);
                }
            }
        }
    }
    sum
}

/// The part of an axis that each node represents.
fn parts(nodes: &[f64]) -> Vec<f64> {
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let part = |k: usize| {
        let before = if k == 0 { first } else { nodes[k - 1] };
        let after = nodes.get(k + 1).copied().unwrap_or(last);
        (after - before) / 2.0 / (last - first)
    };
    (0..nodes.len()).map(part).collect()
}

fn add_square(sum: &mut [Vec<f64>], row: &[f64], part: f64) {
    for (sum, a) in sum.iter_mut().zip(row) {
        for (sum, b) in sum.iter_mut().zip(row) {
            *sum += part * a * b;
        }
    }
}
