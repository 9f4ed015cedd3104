//! Measures the sharpness of a marker's rim and the marker's width, from the mean profile of its
//! edge.

use std::f64::consts::TAU;

/// Number of rays from a marker's centre.
const RAYS: usize = 64;
/// Distance between two samples of a ray, px.
const STEP_PX: f64 = 0.1;
/// Length of a ray, in radii.
const REACH: f64 = 2.0;
/// The marker's level is measured inside this distance, the film's outside [`FILM`], in radii.
const CORE: f64 = 0.4;
/// See [`CORE`].
const FILM: f64 = 1.7;

/// A number for each pixel of a frame.
pub struct Field {
    width: usize,
    values: Vec<f64>,
}

impl Field {
    /// A field with rows of `width` numbers.
    pub fn new(width: u16, values: Vec<f64>) -> Field {
        Field {
            width: width.into(),
            values,
        }
    }

    /// The number at a point, interpolated between four pixels; the border's continue beyond it.
    fn at(&self, x: f64, y: f64) -> f64 {
        let rows = self.values.len() / self.width;
        let clamped = |at: f64, end: usize| at.clamp(0.0, (end - 1) as f64);
        let (x, y) = (clamped(x, self.width), clamped(y, rows));
        let pixel = |column: usize, row: usize| {
            self.values[row.min(rows - 1) * self.width + column.min(self.width - 1)]
        };
        let (column, row) = (x as usize, y as usize);
        let (right, down) = (x.fract(), y.fract());
        let along = |row| pixel(column, row) * (1.0 - right) + pixel(column + 1, row) * right;
        along(row) * (1.0 - down) + along(row + 1) * down
    }
}

/// The edge of a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Distance between 90 and 10 % of the way from the film's level to the marker's, px.
    pub rim_px: f64,
    /// Diameter of a disc with the area inside the half-way line, px.
    pub diameter_px: f64,
}

/// The edge of the marker at `centre`, whose mask has a radius of about `radius_px`. `None` if a
/// ray does not come half-way to the film's level.
pub fn edge(field: &Field, centre: [f64; 2], radius_px: f64) -> Option<Edge> {
    let rays: Vec<Vec<f64>> = (0..RAYS)
        .map(|ray| sample(field, centre, radius_px, ray))
        .collect();
    let levels = Levels::of(&rays)?;
    let rays: Vec<Vec<f64>> = rays.iter().map(|ray| levels.parts(ray)).collect();
    let halves: Option<Vec<usize>> = rays.iter().map(|ray| first_below(ray, 0.5)).collect();
    let halves = halves?;
    let profile = mean_profile(&rays, &halves)?;
    let at = |part: f64| crossing(&profile, part);
    let squares = halves.iter().map(|&half| (half as f64 * STEP_PX).powi(2));
    Some(Edge {
        rim_px: (at(0.1)? - at(0.9)?) * STEP_PX,
        diameter_px: 2.0 * (squares.sum::<f64>() / RAYS as f64).sqrt(),
    })
}

/// The numbers along a ray.
fn sample(field: &Field, [x, y]: [f64; 2], radius_px: f64, ray: usize) -> Vec<f64> {
    let (sin, cos) = (TAU * ray as f64 / RAYS as f64).sin_cos();
    let steps = (REACH * radius_px / STEP_PX) as usize;
    let distances = (0..steps).map(|step| step as f64 * STEP_PX);
    distances
        .map(|t| field.at(x + t * cos, y + t * sin))
        .collect()
}

/// The levels of marker and film.
struct Levels {
    marker: f64,
    film: f64,
}

impl Levels {
    fn of(rays: &[Vec<f64>]) -> Option<Levels> {
        let length = rays.first()?.len() as f64;
        let mean = |from: f64, to: f64| {
            let [from, to] = [from, to].map(|part| (part / REACH * length) as usize);
            let all: Vec<f64> = rays
                .iter()
                .flat_map(|ray| &ray[from..to])
                .copied()
                .collect();
            (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
        };
        let (marker, film) = (mean(0.0, CORE)?, mean(FILM, REACH)?);
        (marker != film).then_some(Levels { marker, film })
    }

    /// Each number's distance from the film's level, as a part of the way to the marker's.
    fn parts(&self, ray: &[f64]) -> Vec<f64> {
        let part = |level: &f64| (level - self.film) / (self.marker - self.film);
        ray.iter().map(part).collect()
    }
}

fn first_below(ray: &[f64], part: f64) -> Option<usize> {
    ray.iter().position(|value| *value < part)
}

/// The mean of the rays, each shifted to have its half-way point in the middle.
fn mean_profile(rays: &[Vec<f64>], halves: &[usize]) -> Option<Vec<f64>> {
    let inside = *halves.iter().min()?;
    let outside = rays
        .iter()
        .zip(halves)
        .map(|(ray, half)| ray.len() - half)
        .min()?;
    let mean = |at: usize| {
        let values = rays
            .iter()
            .zip(halves)
            .map(|(ray, half)| ray[half - inside + at]);
        values.sum::<f64>() / rays.len() as f64
    };
    Some((0..inside + outside).map(mean).collect())
}

/// The first point where a profile falls below a part, in steps.
fn crossing(profile: &[f64], part: f64) -> Option<f64> {
    let after = first_below(profile, part)?;
    let before = after.checked_sub(1)?;
    let (high, low) = (profile[before], profile[after]);
    Some(before as f64 + (high - part) / (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disc of radius 6.5 px with an edge like a normal distribution's, σ = `blur_px`.
    fn disc(blur_px: f64) -> Field {
        let level = |x: usize, y: usize| {
            let distance = (x as f64 - 30.3).hypot(y as f64 - 24.6) - 6.5;
            // The logistic curve with the same width from 10 to 90 %.
            30.0 + 100.0 / (1.0 + (distance * 2.0 * 9.0_f64.ln() / (2.563 * blur_px)).exp())
        };
        let pixels = (0..50 * 60).map(|index| level(index % 60, index / 60));
        Field::new(60, pixels.collect())
    }

    /// Interpolation between pixels blurs the edge by a triangle of two pixels, of variance 1/6.
    #[test]
    fn the_rim_is_as_wide_as_it_was_drawn() {
        for blur_px in [0.6, 0.8, 1.2, 1.6] {
            let edge = edge(&disc(blur_px), [30.3, 24.6], 7.0).unwrap();
            let expected = 2.563 * blur_px.hypot((1.0_f64 / 6.0).sqrt());
            assert!((edge.rim_px - expected).abs() < 0.1, "{blur_px}: {edge:?}");
            assert!((edge.diameter_px - 13.0).abs() < 0.2, "{edge:?}");
        }
    }

    #[test]
    fn without_a_marker_there_is_no_edge() {
        let even = Field::new(60, vec![30.0; 3000]);
        assert_eq!(edge(&even, [30.0, 25.0], 7.0), None);
    }

    /// A blob at the border or of no size does not cause a panic.
    #[test]
    fn any_centre_and_radius_is_taken() {
        for centre in [[0.0, 0.0], [59.0, 49.0], [-5.0, 70.0], [30.3, 24.6]] {
            for radius in [0.0, 0.05, 0.4, 7.0, 100.0] {
                let _ = edge(&disc(1.0), centre, radius);
            }
        }
    }
}
