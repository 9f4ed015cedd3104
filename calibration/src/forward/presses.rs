//! A film that is pressed at a few places, and what its dots do at a distance from there.
//!
//! What a contact changes depends on where it is from a dot, and hardly on where it is on the film.
//! So what the film does at a distance from the contact is interpolated between these places.

use std::f64::consts::TAU;

use anyhow::Result;
use hivtac_shell::{Design, Equilibrium, Film};
use hivtac_twin::film::reduced::{LARGEST_SIZE, NOMINAL_RADIUS_MM, Unit};
use hivtac_twin::{Camera, Disc, Preset};

use super::{UnitSetup, in_focal_lengths};
use crate::parallel;

/// Knots along each axis of a table, and its largest place, mm.
pub const KNOTS: u8 = 11;
pub const END_MM: f64 = 5.5;
/// Places along an axis at which the film is pressed, mm.
const PLACES_MM: [f64; 3] = [0.0, 2.1, 4.2];
/// Roots of the sizes, in parts of the largest.
pub const ROOTS: [f64; 4] = [0.6, 0.75, 0.9, 1.0];
/// Points of a dot's rim, for dots that the camera sees from their edge.
const RIM_POINTS: usize = 12;

/// A film under several contacts of each size at the places of an octant.
pub struct Presses {
    film: Film,
    /// By place along x, along y (at most that along x), size, and contact.
    states: Vec<Vec<Vec<Equilibrium>>>,
    /// The number of each contact's mirror image in the diagonal x = y.
    exchanged: Vec<usize>,
}

/// The image of a dot, focal lengths from the axis.
pub struct Image {
    /// The centroid of its image; `None` if the camera sees it from its edge.
    centroid: Option<[f64; 2]>,
    /// The mean of the images of its rim.
    mean: [f64; 2],
}

impl Image {
    fn of(disc: &Disc, moved: impl Fn([f64; 2]) -> [f64; 3] + Copy, camera: &Camera) -> Image {
        let point = |ray: usize| {
            let (sin, cos) = libm::sincos(TAU * ray as f64 / RIM_POINTS as f64);
            let [x, y] = disc.centre_mm;
            let at_mm = [x + disc.radius_mm * cos, y + disc.radius_mm * sin];
            let [dx, dy, dz] = moved(at_mm);
            let seen_px = camera.project([at_mm[0] + dx, at_mm[1] + dy, dz]);
            in_focal_lengths(seen_px, camera)
        };
        let mean = (0..RIM_POINTS).map(point).fold([0.0; 2], |sum, [x, y]| {
            [
                sum[0] + x / RIM_POINTS as f64,
                sum[1] + y / RIM_POINTS as f64,
            ]
        });
        let is_seen = disc.is_seen(moved, camera);
        let centroid = || in_focal_lengths(disc.centroid_px(moved, camera), camera);
        Image {
            centroid: is_seen.then(centroid),
            mean,
        }
    }

    /// The motion to another image.
    pub fn to(&self, other: &Image) -> [f64; 2] {
        let ends = self.centroid.zip(other.centroid);
        let (from, to) = ends.unwrap_or((self.mean, other.mean));
        [0, 1].map(|way| to[way] - from[way])
    }
}

/// The number of a place of the octant.
fn in_octant([i, j]: [usize; 2]) -> usize {
    i * (i + 1) / 2 + j
}

impl Presses {
    /// Solves the film with a mesh of this fineness. `at` returns its states at a place, mm, by
    /// size and contact.
    ///
    /// # Errors
    /// When the film finds no equilibrium.
    pub fn solve(
        fineness: f64,
        exchanged: Vec<usize>,
        at: impl Fn(&Film, [f64; 2]) -> Result<Vec<Vec<Equilibrium>>> + Sync,
    ) -> Result<Presses> {
        let design = Design {
            fineness,
            ..Design::default()
        };
        let octant: Vec<[usize; 2]> = (0..PLACES_MM.len())
            .flat_map(|i| (0..=i).map(move |j| [i, j]))
            .collect();
        let solved = |number: usize| {
            // Threads that share a film wait for its factors.
            let film = Film::new(&design)?;
            at(&film, octant[number].map(|k| PLACES_MM[k]))
        };
        Ok(Presses {
            states: parallel::try_map(octant.len(), solved)?,
            film: Film::new(&design)?,
            exchanged,
        })
    }

    /// Images of the dots under a contact of a size, by their numbers, at a place along +x and +y.
    pub fn seen(
        &self,
        place_mm: [f64; 2],
        (size, contact): (usize, usize),
        discs: &[Disc],
        camera: &Camera,
    ) -> Vec<Image> {
        let [along_x, along_y] = place_mm.map(weights);
        let moved = |rest_mm: [f64; 2]| {
            let off_mm = [0, 1].map(|way| rest_mm[way] - place_mm[way]);
            let mut sum = [0.0; 3];
            for (i, of_x) in along_x.into_iter().enumerate() {
                for (j, of_y) in along_y.into_iter().enumerate() {
                    let there = self.at([i, j], (size, contact), off_mm);
                    for (sum, part) in sum.iter_mut().zip(there) {
                        *sum += of_x * of_y * part;
                    }
                }
            }
            sum
        };
        let image = |disc: &Disc| Image::of(disc, moved, camera);
        discs.iter().map(image).collect()
    }

    /// The displacement at a distance from a contact at a place.
    fn at(
        &self,
        [i, j]: [usize; 2],
        (size, contact): (usize, usize),
        [x, y]: [f64; 2],
    ) -> [f64; 3] {
        let (place, off_mm, is_exchanged) = match i >= j {
            true => ([i, j], [x, y], false),
            false => ([j, i], [y, x], true),
        };
        let number = match is_exchanged {
            true => self.exchanged[contact],
            false => contact,
        };
        let state = &self.states[in_octant(place)][size][number];
        let point = [0, 1].map(|way| PLACES_MM[place[way]] + off_mm[way]);
        let [x, y, z] = self.film.displacement(state, point);
        match is_exchanged {
            true => [y, x, z],
            false => [x, y, z],
        }
    }
}

/// The weights of [`PLACES_MM`] in a parabola through them; beyond the last, those there.
fn weights(at_mm: f64) -> [f64; 3] {
    let [a, b, c] = PLACES_MM;
    let x = at_mm.min(c);
    [
        (x - b) * (x - c) / ((a - b) * (a - c)),
        (x - a) * (x - c) / ((b - a) * (b - c)),
        (x - a) * (x - b) / ((c - a) * (c - b)),
    ]
}

/// The straight force, N, of each of the [sizes](ROOTS) on the nominal film.
pub fn forces_n() -> Result<[[f64; 3]; ROOTS.len()]> {
    let camera = Camera::new(Preset::Ov7725, 320, 240)?;
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm: NOMINAL_RADIUS_MM,
        camera: &camera,
    };
    let [linear_n, cubic_n] = setup.stiffness_n();
    Ok(ROOTS.map(|root| {
        let size = LARGEST_SIZE * root.powi(2);
        [0.0, 0.0, -size * (linear_n + cubic_n * size.powi(2))]
    }))
}
