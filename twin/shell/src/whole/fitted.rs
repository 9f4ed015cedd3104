//! The terms and the splines of the whole film's motion, from its samples.

use faer::prelude::*;
use hivtac_twin::film::whole::{LoadFunctions, MAX_POINT_MM, MAX_TIP_MM, Nodes, WholeFilm};

use super::functions::{Parts, functions};
use super::sampled::{Sampled, changes, nodes_mm};
use crate::tables::{Known, Mirror, inverse, nearest, poses, same, slopes};
use crate::{Change, ShellError};

/// Weight of a motion along z: a camera sees it less than one along the film.
const AWAY_COUNTS: f64 = 0.7;
/// Weight of points that no dot may be on.
const FAR_COUNTS: f64 = 1e-3;

/// Motions at one place of the tip: the coefficients of terms, by number of the row and term.
pub struct Fitted {
    pub place_mm: [f64; 2],
    pub coefficients: Vec<f64>,
}

/// Returns the bytes of the whole film's tables, with at most `count` functions of the load.
///
/// # Errors
/// If a place is missing among the samples, or too few loads were solved there.
pub fn whole(sampled: &[Sampled], count: usize) -> Result<Vec<u8>, ShellError> {
    let nodes = WholeFilm::NODES;
    let fitted = nodes.octant().map(|place| {
        let place_mm = place.map(|k| nodes.places_mm[k]);
        fit(sampled, place_mm)
    });
    let fitted: Vec<Fitted> = fitted.collect::<Result<_, _>>()?;
    let columns: Vec<_> = fitted
        .iter()
        .flat_map(|one| weighted(&nodes, one))
        .collect();
    let functions = functions(&columns, count)?;
    let octant = over_octant(&nodes, &functions, &at_places(&nodes, &functions, &fitted));
    Ok(WholeFilm::to_bytes(&functions, &octant))
}

/// Returns the coefficients of terms with the tip at a place, from every mirror that leaves the
/// place where it is.
fn fit(sampled: &[Sampled], place_mm: [f64; 2]) -> Result<Fitted, ShellError> {
    let mut known = Vec::new();
    for mirror in Mirror::all() {
        if !same(mirror.along(place_mm), place_mm) {
            continue;
        }
        for one in sampled
            .iter()
            .filter(|one| same(one.pose.place_mm, place_mm))
        {
            let values = mirrored(&mirror, &one.moved);
            let by = [0, 1, 2].map(|axis| mirrored(&mirror, rate(one, Change::Force(axis))));
            let [x, y, z] = by;
            let [x, y] = mirror.components([x, y]);
            for pose in poses(mirror.pose(&one.pose)) {
                known.push(Known {
                    pose,
                    values: values.clone(),
                    slopes: Some(slopes(&pose, &[x.clone(), y.clone(), z.clone()])),
                });
            }
        }
    }
    if known.is_empty() {
        return Err(ShellError::Solver(format!(
            "no solution has its tip at {place_mm:?} mm: solve there"
        )));
    }
    Ok(Fitted {
        place_mm,
        coefficients: nearest(&LoadFunctions::terms(), &known)?,
    })
}

/// Returns a solution's derivative by a change.
pub fn rate(sampled: &Sampled, change: Change) -> &[f32] {
    let place = changes().position(|one| one == change);
    place.map_or(&[], |k| &sampled.rates[k])
}

/// Returns a row of motions mirrored.
pub fn mirrored(mirror: &Mirror, row: &[f32]) -> Vec<f64> {
    let count = nodes_mm().len();
    let middle = (count - 1) as f64 / 2.0;
    let mut seen = vec![0.0; row.len()];
    let points = std::iter::once((0, 0)).chain((0..count * count).map(|point| {
        let from = [point % count, point / count].map(|k| k as f64 - middle);
        let [x, y] = mirror.along(from).map(|k| (k + middle).round() as usize);
        (1 + point, 1 + y * count + x)
    }));
    for (from, to) in points {
        let moved = [0, 1, 2].map(|c| f64::from(row[3 * from + c]));
        seen[3 * to..][..3].copy_from_slice(&mirror.vector(moved));
    }
    seen
}

/// Returns each motion's coefficients with its weight among all.
pub fn weighted(nodes: &Nodes, fitted: &Fitted) -> Vec<(Vec<f64>, f64)> {
    let count = LoadFunctions::terms().count();
    let rows = fitted.coefficients.chunks(count).enumerate();
    rows.map(|(k, row)| (row.to_vec(), weight(nodes, fitted.place_mm, k)))
        .collect()
}

