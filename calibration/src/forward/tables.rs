//! Makes the tables of a forward model, from the simulated sensor.

use crate::parallel;
use anyhow::Result;
use hivtac_sensor::force::forward::{MOST_FUNCTIONS, MOST_TILTS};
use hivtac_sensor::force::model::TablesSpec;
use hivtac_twin::film::reduced::{LARGEST_SIZE, LARGEST_TILT, LINEAR_N, Pose, Terms, Unit};
use hivtac_twin::film::{Film, MAX_PLACE_MM};
use hivtac_twin::{Camera, Disc, Load};

use super::functions::{Sampled, compressed};
use super::least_squares::LeastSquares;

/// Places of the tip along an axis at which the simulated film's tables hold a marker's motion, mm.
/// For a marker to the right of the middle, or below it; closer together near the marker.
const FILM_NODES_MM: [f64; 16] = [
    -5.0, -3.8, -2.5, -1.4, 0.0, 0.7, 1.4, 2.0, 2.5, 2.9, 3.2, 3.5, 3.8, 4.1, 4.5, 5.0,
];
/// Distance from the marker, mm, at which the spacing of other nodes is twice that at the marker.
/// The spacing grows with the distance.
const TWICE_MM: f64 = 2.0;
/// Number of powers of size in the terms without tilt, of its first degree, and higher degrees.
const TERMS: [u8; MOST_TILTS] = [8, 6, 5, 4, 3];
/// The error allowed to functions of size and tilt, root mean square, focal lengths: 0.0022 px at
/// 320×240.
const LEFT: f64 = 0.0022 / 175.0;
/// Samples of the largest tilt weigh less than those without tilt by this factor plus one.
const STEEP_COUNTS_LESS: f64 = 12.0;
/// Keeps loads within the film's own limits, in spite of rounding.
const WITHIN: f64 = 1.0 - 1e-6;

/// A film under a tip of a radius, as a camera sees it.
pub struct UnitSetup<'a> {
    /// The unit's film.
    pub unit: Unit,
    /// The tip's radius, mm.
    pub tip_radius_mm: f64,
    /// The camera. Tables are in focal lengths and hold for every camera with its lens.
    pub camera: &'a Camera,
}

impl UnitSetup<'_> {
    /// Motion of a marker's image under a load, focal lengths.
    pub fn moved(&self, film: &Film, pose: &Pose, marker: usize) -> Result<[f64; 2]> {
        self.moved_by(film, &self.load(pose)?, marker)
    }

    /// The same for a load given by its force.
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

    /// Whether the camera sees a marker whole, and not its edge, under a load.
    pub fn sees(&self, film: &Film, load: &Load, marker: usize) -> bool {
        let disc = Disc::marker(film.markers_mm()[marker]);
        let [x, y] = disc.centre_mm;
        let motion = film.marker_motion(load, marker);
        disc.is_seen(|[px, py]| motion.at([px - x, py - y]), self.camera)
    }

    /// The load of a pose.
    pub fn load(&self, pose: &Pose) -> Result<Load> {
        let force_n = self.force_n(pose);
        Ok(Load::from_vector(force_n.map(|part| WITHIN * part))?
            .with_offset_mm(pose.place_mm)?
            .with_tip_radius_mm(self.tip_radius_mm)?)
    }

    /// The force of a pose on this unit's film, N.
    fn force_n(&self, pose: &Pose) -> [f64; 3] {
        let [linear_n, cubic_n] = self.stiffness_n();
        let magnitude_n = linear_n * pose.size + cubic_n * pose.size * pose.size * pose.size;
        pose.direction().map(|part| magnitude_n * part)
    }

    /// Coefficients a and b, N, of |F| = a·s + b·s³ at a size s.
    pub fn stiffness_n(&self) -> [f64; 2] {
        let Unit {
            stiffness,
            thickness,
            ..
        } = self.unit;
        let stretching = stiffness * thickness;
        [LINEAR_N * stretching * thickness * thickness, stretching]
    }

    /// Tables of all markers' motion, and their error, focal lengths.
    ///
    /// # Errors
    /// When the unit is invalid, or its motion does not fit into tables.
    pub fn tables(&self) -> Result<(TablesSpec, f64)> {
        let film = Film::of(self.unit)?;
        let dots = film.markers_mm().array::<4>().map(Dot::of_film);
        let moved = |pose: &Pose, dot| self.moved(&film, pose, dot);
        tables(&dots, moved, MOST_FUNCTIONS, 0.0)
    }
}

/// A marker for which a table is made.
#[derive(Clone, Debug, PartialEq)]
pub struct Dot {
    /// Where it is at rest, mm.
    pub place_mm: [f64; 2],
    /// Places of the tip along x and along y at which its motion is sampled, mm, ascending.
    pub nodes_mm: [Vec<f64>; 2],
    /// Unit vector along which it sees the first part of a tilt.
    pub away: [f64; 2],
}

impl Dot {
    /// At a place, with `count` nodes (6 to 20) along each axis, closer together near it.
    pub fn new(place_mm: [f64; 2], count: usize) -> Dot {
        Dot {
            place_mm,
            nodes_mm: place_mm.map(|part| nodes_near(part, count, MAX_PLACE_MM, TWICE_MM)),
            away: from_middle(place_mm),
        }
    }

