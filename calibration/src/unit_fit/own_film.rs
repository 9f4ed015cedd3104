//! Makes a unit's own film as a model file holds it: tables of its dots, and their uncertainty.

use std::collections::HashMap;
use std::sync::Mutex;

use anyhow::{Context, Result, ensure};
use hivtac_sensor::force::forward::{MOST_FUNCTIONS, MOST_TILTS, Noise, Stiffness};
use hivtac_sensor::force::model::{CovarianceSpec, ForwardSpec, TableSpec, TablesSpec};
use hivtac_shell::Equilibrium;
use hivtac_terms::marker::{LEAST_MARKERS, MOST_MARKERS};
use hivtac_twin::Camera;
use hivtac_twin::film::MAX_PLACE_MM;
use hivtac_twin::film::reduced::{LARGEST_SIZE, Pose};
use serde::{Deserialize, Serialize};

use super::descent::Found;
use super::field::{Coefficients, Field};
use super::linear::{cholesky, dot};
use super::numbers::{Family, Number};
use super::problem::{At, Problem, Rates, mesh_part, near_tip};
use super::weight::OwnWeight;
use crate::forward::{
    Covariance, Dot, KNOTS, Moved, covariances, knots, limits, rest_image, sum_of_squares, tables,
};
use crate::parallel;

/// Nodes along each axis of a dot's table, of four and of other dots. Others may be anywhere under
/// the tip.
const NODES: usize = 13;
const MORE_NODES: usize = 14;
/// Distance from one of those dots, mm, at which its nodes are twice as far apart as there.
const TWICE_MM: f64 = 0.8;
/// The number of dots of the square layout.
const SQUARE: usize = LEAST_MARKERS;

/// A unit's film as fitted to its loads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnFilm {
    /// The fitted numbers of the unit.
    pub numbers: Vec<FoundNumber>,
    /// Coefficients a and b, N, of |F| = a·s + b·s³ at a size s.
    pub stiffness_n: [f64; 2],
    /// Focal lengths per px of its camera, a complex number (scale and roll).
    pub per_px: [f64; 2],
    /// Rest position as a tare measures it, minus where the markers rest, px.
    pub rest_px: Vec<[f64; 2]>,
    /// Number of powers of size in the tables' terms without tilt, of its first degree, and higher
    /// degrees.
    terms: [u8; MOST_TILTS],
    /// The load functions: coefficients of the terms.
    functions: Vec<Vec<f32>>,
    dots: Vec<OwnTable>,
    covariance: OwnCovariance,
    /// The effect of gravity. Present if gravity was known under the loads and the film finds an
    /// equilibrium in every orientation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    weight: Option<Box<OwnWeight>>,
}

/// A number of a unit, as fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundNumber {
    /// Its name, with its unit.
    pub name: String,
    /// The likeliest value.
    pub value: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

/// A dot's table, like [`TableSpec`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OwnTable {
    /// Where the dot is on the film, mm.
    place_mm: [f64; 2],
    nodes_mm: [Vec<f32>; 2],
    away: [f32; 2],
    coefficients: Vec<f64>,
}

/// Like [`CovarianceSpec`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OwnCovariance {
    counts: [u8; 3],
    end_mm: f32,
    /// Row by row, of each knot.
    factors: Vec<Vec<f64>>,
}

impl OwnFilm {
    /// Of a fitted unit.
    ///
    /// # Errors
    /// When its film finds no equilibrium under a load of the tables.
    pub fn new(problem: &Problem<'_>, found: &Found) -> Result<Self> {
        let field = Field::new(problem, &found.at)?;
        let made = &found.at.made;
        let (tables, left) = tables_of(&field, &made.dots_mm)?;
        // Scatter beyond the noise comes from differences that no number describes.
        let scatter_px = problem.bench.noise_px * (found.scatter() - 1.0).sqrt();
        let beside = left.hypot(scatter_px.hypot(mesh_px(problem.family)) / made.focal_px);
        let covariance = remaining_covariance(problem, found, &field, beside)?;
        let (sin, cos) = libm::sincos(made.roll_deg.to_radians());
        Ok(Self {
            numbers: problem.found_numbers(found),
            stiffness_n: field.stiffness_n(),
            per_px: [cos, -sin].map(|part| part / made.focal_px),
            rest_px: made.rest_px.clone(),
            terms: tables.terms,
            functions: tables.functions,
            dots: (tables.dots.into_iter().zip(&made.dots_mm))
                .map(|(table, place_mm)| OwnTable {
                    place_mm: *place_mm,
                    nodes_mm: table.nodes_mm,
                    away: table.away,
                    coefficients: table.coefficients,
                })
                .collect(),
            covariance: OwnCovariance {
                counts: covariance.counts,
                end_mm: covariance.end_mm,
                factors: covariance.factors.iter().map(|f| f.concat()).collect(),
            },
            weight: (problem.bench.down)
                .and_then(|_| OwnWeight::new(problem, found, field.stiffness_n()).ok())
                .map(Box::new),
        })
    }

