//! The tables of a film run forwards, from the simulated sensor.

use anyhow::Result;
use hivtac_film::reduced::{Axis, LARGEST_SIZE, LARGEST_TILT, LINEAR_N, Pose, Terms, Unit};
use hivtac_film::{Film, MAX_PLACE_MM};
use hivtac_scene::{Camera, Disc, Load};
use hivtac_sensing::forward::MOST_TILTS;
use hivtac_sensing::model::TableSpec;
use rayon::prelude::*;

use super::nearest::{Nearest, splines};

/// Places of the tip at which marker 2's motion is known, along x and along y, mm: close where the
/// marker is.
const NODES_MM: [f64; 16] = [
    -5.0, -3.8, -2.5, -1.4, 0.0, 0.7, 1.4, 2.0, 2.5, 2.9, 3.2, 3.5, 3.8, 4.1, 4.5, 5.0,
];
/// Those at which it is known what gluing does, mm.
const BESIDE_NODES_MM: [f64; 11] = [-5.0, -3.8, -2.5, -1.4, 0.0, 1.4, 2.5, 3.2, 3.8, 4.5, 5.0];
/// Those at which it is known what else one unit does, mm.
const OWN_NODES_MM: [f64; 9] = [-5.0, -3.8, -2.6, -1.3, 0.0, 1.3, 2.6, 3.8, 5.0];
/// How many sizes there are without tilt, with its first degree, and so on.
const TERMS: [u8; MOST_TILTS] = [8, 6, 5, 4, 3];
const BESIDE_TERMS: [u8; MOST_TILTS] = [5, 4, 3, 2, 0];
const OWN_TERMS: [u8; MOST_TILTS] = [4, 3, 2, 0, 0];
/// How far a marker is glued beside its place to see what that does, mm.
const STEP_MM: f64 = 0.15;
/// How much less samples of the largest tilt count than those of none, less one.
const STEEP_COUNTS_LESS: f64 = 12.0;
/// Loads lie within the film's own limits, to a rounding.
const WITHIN: f64 = 1.0 - 1e-6;

/// A film under a tip of a radius, and how a camera sees it.
pub struct UnitSetup<'a> {
    /// The unit's film.
    pub unit: Unit,
    /// The tip's radius, mm.
    pub tip_radius_mm: f64,
    /// The camera: its tables are in focal lengths and hold for every camera of its lens.
    pub camera: &'a Camera,
}

impl UnitSetup<'_> {
    /// How the image of a marker moves under a load, in focal lengths.
    pub fn moved(&self, film: &Film, pose: &Pose, marker: usize) -> Result<[f64; 2]> {
        let force_n = self.force_n(pose);
        let load = Load::from_vector(force_n.map(|part| WITHIN * part))?
            .with_offset_mm(pose.place_mm)?
            .with_tip_radius_mm(self.tip_radius_mm)?;
        self.moved_by(film, &load, marker)
    }

    /// The same under a load that says its force.
    pub fn moved_by(&self, film: &Film, load: &Load, marker: usize) -> Result<[f64; 2]> {
        let disc = Disc::marker(film.markers_mm()[marker]);
        let motion = film.marker_motion(load, marker);
        let [x, y] = disc.centre_mm;
        let moved = |rest: [f64; 2]| motion.at([rest[0] - x, rest[1] - y]);
        let there = disc.centroid_px(moved, self.camera);
        let here = disc.centroid_px(|_| [0.0; 3], self.camera);
        let focal_px = self.camera.focal_px();
        Ok([0, 1].map(|i| (there[i] - here[i]) / focal_px))
    }

    /// The film with its markers glued so far beside their places, mm.
    fn film(&self, markers_mm: [[f64; 2]; 4]) -> Result<Film> {
        Ok(Film::of(Unit {
            markers_mm,
            ..self.unit
        })?)
    }

    /// The force of a pose on this unit's film, N.
    fn force_n(&self, pose: &Pose) -> [f64; 3] {
        let [linear_n, cubic_n] = self.stiffness_n();
        let magnitude_n = linear_n * pose.size + cubic_n * pose.size * pose.size * pose.size;
        pose.direction().map(|part| magnitude_n * part)
    }

    /// |F| = a·s + b·s³ of a size s: a and b, N.
    pub fn stiffness_n(&self) -> [f64; 2] {
        let Unit {
            stiffness,
            thickness,
            ..
        } = self.unit;
        let stretching = stiffness * thickness;
        [LINEAR_N * stretching * thickness * thickness, stretching]
    }

    /// How marker 2 moves along x on a film whose posts and markers are where they should be.
    pub fn moved_table(&self) -> Result<TableSpec> {
        let even = UnitSetup {
            unit: self.even(),
            ..*self
        };
        let film = even.film([[0.0; 2]; 4])?;
        table(&NODES_MM, TERMS, |pose| {
            Ok(vec![even.moved(&film, pose, 2)?[0]])
        })
    }

    /// What gluing it beside its place along x and along y does to that, per mm, when the tip is as
    /// far beside its own.
    pub fn beside_table(&self) -> Result<TableSpec> {
        let even = UnitSetup {
            unit: self.even(),
            ..*self
        };
        let glued = |axis: usize, step: f64| {
            let mut markers_mm = [[0.0; 2]; 4];
            markers_mm[2][axis] = step;
            even.film(markers_mm)
        };
        let mut films = Vec::new();
        for axis in [0, 1] {
            films.push([glued(axis, -STEP_MM)?, glued(axis, STEP_MM)?]);
        }
        table(&BESIDE_NODES_MM, BESIDE_TERMS, |pose| {
            let mut slopes = Vec::new();
            for (axis, [back, forth]) in films.iter().enumerate() {
                let beside = |film: &Film, step: f64| {
                    let mut beside = *pose;
                    let inside = MAX_PLACE_MM - STEP_MM;
                    let place_mm = &mut beside.place_mm[axis];
                    *place_mm = place_mm.clamp(-inside, inside) + step;
                    even.moved(film, &beside, 2)
                };
                let (back, forth) = (beside(back, -STEP_MM)?, beside(forth, STEP_MM)?);
                slopes.push((forth[0] - back[0]) / (2.0 * STEP_MM));
            }
            Ok(slopes)
        })
    }

    /// What the unit's markers do beside what the first two tables say: x and y of markers 0–3, by
    /// what these say of a pose.
    pub fn own_table(&self, told: impl Fn(&Pose) -> [f64; 8] + Sync) -> Result<TableSpec> {
        let film = self.film(self.unit.markers_mm)?;
        table(&OWN_NODES_MM, OWN_TERMS, |pose| {
            let told = told(pose);
            let mut more = Vec::new();
            for marker in 0..4 {
                let moved = self.moved(&film, pose, marker)?;
                more.extend([0, 1].map(|axis| moved[axis] - told[2 * marker + axis]));
            }
            Ok(more)
        })
    }

    /// The unit without what makes its film uneven.
    fn even(&self) -> Unit {
        Unit {
            posts_mm: [[0.0; 2]; 4],
            markers_mm: [[0.0; 2]; 4],
            ..self.unit
        }
    }
}

