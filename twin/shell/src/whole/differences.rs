//! The motion that a film's own differences, and another tip, add to the whole film.

use hivtac_twin::MARKERS;
use hivtac_twin::film::reduced::{
    LARGEST_RADIUS_MM, LINEAR_N, NOMINAL_RADIUS_MM, Pose, Terms, rho,
};
use hivtac_twin::film::whole::{Difference, Differences, LoadFunctions, Nodes};

use super::fitted::{Fitted, at_places, mirrored, over_all, over_octant, rate, weighted};
use super::functions::functions;
use super::sampled::{Sampled, nodes_mm};
use crate::tables::{Known, Mirror, nearest, same, slopes};
use crate::{Change, Design, ShellError};

/// Full solutions with tips of two radii.
pub struct Samples<'a> {
    /// With the nominal radius.
    pub nominal: &'a [Sampled],
    /// With the largest radius.
    pub largest: &'a [Sampled],
}

/// A difference's fits at its places.
struct OfDifference {
    difference: Difference,
    fitted: Vec<Fitted>,
}

/// Returns the bytes of the tables of differences, with at most `count` functions of the load.
///
/// # Errors
/// If a place is missing among the samples, or too few loads were solved there.
pub fn differences(samples: &Samples<'_>, count: usize) -> Result<Vec<u8>, ShellError> {
    let mut all = Vec::new();
    for difference in Difference::ALL {
        let fitted = places(difference).into_iter();
        let fitted = fitted.map(|place_mm| samples.fit(difference, place_mm));
        all.push(OfDifference {
            difference,
            fitted: fitted.collect::<Result<_, _>>()?,
        });
    }
    let columns = all.iter().flat_map(|one| {
        let (nodes, usual) = (one.difference.nodes(), usual(one.difference));
        let columns = one
            .fitted
            .iter()
            .flat_map(move |fitted| weighted(&nodes, fitted));
        columns.map(move |(column, weight)| (column, weight * usual * usual))
    });
    let functions = functions(&columns.collect::<Vec<_>>(), count)?;
    let tables = all.iter().map(|one| one.table(&functions));
    let tables: Vec<Vec<f32>> = tables.collect();
    Ok(Differences::to_bytes(&functions, |one| {
        let place = Difference::ALL.iter().position(|other| *other == one);
        place.map_or_else(Vec::new, |k| tables[k].clone())
    }))
}

/// The usual size of a difference, by which the functions of the load are chosen.
fn usual(difference: Difference) -> f64 {
    match difference {
        Difference::Thickness => 0.1,
        Difference::Grip => 0.4,
        Difference::Post => 0.4,
        Difference::Radius(_) => 0.5,
    }
}

/// Returns the places at which a difference is tabulated, mm.
fn places(difference: Difference) -> Vec<[f64; 2]> {
    let nodes = difference.nodes();
    if difference.is_even() {
        let octant = nodes.octant();
        return octant
            .map(|place| place.map(|k| nodes.places_mm[k]))
            .collect();
    }
    let [axis, _] = nodes.axes();
    let along = axis.nodes();
    let row = |y: &f64| along.iter().map(|x| [*x, *y]).collect::<Vec<_>>();
    along.iter().flat_map(row).collect()
}

impl OfDifference {
    fn table(&self, functions: &LoadFunctions) -> Vec<f32> {
        let nodes = self.difference.nodes();
        let rows = at_places(&nodes, functions, &self.fitted);
        match self.difference.is_even() {
            true => over_octant(&nodes, functions, &rows),
            false => over_all(&nodes, &rows),
        }
    }
}