    /// Whether it holds when the sensor is turned.
    pub fn knows_weight(&self) -> bool {
        self.weight.is_some()
    }

    /// Checks that every value is valid.
    ///
    /// # Errors
    /// Names the first that is not.
    pub fn check(&self) -> Result<()> {
        let numbers = self.stiffness_n.iter().chain(&self.per_px);
        ensure!(
            numbers.clone().all(|part| part.is_finite()) && self.stiffness_n[0] > 0.0,
            "film.own: {numbers:?} are no stiffness and no camera's scale"
        );
        ensure!(
            (LEAST_MARKERS..=MOST_MARKERS).contains(&self.dots.len())
                && self.rest_px.len() == self.dots.len(),
            "film.own: tables of {} markers, rest positions of {}: use {LEAST_MARKERS} to \
             {MOST_MARKERS} of both",
            self.dots.len(),
            self.rest_px.len()
        );
        if let Some(weight) = &self.weight {
            weight.check(2 * self.dots.len())?;
        }
        self.covariance().map(|_| ())
    }

    /// The film as a model file holds it, with this number of Gauss–Newton steps and this noise of
    /// markers.
    ///
    /// # Errors
    /// When the covariance is of a different number of coordinates.
    pub fn spec(&self, steps: u8, noise: Noise, camera: &Camera) -> Result<ForwardSpec> {
        let [linear_n, cubic_n] = self.stiffness_n.map(|part| part as f32);
        let mut rest_px = noise.rest_px;
        for (place, own) in rest_px.iter_mut().zip(&self.rest_px) {
            *place = own.map(|part| part as f32);
        }
        Ok(ForwardSpec {
            steps,
            limits: limits(),
            stiffness: Stiffness { linear_n, cubic_n },
            rest_image: rest_image(&self.places_mm(), camera),
            per_px: Some(self.per_px.map(|part| part as f32)),
            noise: Noise { rest_px, ..noise },
            tables: self.tables(),
            own: Some(self.covariance()?),
            other: None,
            weight: (self.weight.as_deref())
                .map(|weight| weight.spec(2 * self.dots.len()))
                .transpose()?,
        })
    }

    /// Where its dots are glued, mm.
    fn places_mm(&self) -> Vec<[f64; 2]> {
        self.dots.iter().map(|dot| dot.place_mm).collect()
    }

    /// The tables as a model file holds them.
    fn tables(&self) -> TablesSpec {
        let table = |table: &OwnTable| TableSpec {
            nodes_mm: table.nodes_mm.clone(),
            away: table.away,
            coefficients: table.coefficients.clone(),
        };
        TablesSpec {
            terms: self.terms,
            functions: self.functions.clone(),
            dots: self.dots.iter().map(table).collect(),
        }
    }

    /// The uncertainty of the unit's motion as a model file holds it.
    ///
    /// # Errors
    /// When a knot has a different number of entries than a covariance.
    fn covariance(&self) -> Result<CovarianceSpec> {
        let coordinates = 2 * self.dots.len();
        let factor = |entries: &Vec<f64>| -> Option<Vec<Vec<f64>>> {
            let rows = entries.chunks(coordinates).map(<[f64]>::to_vec);
            (entries.len() == coordinates * coordinates).then(|| rows.collect())
        };
        let factors = self.covariance.factors.iter().map(factor);
        Ok(CovarianceSpec {
            counts: self.covariance.counts,
            end_mm: self.covariance.end_mm,
            factors: factors
                .collect::<Option<_>>()
                .context("film.own: a covariance of other markers")?,
        })
    }
}

/// Standard uncertainty of each coordinate due to the fit's mesh under the largest load, px at
/// 320×240. 0 for real films: their many open numbers include it.
fn mesh_px(family: Family) -> f64 {
    match family {
        Family::Nominal => 0.02,
        Family::Real => 0.0,
    }
}

/// The tables of dots on a film, and their error in motion, root mean square, focal lengths.
fn tables_of(field: &Field<'_>, dots_mm: &[[f64; 2]]) -> Result<(TablesSpec, f64)> {
    let dots: Vec<Dot> = dots_mm
        .iter()
        .map(|place| match dots_mm.len() {
            SQUARE => Dot::new(*place, NODES),
            _ => Dot::within(*place, MORE_NODES, MAX_PLACE_MM, TWICE_MM),
        })
        .collect();
    // A node's coefficients give all its loads, which are queried one after the other.
    let known: Mutex<HashMap<[u64; 3], Coefficients>> = Mutex::default();
    let moved = |pose: &Pose, number: usize| {
        let [x, y] = pose.place_mm.map(f64::to_bits);
        let key = [number as u64, x, y];
        let poisoned = |_| anyhow::anyhow!("a thread stopped");
        let kept = known.lock().map_err(poisoned)?.get(&key).cloned();
        let coefficients = match kept {
            Some(kept) => kept,
            None => {
                let made = field.coefficients(dots_mm[number], pose.place_mm);
                known.lock().map_err(poisoned)?.insert(key, made.clone());
                made
            }
        };
        let [values, ..] = field.terms().rows(pose);
        Ok(coefficients.each_ref().map(|row| dot(row, &values)))
    };
    tables(&dots, moved, MOST_FUNCTIONS, 0.0)
}