/// A table of what is seen at every node, at loads that tell all terms apart.
fn table(
    nodes_mm: &[f64],
    sizes: [u8; MOST_TILTS],
    seen: impl Fn(&Pose) -> Result<Vec<f64>> + Sync,
) -> Result<TableSpec> {
    let (axis, terms) = (Axis::new(nodes_mm), Terms::with_sizes(sizes));
    let loads = loads();
    let weighted_row = |pose: &Pose| -> Vec<f64> {
        let [values, ..] = terms.rows(pose);
        values.into_iter().map(|part| weight(pose) * part).collect()
    };
    let rows: Vec<Vec<f64>> = loads.iter().map(weighted_row).collect();
    let nearest = Nearest::new(&rows)?;
    let at = |place_mm: [f64; 2]| -> Result<Vec<f64>> {
        let seen = loads.iter().map(|pose| seen(&Pose { place_mm, ..*pose }));
        let seen: Vec<Vec<f64>> = seen.collect::<Result<_>>()?;
        let of_output = |output: usize| {
            let samples = seen.iter().zip(&loads);
            let samples = samples.map(|(outputs, pose)| weight(pose) * outputs[output]);
            let samples: Vec<f64> = samples.collect();
            nearest.coefficients(&samples)
        };
        Ok((0..seen[0].len()).flat_map(of_output).collect())
    };
    let line = |y: &f64| nodes_mm.iter().map(|x| at([*x, *y])).collect::<Result<_>>();
    let rows = nodes_mm
        .par_iter()
        .map(line)
        .collect::<Result<Vec<Vec<_>>>>()?;
    Ok(TableSpec {
        nodes_mm: nodes_mm.iter().map(|node| *node as f32).collect(),
        terms: sizes,
        coefficients: splines(&axis, &rows)?
            .into_iter()
            .flatten()
            .flatten()
            .collect(),
    })
}

/// What a sample counts: those of little tilt more, as most presses have.
fn weight(pose: &Pose) -> f64 {
    let [a, b] = pose.tilt.map(|part| part / LARGEST_TILT);
    1.0 / (1.0 + STEEP_COUNTS_LESS * (a * a + b * b))
}

/// Ten sizes, dense at both ends, each with tilts on three rings.
fn loads() -> Vec<Pose> {
    let mut loads = Vec::new();
    for i in 0..10 {
        let turned = f64::from(i) + 0.5;
        let size = LARGEST_SIZE * (1.0 + libm::cos(std::f64::consts::PI * turned / 10.0)) / 2.0;
        let mut push = |tilt| {
            loads.push(Pose {
                size,
                tilt,
                place_mm: [0.0; 2],
            });
        };
        push([0.0; 2]);
        for (ring, count) in [(0.35, 6), (0.7, 8), (1.0, 12)] {
            for k in 0..count {
                let turn = (f64::from(k) + 0.3 * f64::from(i)) / f64::from(count);
                let (sin, cos) = libm::sincos(2.0 * std::f64::consts::PI * turn);
                push([ring * LARGEST_TILT * cos, ring * LARGEST_TILT * sin]);
            }
        }
    }
    loads
}