impl Samples<'_> {
    /// Returns the coefficients of a difference's terms with the tip at a place, from every mirror
    /// that puts a solved place there.
    fn fit(&self, difference: Difference, place_mm: [f64; 2]) -> Result<Fitted, ShellError> {
        let mut known = Vec::new();
        for mirror in Mirror::all() {
            let there = |one: &&Sampled| same(mirror.along(one.pose.place_mm), place_mm);
            for one in self.nominal.iter().filter(there) {
                if let Some(row) = self.row(difference, &mirror, one) {
                    known.push(Known {
                        pose: mirror.pose(&one.pose),
                        values: thinned(&difference.nodes(), &row),
                        slopes: None,
                    });
                }
            }
        }
        // No derivatives by the force are known, and two rings of tilts do not determine the third
        // degree.
        let terms = Terms::up_to(4, 2, 1);
        let own = nearest(&terms, &known)?;
        Ok(Fitted {
            place_mm,
            coefficients: own
                .chunks(terms.count())
                .flat_map(|row| embedded(&terms, row))
                .collect(),
        })
    }

    /// Returns a difference's effect on a solution, mirrored; `None` if it is not known there.
    fn row(&self, difference: Difference, mirror: &Mirror, one: &Sampled) -> Option<Vec<f64>> {
        match difference {
            Difference::Thickness => Some(thicker(mirror, one)),
            Difference::Grip => Some(mirrored(mirror, rate(one, Change::Grip))),
            Difference::Post => {
                let post = mirror.seen_as(MARKERS[2].centre_mm);
                let by = [0, 1].map(|way| mirrored(mirror, rate(one, Change::Post(post, way))));
                let [along, _] = mirror.components(by);
                Some(along)
            }
            Difference::Radius(power) => {
                let same_load = |other: &&Sampled| other.pose == one.pose;
                let largest = self.largest.iter().find(same_load)?;
                Some(by_radius(mirror, one, largest, power))
            }
        }
    }
}

/// Returns the effect of the thickness's logarithm at a load under which the nominal film has the
/// same depth.
fn thicker(mirror: &Mirror, one: &Sampled) -> Vec<f64> {
    let pose = mirror.pose(&one.pose);
    let by = [0, 1, 2].map(|axis| mirrored(mirror, rate(one, Change::Force(axis))));
    let [x, y, z] = by;
    let [x, y] = mirror.components([x, y]);
    let [per_size, ..] = slopes(&pose, &[x, y, z]);
    let size_per_thickness = size_per_thickness(&pose);
    let thickness_mm = Design::default().material.thickness_mm;
    let own = mirrored(mirror, rate(one, Change::Thickness)).into_iter();
    own.zip(per_size)
        .map(|(part, size)| thickness_mm * part - size * size_per_thickness)
        .collect()
}

/// Returns the decrease of a load's size per logarithm of the thickness at constant force.
fn size_per_thickness(pose: &Pose) -> f64 {
    let s = pose.size;
    match s {
        0.0 => 0.0,
        _ => -(3.0 * LINEAR_N * s + s * s * s) / (LINEAR_N + 3.0 * s * s),
    }
}

/// Returns the coefficient of a power of ρ in the effect of a larger tip, from the difference at
/// ρ = 1 and the slopes at both ends.
fn by_radius(mirror: &Mirror, nominal: &Sampled, largest: &Sampled, power: usize) -> Vec<f64> {
    let per_rho = |one: &Sampled, radius_mm: f64| {
        let step = 1e-3;
        let per_mm = (rho(radius_mm + step) - rho(radius_mm - step)) / (2.0 * step);
        let row = mirrored(mirror, rate(one, Change::TipRadius)).into_iter();
        row.map(|part| part / per_mm).collect::<Vec<f64>>()
    };
    let from = per_rho(nominal, NOMINAL_RADIUS_MM);
    let to = per_rho(largest, LARGEST_RADIUS_MM);
    let [here, there] = [nominal, largest].map(|one| mirrored(mirror, &one.moved));
    (0..here.len())
        .map(|k| {
            let more = there[k] - here[k];
            match power {
                0 => from[k],
                1 => 3.0 * more - 2.0 * from[k] - to[k],
                _ => from[k] + to[k] - 2.0 * more,
            }
        })
        .collect()
}

/// Returns the numbers of a row that belong to the nodes of a table.
fn thinned(nodes: &Nodes, row: &[f64]) -> Vec<f64> {
    let all = nodes_mm();
    let [_, around] = nodes.axes();
    let nearest = |node: &f64| {
        let off = |k: &usize| (all[*k] - node).abs();
        (0..all.len())
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or_default()
    };
    let kept: Vec<usize> = around.nodes().iter().map(nearest).collect();
    let mut own = row[..3].to_vec();
    for j in &kept {
        for i in &kept {
            own.extend(&row[3 * (1 + j * all.len() + i)..][..3]);
        }
    }
    own
}

/// Returns coefficients of terms as those of the terms of the load's functions.
fn embedded(terms: &Terms, own: &[f64]) -> Vec<f64> {
    let all = LoadFunctions::terms();
    let of = |powers: &[u8; 3]| {
        let place = terms.powers().iter().position(|other| other == powers);
        place.map_or(0.0, |k| own[k])
    };
    all.powers().iter().map(of).collect()
}