/// Covariances of the motion of the unit's dots that the loads leave. `beside` is an independent
/// error of each coordinate at the largest size, focal lengths; it grows in proportion to size.
fn remaining_covariance(
    problem: &Problem<'_>,
    found: &Found,
    field: &Field<'_>,
    beside: f64,
) -> Result<CovarianceSpec> {
    let at = problem.coarse(&found.at)?;
    let poses: Vec<Pose> = knots(KNOTS).collect();
    let states = knot_states(&at, field, &poses)?;
    let rates = problem.rates(&at, &states)?;
    let is_held = |k: &usize| {
        !matches!(
            problem.priors[*k].number,
            Number::Stage(_) | Number::Middle(_)
        )
    };
    let held: Vec<usize> = (0..problem.priors.len()).filter(is_held).collect();
    let scatter = found.scatter();
    let row = |i: &usize| {
        held.iter()
            .map(|j| scatter * found.solved.covariance[*i][*j])
            .collect()
    };
    let spread = cholesky(held.iter().map(row).collect())?;
    let per_px = 1.0 / at.made.focal_px;
    let (sin, cos) = libm::sincos(at.made.roll_deg.to_radians());
    let of_pose = |((rates, moved_px), pose): ((&Rates, &Vec<f64>), &Pose)| -> Covariance {
        let along = |column: usize| -> Moved {
            let mut moved = Moved::defaults(2 * at.made.dots_mm.len());
            for (k, row) in held.iter().zip(&spread) {
                for (sum, rate) in moved.iter_mut().zip(&rates.numbers[*k]) {
                    *sum += row[column] * rate;
                }
            }
            for [x, y] in moved.as_chunks_mut::<2>().0 {
                (*x, *y) = (
                    per_px * (cos * *x + sin * *y),
                    per_px * (cos * *y - sin * *x),
                );
            }
            moved
        };
        let mut covariance = sum_of_squares(&(0..held.len()).map(along).collect::<Vec<_>>());
        for (k, row) in covariance.iter_mut().enumerate() {
            let dot_mm = at.made.dots_mm[k / 2];
            let moved = per_px * libm::hypot(moved_px[k - k % 2], moved_px[k - k % 2 + 1]);
            let part = mesh_part(dot_mm, pose.place_mm).hypot(table_part(dot_mm, pose.place_mm));
            let size = pose.size / LARGEST_SIZE;
            row[k] += (beside * size).powi(2) + (part * moved).powi(2);
        }
        covariance
    };
    let moved_px = parallel::map(states.len(), |k| problem.moved_px(&at, &states[k]));
    let knots = rates.pressed.iter().zip(&moved_px).zip(&poses);
    let all: Vec<Covariance> = knots.map(of_pose).collect();
    Ok(covariances(KNOTS, &all))
}

/// Standard uncertainty of each coordinate of a dot due to its table, in parts of the dot's motion.
/// It is largest in the dimple.
fn table_part(dot_mm: [f64; 2], place_mm: [f64; 2]) -> f64 {
    2.5e-4_f64.hypot(1.5e-3 * near_tip(dot_mm, place_mm, 2.4))
}

/// The film at the knots of its covariance: by size, the smallest first, then line and place.
fn knot_states(at: &At, field: &Field<'_>, poses: &[Pose]) -> Result<Vec<Equilibrium>> {
    let places = poses.len() / usize::from(KNOTS[0]);
    let of_place = |place: usize| -> Result<Vec<Equilibrium>> {
        let mut states: Vec<Equilibrium> = Vec::new();
        for pose in poses.iter().skip(place).step_by(places) {
            let start = states.last().unwrap_or(&at.rest);
            let at_mm = at.film.material_point(&at.rest, pose.place_mm);
            states.push(match pose.size > 0.0 {
                true => at.film.press_force(at_mm, field.force_n(pose), start)?,
                false => at.rest.clone(),
            });
        }
        Ok(states)
    };
    let by_place = parallel::try_map(places, of_place)?;
    let of_size = |size: usize| by_place.iter().map(move |states| states[size].clone());
    Ok((0..usize::from(KNOTS[0])).flat_map(of_size).collect())
}