    /// As [`Dot::new`], for tips within ±`last_mm` along each axis. At `twice_mm` from the place,
    /// nodes are twice as far apart as there. All such dots see tilts along the film's axes, so
    /// that a chip computes the functions of a load once for all.
    pub fn within(place_mm: [f64; 2], count: usize, last_mm: f64, twice_mm: f64) -> Dot {
        Dot {
            place_mm,
            nodes_mm: place_mm.map(|part| nodes_near(part, count, last_mm, twice_mm)),
            away: [1.0, 0.0],
        }
    }

    /// With the nodes of the simulated film's own tables.
    fn of_film(place_mm: [f64; 2]) -> Dot {
        let nodes = |part: f64| {
            let mut nodes = FILM_NODES_MM;
            if part < 0.0 {
                nodes.reverse();
                nodes = nodes.map(|node| -node);
            }
            nodes.to_vec()
        };
        Dot {
            place_mm,
            nodes_mm: place_mm.map(nodes),
            away: from_middle(place_mm),
        }
    }
}

/// Unit vector from the film's middle; along x in the middle.
fn from_middle([x, y]: [f64; 2]) -> [f64; 2] {
    let far = libm::hypot(x, y);
    match far > 0.0 {
        true => [x / far, y / far],
        false => [1.0, 0.0],
    }
}

/// Nodes within ±`last_mm`, with even steps of a measure that is densest at a place; at
/// `twice_mm` from there, the spacing is twice as large.
fn nodes_near(place_mm: f64, count: usize, last_mm: f64, twice_mm: f64) -> Vec<f64> {
    let measure = |at_mm: f64| {
        let far = (at_mm - place_mm).abs() / twice_mm;
        libm::log1p(far).copysign(at_mm - place_mm)
    };
    let (last, [from, to]) = (count - 1, [-last_mm, last_mm].map(measure));
    let at = |k: usize| match k {
        0 => -last_mm,
        k if k == last => last_mm,
        k => {
            let measure = from + (to - from) * k as f64 / last as f64;
            place_mm + (twice_mm * libm::expm1(measure.abs())).copysign(measure)
        }
    };
    (0..count).map(at).collect()
}

/// The tables of markers whose image motion under a load is `moved`, by marker number, focal
/// lengths. They have at most `most` functions. Also their error, root mean square over loads and
/// places, focal lengths. Among those, loads of the largest tilt weigh less than those without by a
/// factor of 1 + `steep`.
///
/// # Errors
/// When a sample cannot be computed, or the tables cannot hold the motion.
pub fn tables(
    dots: &[Dot],
    moved: impl Fn(&Pose, usize) -> Result<[f64; 2]> + Sync,
    most: usize,
    steep: f64,
) -> Result<(TablesSpec, f64)> {
    let samples = samples(dots, moved, TERMS)?;
    compressed(TERMS, &samples, LEFT, most, steep)
}

/// The coefficients of terms at the nodes of each marker.
fn samples(
    dots: &[Dot],
    moved: impl Fn(&Pose, usize) -> Result<[f64; 2]> + Sync,
    sizes: [u8; MOST_TILTS],
) -> Result<Vec<Sampled>> {
    let (terms, loads) = (Terms::with_sizes(sizes), loads());
    let weighted_row = |pose: &Pose| -> Vec<f64> {
        let [values, ..] = terms.rows(pose);
        values.into_iter().map(|part| weight(pose) * part).collect()
    };
    let rows: Vec<Vec<f64>> = loads.iter().map(weighted_row).collect();
    let least_squares = LeastSquares::new(&rows)?;
    let sampled = |(number, dot): (usize, &Dot)| -> Result<Sampled> {
        let away = dot.away;
        let at = |place_mm: [f64; 2]| -> Result<[Vec<f64>; 2]> {
            let seen = loads.iter().map(|pose| {
                let tilt = turned(away, pose.tilt);
                let pose = Pose {
                    tilt,
                    place_mm,
                    ..*pose
                };
                moved(&pose, number)
            });
            let seen: Vec<[f64; 2]> = seen.collect::<Result<_>>()?;
            Ok([0, 1].map(|output| {
                let samples = seen.iter().zip(&loads);
                let samples = samples.map(|(moved, pose)| weight(pose) * moved[output]);
                least_squares.coefficients(&samples.collect::<Vec<f64>>())
            }))
        };
        let [along_x, along_y] = &dot.nodes_mm;
        let line = |y: &f64| along_x.iter().map(|x| at([*x, *y])).collect();
        Ok(Sampled {
            nodes_mm: dot.nodes_mm.clone(),
            away,
            coefficients: parallel::try_map(along_y.len(), |k| line(&along_y[k]))?,
        })
    };
    let sampled = dots.iter().enumerate().map(sampled);
    sampled.collect()
}

/// (a + ib)·(x + iy).
pub fn turned([a, b]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    [a * x - b * y, b * x + a * y]
}

/// Weight of a sample: larger at little tilt, where most presses are.
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
