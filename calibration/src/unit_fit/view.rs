//! Computes images of the dots of a film that finite elements solve, and their rates by changes of
//! the film.

use std::f64::consts::PI;

use hivtac_shell::{Equilibrium, Film, Response};
use hivtac_twin::{Camera, Disc};

use crate::forward::in_focal_lengths;

/// Points on a ring within a dot over which a rate is averaged, and the ring's radius in parts of
/// the dot's. Their mean equals the disc's for polynomials to the third degree.
const RAYS: usize = 6;
const RING: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Points of a dot's rim at which its displacement is computed; between them it is a sum of waves.
const RIM: usize = 12;
/// Steps by which images are differentiated, mm.
const STEP_MM: f64 = 1e-3;

/// A film in front of a camera.
pub struct View<'a> {
    pub film: &'a Film,
    /// Images are in its focal lengths, from the axis.
    pub camera: &'a Camera,
    /// Distance of the film from the camera beyond the nominal one, mm.
    pub farther_mm: f64,
}

impl View<'_> {
    /// Image of a dot with its centre at a point of the film, focal lengths from the axis.
    pub fn image(&self, state: &Equilibrium, dot_mm: [f64; 2]) -> [f64; 2] {
        self.image_of(&Rim::of(dot_mm, |point| {
            self.film.displacement(state, point)
        }))
    }

    /// Images of all dots.
    pub fn images(&self, state: &Equilibrium, dots_mm: &[[f64; 2]]) -> Vec<[f64; 2]> {
        dots_mm.iter().map(|dot| self.image(state, *dot)).collect()
    }

    /// Image of a dot with a displaced rim.
    pub fn image_of(&self, rim: &Rim) -> [f64; 2] {
        let moved = |point: [f64; 2]| {
            let [x, y, z] = rim.at(point);
            [x, y, z + self.farther_mm]
        };
        in_focal_lengths(rim.disc.centroid_px(moved, self.camera), self.camera)
    }

    /// Derivatives of a dot's image by the film's responses, focal lengths per unit.
    pub fn rates(
        &self,
        state: &Equilibrium,
        responses: &[Response],
        dot_mm: [f64; 2],
    ) -> Vec<[f64; 2]> {
        let [x, y, z] = mean(dot_mm, |point| self.film.displacement(state, point));
        let lens = self.lens([dot_mm[0] + x, dot_mm[1] + y, z + self.farther_mm]);
        let rate = |response: &Response| {
            let [x, y, z] = mean(dot_mm, |point| {
                self.film.surface_rate(state, response, point)
            });
            lens.map(|row| row[0] * x + row[1] * y + row[2] * z)
        };
        responses.iter().map(rate).collect()
    }

    /// The derivative of a point's image by the point, focal lengths per mm.
    fn lens(&self, point_mm: [f64; 3]) -> [[f64; 3]; 2] {
        let mut lens = [[0.0; 3]; 2];
        for axis in 0..3 {
            let [back, forth] = [-STEP_MM, STEP_MM].map(|step| {
                let mut there = point_mm;
                there[axis] += step;
                in_focal_lengths(self.camera.project(there), self.camera)
            });
            for (row, (a, b)) in lens.iter_mut().zip(back.into_iter().zip(forth)) {
                row[axis] = (b - a) / (2.0 * STEP_MM);
            }
        }
        lens
    }
}

/// The mean of vectors over a dot.
fn mean(dot_mm: [f64; 2], of: impl Fn([f64; 2]) -> [f64; 3]) -> [f64; 3] {
    let points = points(dot_mm);
    let mut sum = [0.0; 3];
    for point in &points {
        for (sum, part) in sum.iter_mut().zip(of(*point)) {
            *sum += part / points.len() as f64;
        }
    }
    sum
}

/// The points of a dot over which rates are averaged.
fn points(dot_mm: [f64; 2]) -> [[f64; 2]; RAYS] {
    let disc = Disc::marker(dot_mm);
    std::array::from_fn(|ray| on_circle(&disc, RING, ray as f64 / RAYS as f64))
}

/// The point of a disc at a fraction of its radius and a fraction of the full turn.
fn on_circle(disc: &Disc, part: f64, turn: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(2.0 * PI * turn);
    let radius_mm = part * disc.radius_mm;
    [
        disc.centre_mm[0] + radius_mm * cos,
        disc.centre_mm[1] + radius_mm * sin,
    ]
}

/// Displacement of a dot's rim.
pub struct Rim {
    disc: Disc,
    /// By wave along the rim: coefficients of its cosine and its sine.
    waves: [[[f64; 3]; 2]; RIM / 2],
}

impl Rim {
    /// Of a dot with its centre at `dot_mm`, on a film with these displacements, mm.
    pub fn of(dot_mm: [f64; 2], displaced: impl Fn([f64; 2]) -> [f64; 3]) -> Rim {
        let disc = Disc::marker(dot_mm);
        let mut waves = [[[0.0; 3]; 2]; RIM / 2];
        for k in 0..RIM {
            let moved = displaced(on_circle(&disc, 1.0, k as f64 / RIM as f64));
            for (wave, parts) in waves.iter_mut().enumerate() {
                let angle = 2.0 * PI * (wave * k) as f64 / RIM as f64;
                let (sin, cos) = libm::sincos(angle);
                let scale = if wave == 0 { 1.0 } else { 2.0 } / RIM as f64;
                for c in 0..3 {
                    parts[0][c] += scale * cos * moved[c];
                    parts[1][c] += scale * sin * moved[c];
                }
            }
        }
        Rim { disc, waves }
    }

    /// This rim plus `units` times a rate.
    pub fn beside(&self, rate: &Rim, units: f64) -> Rim {
        let mut waves = self.waves;
        let sums = waves.as_flattened_mut().as_flattened_mut().iter_mut();
        for (sum, part) in sums.zip(rate.waves.as_flattened().as_flattened()) {
            *sum += units * part;
        }
        Rim {
            disc: self.disc,
            waves,
        }
    }

    /// Displacement of a point at or near the rim.
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [cx, cy] = self.disc.centre_mm;
        let (x, y) = (x - cx, y - cy);
        let radius = libm::hypot(x, y);
        let (cos, sin) = (x / radius, y / radius);
        // (cos wφ, sin wφ), one wave after the other.
        let mut turn = [1.0, 0.0];
        let mut sum = [0.0; 3];
        for parts in &self.waves {
            for (c, sum) in sum.iter_mut().enumerate() {
                *sum += turn[0] * parts[0][c] + turn[1] * parts[1][c];
            }
            turn = [turn[0] * cos - turn[1] * sin, turn[0] * sin + turn[1] * cos];
        }
        sum
    }
}
