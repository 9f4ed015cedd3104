//! Where a camera sees the dots of a film that finite elements solve, and how that answers to
//! changes.

use std::f64::consts::PI;

use hivtac_scene::{Camera, Disc};
use hivtac_shell::{Equilibrium, Film, Response};

/// Rays and rings of the points over which a rate is averaged: Gauss's two rings, each half of a
/// disc's area.
const RAYS: usize = 6;
const RINGS: [f64; 2] = [0.459_700_843_380_983_1, 0.888_073_833_977_115_3];
/// Steps by which images are differentiated, mm.
const STEP_MM: f64 = 1e-3;

/// A film before a camera.
pub struct View<'a> {
    pub film: &'a Film,
    /// Its images count in focal lengths from the axis.
    pub camera: &'a Camera,
    /// How much farther than nominal the film is from the camera, mm.
    pub farther_mm: f64,
}

impl View<'_> {
    /// Where a dot with its centre at a point of the film is seen, focal lengths from the axis.
    pub fn image(&self, state: &Equilibrium, dot_mm: [f64; 2]) -> [f64; 2] {
        self.image_of(|point| self.film.displacement(state, point), dot_mm)
    }

    /// The same on a film whose points, mm, are displaced so.
    pub fn image_of(
        &self,
        displaced: impl Fn([f64; 2]) -> [f64; 3],
        dot_mm: [f64; 2],
    ) -> [f64; 2] {
        let disc = Disc::marker(dot_mm);
        let moved = |point: [f64; 2]| {
            let [x, y, z] = displaced(point);
            [x, y, z + self.farther_mm]
        };
        self.in_focal_lengths(disc.centroid_px(moved, self.camera))
    }

    fn in_focal_lengths(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [axis_x, axis_y] =
            [self.camera.width(), self.camera.height()].map(|side| (f64::from(side) - 1.0) / 2.0);
        [x - axis_x, y - axis_y].map(|part| part / self.camera.focal_px())
    }

    /// How the image of a dot answers to the film's responses, focal lengths per unit.
    pub fn rates(
        &self,
        state: &Equilibrium,
        responses: &[Response],
        dot_mm: [f64; 2],
    ) -> Vec<[f64; 2]> {
        let lens = self.lens_at(|point| self.film.displacement(state, point), dot_mm);
        let rate = |response: &Response| {
            let moved = mean(dot_mm, |point| {
                self.film.surface_rate(state, response, point)
            });
            seen_through(&lens, moved)
        };
        responses.iter().map(rate).collect()
    }

    /// How the image of a dot answers to its motion on a film whose points are displaced so, focal
    /// lengths per mm.
    pub fn lens_at(
        &self,
        displaced: impl Fn([f64; 2]) -> [f64; 3],
        dot_mm: [f64; 2],
    ) -> [[f64; 3]; 2] {
        let [x, y, z] = mean(dot_mm, displaced);
        self.lens([dot_mm[0] + x, dot_mm[1] + y, z + self.farther_mm])
    }

    /// The derivative of a point's image by the point, focal lengths per mm.
    fn lens(&self, point_mm: [f64; 3]) -> [[f64; 3]; 2] {
        let mut lens = [[0.0; 3]; 2];
        for axis in 0..3 {
            let [back, forth] = [-STEP_MM, STEP_MM].map(|step| {
                let mut there = point_mm;
                there[axis] += step;
                self.in_focal_lengths(self.camera.project(there))
            });
            for (row, (a, b)) in lens.iter_mut().zip(back.into_iter().zip(forth)) {
                row[axis] = (b - a) / (2.0 * STEP_MM);
            }
        }
        lens
    }
}

/// A motion, mm, through a lens's derivatives.
pub fn seen_through(lens: &[[f64; 3]; 2], [x, y, z]: [f64; 3]) -> [f64; 2] {
    lens.map(|row| row[0] * x + row[1] * y + row[2] * z)
}

/// The mean of vectors over a dot.
pub fn mean(dot_mm: [f64; 2], of: impl Fn([f64; 2]) -> [f64; 3]) -> [f64; 3] {
    let points = points(dot_mm);
    let mut sum = [0.0; 3];
    for point in &points {
        for (sum, part) in sum.iter_mut().zip(of(*point)) {
            *sum += part / points.len() as f64;
        }
    }
    sum
}

/// Points of a dot.
fn points([x, y]: [f64; 2]) -> Vec<[f64; 2]> {
    let radius_mm = Disc::marker([x, y]).radius_mm;
    let ring = |part: f64| {
        (0..RAYS).map(move |ray| {
            let (sin, cos) = libm::sincos(2.0 * PI * ray as f64 / RAYS as f64);
            [
                x + part * radius_mm * cos,
                y + part * radius_mm * sin,
            ]
        })
    };
    RINGS.into_iter().flat_map(ring).collect()
}