/// Returns the weight of a number of the row: of the square root of the area around its point, and
/// nearly none where no dot may be.
fn weight(nodes: &Nodes, place_mm: [f64; 2], number: usize) -> f64 {
    let component = if number % 3 == 2 { AWAY_COUNTS } else { 1.0 };
    let [_, axis] = nodes.axes();
    let nodes = axis.nodes();
    let Some(point) = (number / 3).checked_sub(1) else {
        return component;
    };
    let along = [point % nodes.len(), point / nodes.len()];
    let far = (0..2).any(|c| (place_mm[c] + nodes[along[c]]).abs() > MAX_POINT_MM);
    if far || place_mm.iter().any(|part| part.abs() > MAX_TIP_MM) {
        return FAR_COUNTS * component;
    }
    let width = |k: usize| {
        let [before, after] = [k.max(1) - 1, (k + 1).min(nodes.len() - 1)];
        (nodes[after] - nodes[before]) / 2.0
    };
    component * (width(along[0]) * width(along[1])).sqrt()
}

/// Returns each place's rows of splines over the distance from the tip, by function.
pub fn at_places(
    nodes: &Nodes,
    functions: &LoadFunctions,
    fitted: &[Fitted],
) -> Vec<Vec<Vec<f64>>> {
    let parts = Parts::of(functions.coefficients());
    let [_, around] = nodes.axes();
    let around = inverse(&around);
    let terms = LoadFunctions::terms().count();
    let of_place = |fitted: &Fitted| -> Vec<Vec<f64>> {
        let rows = fitted.coefficients.chunks(terms);
        let rows: Vec<Vec<f64>> = rows.map(|row| parts.in_motion(row)).collect();
        let of = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let functions = 0..functions.count();
        functions.map(|k| smooth(&around, &of(k))).collect()
    };
    fitted.iter().map(of_place).collect()
}

/// Returns a row with the coefficients of splines through its points.
fn smooth(inverse: &Mat<f64>, row: &[f64]) -> Vec<f64> {
    let count = inverse.nrows();
    let mut found = row[..3].to_vec();
    found.resize(row.len(), 0.0);
    for c in 0..3 {
        let points = Mat::from_fn(count, count, |i, j| row[3 * (1 + i * count + j) + c]);
        let solved = inverse * points * inverse.transpose();
        for i in 0..count {
            for j in 0..count {
                found[3 * (1 + i * count + j) + c] = solved[(i, j)];
            }
        }
    }
    found
}

/// Returns the coefficients of splines over all places, from rows at all of them, along y and,
/// within, along x.
pub fn over_all(nodes: &Nodes, rows: &[Vec<Vec<f64>>]) -> Vec<f32> {
    let [places, _] = nodes.axes();
    let inverse = inverse(&places);
    let count = inverse.nrows();
    let mut all = Vec::new();
    for place in 0..count * count {
        let mut sum = vec![0.0; rows[0].len() * rows[0][0].len()];
        for (from, own) in rows.iter().enumerate() {
            let part =
                inverse[(place % count, from % count)] * inverse[(place / count, from / count)];
            for (sum, value) in sum.iter_mut().zip(own.iter().flatten()) {
                *sum += part * value;
            }
        }
        all.extend(sum.into_iter().map(|value| value as f32));
    }
    all
}

/// Returns the coefficients of splines at the places of the octant, from rows there, by place,
/// function and number of the row.
pub fn over_octant(nodes: &Nodes, functions: &LoadFunctions, octant: &[Vec<Vec<f64>>]) -> Vec<f32> {
    let [places, _] = nodes.axes();
    let inverse = inverse(&places);
    let half = nodes.places_mm.len() - 1;
    let mut all = Vec::new();
    for place in nodes.octant() {
        let [across, down] = place.map(|k| half + k);
        let mut rows = vec![vec![0.0; nodes.row()]; functions.count()];
        for j in 0..inverse.nrows() {
            for i in 0..inverse.nrows() {
                let part = inverse[(across, i)] * inverse[(down, j)];
                let [x, y] = [i, j].map(|k| k as f64 - half as f64);
                let signs = [1.0_f64.copysign(x), 1.0_f64.copysign(y)];
                let swap = y.abs() > x.abs();
                let [most, least] =
                    [x.abs().max(y.abs()), x.abs().min(y.abs())].map(|k| k as usize);
                let own = &octant[most * (most + 1) / 2 + least];
                for (k, row) in own.iter().enumerate() {
                    let (other, sign) = functions.seen(k, swap, signs);
                    let seen = nodes.mirrored(row, swap, signs);
                    for (sum, value) in rows[other].iter_mut().zip(seen) {
                        *sum += part * sign * value;
                    }
                }
            }
        }
        all.extend(rows.into_iter().flatten().map(|value| value as f32));
    }
    all
}
