//! The forward model, from the known numbers of a unit: a few numbers in a weights file, tables in
//! a model file.

mod contact_shapes;
mod contact_widths;
mod covariances;
mod coverage_scale;
mod dots;
mod functions;
mod layout_model;
mod least_squares;
mod matrix;
mod motions;
mod noise;
mod other_units;
pub mod pairs;
mod presses;
mod tables;
mod torques;
mod unit;
mod weight;

use std::sync::Mutex;

use anyhow::{Context, Result, anyhow, ensure};
use hivtac_sensor::force::forward::{self, Limits, MOST_STEPS, Markers, RestImage, Stiffness};
use hivtac_sensor::force::model::{ForwardSpec, TablesSpec, WeightSpec};
use hivtac_twin::film::reduced::{LARGEST_SIZE, LARGEST_TILT, NOMINAL_RADIUS_MM, Pose, Unit};
use hivtac_twin::film::{Dots, Film};
use hivtac_twin::{Camera, Disc, FILM_DISTANCE_MM, Load, Preset};
use serde::{Deserialize, Serialize};

use crate::data::conditions::layout;
use crate::unit_fit::OwnFilm;
use crate::weights::Weights;
pub use contact_shapes::contact_shapes;
pub use contact_widths::contact_widths;
pub use covariances::{Covariance, KNOTS, Moved, covariances, knots, sum_of_squares};
use covariances::{OF_FOUR, even};
pub use dots::of_layout;
pub use functions::{Sampled, compressed};
use layout_model::UNMEASURED_PX;
pub use layout_model::{layout_model, layout_scene, layout_weights, rest_of, untared};
pub(crate) use least_squares::{LeastSquares, dot};
pub(crate) use matrix::eigenvectors;
pub use matrix::{Matrix, cholesky};
pub use motions::MotionsSpec;
pub use noise::Noise;
pub use other_units::OtherUnits;
pub use tables::{Dot, UnitSetup, tables};
pub use torques::torques;
pub use unit::Known;
pub use weight::{Pressed, Weighed, everywhere, weight};

/// A unit's film and camera, as far as known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmModel {
    /// Gauss–Newton steps from the network's answer, 0–3.
    pub steps: u8,
    /// Rest position as a tare measures it, minus where each marker rests, px: the pixel grid's
    /// effect.
    pub rest_px: Dots<[f64; 2]>,
    /// Standard uncertainty of a marker in a frame, px, while it is as large as at rest: away from
    /// the pattern's middle, and across that direction.
    pub noise_px: [f64; 2],
    /// Factor on it when the marker's area is four times that at rest.
    pub noise_at_four_areas: [f64; 2],
    /// Standard uncertainty of each coordinate of a marker due to the chip's tables under the
    /// largest force, px at 320×240. It falls in proportion to size under smaller forces.
    #[serde(default)]
    pub beside_px: f64,
    /// How other units' films differ.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub others: Option<Box<OtherUnits>>,
    /// The unit's own film. Without it the film is the nominal one, with the markers where the rest
    /// picture shows them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own: Option<Box<OwnFilm>>,
}

impl Weights {
    /// These weights, their film extended by how other units' films differ.
    ///
    /// # Errors
    /// As [`FilmModel::with_others`]; and when the weights have no film.
    pub fn with_others(mut self) -> Result<Self> {
        let film = self.film.take().context("the weights have no film")?;
        self.film = Some(film.with_others()?);
        Ok(self)
    }
}

/// The focal length at 320×240, px.
const FOCAL_PX: f64 = 175.0;

impl FilmModel {
    /// The nominal film, for uncalibrated units.
    pub fn nominal(steps: u8, noise: &Noise) -> Self {
        Self {
            steps,
            rest_px: noise.rest_px.into(),
            noise_px: noise.at_rest_px,
            noise_at_four_areas: noise.at_four_areas,
            beside_px: 0.0,
            others: None,
            own: None,
        }
    }

    /// Adds how other units' films differ: films as people mount them, solved by finite elements.
    /// This takes minutes.
    ///
    /// # Errors
    /// When a number is out of range, or films find no equilibrium.
    pub fn with_others(mut self) -> Result<Self> {
        let nominal = FilmModel {
            own: None,
            others: None,
            ..self.clone()
        };
        let bytes = nominal.spec()?.to_bytes();
        let camera = Camera::new(Preset::Ov7725, 320, 240)?;
        self.others = Some(Box::new(OtherUnits::of_films(&parsed(&bytes)?, &camera)?));
        Ok(self)
    }

    /// Checks that every number is in range.
    ///
    /// # Errors
    /// Names the number that is not.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.steps <= forward::MOST_STEPS,
            "film.steps is {}: use 0 to 3",
            self.steps
        );
        for (name, value, [low, high]) in [
            ("beside_px", self.beside_px, [0.0, 1.0]),
            ("noise_px", self.noise_px[0], [1e-4, 10.0]),
            ("noise_px", self.noise_px[1], [1e-4, 10.0]),
            (
                "noise_at_four_areas",
                self.noise_at_four_areas[0],
                [0.1, 10.0],
            ),
            (
                "noise_at_four_areas",
                self.noise_at_four_areas[1],
                [0.1, 10.0],
            ),
        ] {
            ensure!(
                (low..=high).contains(&value),
                "film.{name} is {value}: use {low} to {high}"
            );
        }
        self.own.as_deref().map_or(Ok(()), OwnFilm::check)
    }

    /// The film as a model file holds it.
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn spec(&self) -> Result<ForwardSpec> {
        self.check()?;
        let noise = forward::Noise {
            rest_px: self.rest_px.map(|place| place.map(|part| part as f32)),
            at_rest_px: self.noise_px.map(|part| part as f32),
            at_four_areas: self.noise_at_four_areas.map(|part| part as f32),
        };
        // Tables are in focal lengths: all cameras have this lens.
        let camera = Camera::new(Preset::Ov7725, 320, 240)?;
        if let Some(own) = &self.own {
            return own.spec(self.steps, noise, &camera);
        }
        if self.rest_px.len() != OF_FOUR / 2 {
            let per_px = Some([1.0 / camera.focal_px() as f32, 0.0]);
            return Ok(ForwardSpec {
                steps: self.steps,
                per_px,
                noise,
                ..other_layout(self.rest_px.len(), &camera)?
            });
        }
        let nominal = nominal(&camera)?;
        Ok(ForwardSpec {
            steps: self.steps,
            limits: limits(),
            stiffness: nominal.stiffness,
            rest_image: rest_image(&Film::default().markers_mm(), &camera),
            per_px: None,
            noise,
            tables: nominal.tables,
            own: (self.beside_px > 0.0).then(|| even(self.beside_px / FOCAL_PX)),
            other: self.others.as_deref().map(OtherUnits::spec),
            weight: Some(nominal.weight),
        })
    }
}

/// The part that all files of the nominal film under the nominal tip share; computed once.
#[derive(Clone)]
struct Nominal {
    stiffness: Stiffness,
    tables: TablesSpec,
    weight: WeightSpec,
}

impl Weighed for UnitSetup<'_> {
    type Turned = Film;

    fn pressed(&self) -> Vec<Pressed> {
        everywhere()
    }

    fn turned(&self, down: [f64; 3]) -> Result<Film> {
        let down = Some(down).filter(|down| *down != [0.0; 3]);
        Ok(Film::of(self.unit)?.with_down(down)?)
    }

    fn moved(&self, film: &Film, pressed: &Pressed, sizes: &[f64]) -> Result<Vec<Moved>> {
        let (place_mm, tilt) = *pressed;
        let of_size = |size: &f64| {
            let pose = Pose {
                size: *size,
                tilt,
                place_mm,
            };
            self.images(|marker| UnitSetup::moved(self, film, &pose, marker))
        };
        sizes.iter().map(of_size).collect()
    }

    fn hangs(&self, film: &Film) -> Result<Moved> {
        self.images(|marker| self.moved_by(film, &Load::REST, marker))
    }
}

impl UnitSetup<'_> {
    /// All markers' images, each computed from the marker's number.
    fn images(&self, of_marker: impl Fn(usize) -> Result<[f64; 2]>) -> Result<Moved> {
        let mut moved = Moved::defaults(OF_FOUR);
        for (marker, place) in moved.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            *place = of_marker(marker)?;
        }
        Ok(moved)
    }
}

/// The nominal film with the layout of this many dots; computed once.
fn other_layout(count: usize, camera: &Camera) -> Result<ForwardSpec> {
    static MADE: Mutex<Option<ForwardSpec>> = Mutex::new(None);
    let mut made = MADE.lock().map_err(|error| anyhow!("{error}"))?;
    if let Some(made) = made.as_ref().filter(|made| made.tables.dots.len() == count) {
        return Ok(made.clone());
    }
    let (spec, _) = of_layout(layout(count)?, MOST_STEPS, UNMEASURED_PX, camera)?;
    *made = Some(spec.clone());
    Ok(spec)
}

fn nominal(camera: &Camera) -> Result<Nominal> {
    static MADE: Mutex<Option<Nominal>> = Mutex::new(None);
    let mut made = MADE.lock().map_err(|error| anyhow!("{error}"))?;
    if let Some(nominal) = &*made {
        return Ok(nominal.clone());
    }
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm: NOMINAL_RADIUS_MM,
        camera,
    };
    let [linear_n, cubic_n] = setup.stiffness_n().map(|part| part as f32);
    let stiffness = Stiffness { linear_n, cubic_n };
    let nominal = Nominal {
        stiffness,
        tables: setup.tables()?.0,
        weight: weight(&setup, stiffness, [0.0; 3])?,
    };
    *made = Some(nominal.clone());
    Ok(nominal)
}

pub(crate) fn limits() -> Limits {
    Limits {
        size: LARGEST_SIZE as f32,
        tilt: LARGEST_TILT as f32,
    }
}

/// Parses a film's bytes as the chip does.
fn parsed(bytes: &[u8]) -> Result<forward::Forward<'_>> {
    forward::Forward::parse(bytes)
        .map_err(|error| anyhow!("a film's tables cannot be kept: {error}"))
}

/// Images of markers at these places, mm, at rest; focal lengths from the axis.
fn at_rest(places_mm: &[[f64; 2]], camera: &Camera) -> Vec<[f64; 2]> {
    let at_rest = |place_mm: &[f64; 2]| {
        let at = Disc::marker(*place_mm).centroid_px(|_| [0.0; 3], camera);
        in_focal_lengths(at, camera)
    };
    places_mm.iter().map(at_rest).collect()
}

/// Converts a point of a camera's picture from px to focal lengths from the axis.
pub(crate) fn in_focal_lengths(at_px: [f64; 2], camera: &Camera) -> [f64; 2] {
    let middle = [camera.width(), camera.height()].map(|side| (f64::from(side) - 1.0) / 2.0);
    [0, 1].map(|i| (at_px[i] - middle[i]) / camera.focal_px())
}

/// The rest picture of markers at these places, mm, by the nominal camera, 10 mm from the film.
pub(crate) fn rest_image(places_mm: &[[f64; 2]], camera: &Camera) -> RestImage {
    let film_mm = |[x, y]: &[f64; 2]| {
        let (distance, radius) = (FILM_DISTANCE_MM, libm::hypot(*x, *y));
        let away = (distance * distance + radius * radius) / distance;
        // A marker on the axis is seen as far as its height says.
        let across = match radius > 0.0 {
            true => radius / libm::atan(radius / distance),
            false => distance,
        };
        [away, across].map(|part| part as f32)
    };
    let at = at_rest(places_mm, camera).into_iter();
    RestImage {
        at: Markers::of(at.map(|place| place.map(|part| part as f32))),
        film_mm: Markers::of(places_mm.iter().map(film_mm)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_twin::film::Film;
    use hivtac_twin::film::reduced::Pose;

    /// The motion that a film's tables predict for a pose, as the chip reads them, for markers at
    /// this distance from the tables' places.
    fn predicted_motion(
        forward: &forward::Forward<'_>,
        pose: &Pose,
        beside_mm: &forward::Markers,
    ) -> covariances::Moved {
        let pose = forward::Pose {
            size: pose.size as f32,
            tilt: pose.tilt.map(|part| part as f32),
            place_mm: pose.place_mm.map(|part| part as f32),
            width: 0.0,
        };
        let predicted = (forward.tables).predict(&pose, &forward.limits, beside_mm);
        covariances::Moved::from_fn(OF_FOUR, |k| predicted.moved[k].into())
    }

    fn film_model() -> FilmModel {
        let noise = Noise {
            rest_px: [[0.0; 2]; 4],
            at_rest_px: [0.01; 2],
            at_four_areas: [1.0; 2],
        };
        FilmModel::nominal(2, &noise)
    }

    /// Halton's sequence: the number's digits in a base, mirrored at the point. It fills 0 to 1
    /// evenly.
    fn halton(mut number: u32, base: u32) -> f64 {
        let (mut sum, mut part) = (0.0, 1.0);
        while number > 0 {
            part /= f64::from(base);
            sum += part * f64::from(number % base);
            number /= base;
        }
        sum
    }

    /// |F| to 0.25 N, tangential over normal to 0.8, places within ±4 mm.
    fn poses() -> impl Iterator<Item = Pose> {
        (20..520).map(|number| {
            let size_n = 0.002 + 0.246 * halton(number, 2);
            let (tilt, turn) = (
                (0.79 * halton(number, 3).sqrt()).atan(),
                6.2 * halton(number, 5),
            );
            let force_n = [
                size_n * tilt.sin() * turn.cos(),
                size_n * tilt.sin() * turn.sin(),
                -size_n * tilt.cos(),
            ];
            let place_mm = [7, 11].map(|base| 8.0 * halton(number, base) - 4.0);
            Pose::of_force(force_n, place_mm, [1.0; 2])
        })
    }

    /// Difference between the chip's prediction and the simulated film, px at 320×240: root mean
    /// square and largest.
    fn off_px(model: &FilmModel) -> [f64; 2] {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        let setup = UnitSetup {
            unit: Unit::default(),
            tip_radius_mm: NOMINAL_RADIUS_MM,
            camera: &camera,
        };
        let film = Film::of(setup.unit).unwrap();
        let bytes = model.spec().unwrap().to_bytes();
        let forward = forward::Forward::parse(&bytes).unwrap();
        let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
        for pose in poses() {
            let chip = predicted_motion(&forward, &pose, &forward::Markers::defaults(4));
            for marker in 0..4 {
                let truth = setup.moved(&film, &pose, marker).unwrap();
                for axis in [0, 1] {
                    let off = camera.focal_px() * (chip[2 * marker + axis] - truth[axis]);
                    sum += off * off;
                    worst = worst.max(off.abs());
                    count += 1.0;
                }
            }
        }
        [(sum / count).sqrt(), worst]
    }

    /// Error of the chip's prediction of the weight's effect under loads of these sizes, N, from
    /// the film hanging at rest. In px at 320×240: root mean square and largest.
    fn weight_off_px(sizes_n: [f64; 2]) -> [f64; 2] {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        let setup = UnitSetup {
            unit: Unit::default(),
            tip_radius_mm: NOMINAL_RADIUS_MM,
            camera: &camera,
        };
        let bytes = film_model().spec().unwrap().to_bytes();
        let forward = forward::Forward::parse(&bytes).unwrap();
        let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
        for (number, pose) in poses().enumerate() {
            let force_n = sizes_n[0] + (sizes_n[1] - sizes_n[0]) * halton(number as u32, 2);
            let own = Pose::of_force([0.0, 0.0, -force_n], pose.place_mm, [1.0; 2]);
            let pose = Pose {
                tilt: pose.tilt.map(|part| 0.5 * part),
                ..own
            };
            let turn = |base| 6.2 * halton(number as u32 + 7, base);
            let (z, angle) = (libm::cos(turn(3)), turn(5));
            let along = (1.0 - z * z).sqrt();
            let down = [along * libm::cos(angle), along * libm::sin(angle), z];
            let pressed_beside_hanging = |down| {
                let (film, at) = (setup.turned(down).unwrap(), (pose.place_mm, pose.tilt));
                let pressed = Weighed::moved(&setup, &film, &at, &[pose.size]).unwrap()[0];
                let hangs = setup.hangs(&film).unwrap();
                [0, 1, 2, 3, 4, 5, 6, 7].map(|c| pressed[c] - hangs[c])
            };
            let [with, without] = [down, [0.0; 3]].map(pressed_beside_hanging);
            let turned = forward::Turned::From {
                before: [0.0; 3],
                now: down.map(|part| part as f32),
            };
            let hanging = forward.hanging(turned, true).unwrap();
            let mut reported = forward::Prediction::zeros(OF_FOUR);
            let chip = forward::Pose {
                size: pose.size as f32,
                tilt: pose.tilt.map(|part| part as f32),
                place_mm: pose.place_mm.map(|part| part as f32),
                width: 0.0,
            };
            hanging.add_to(&chip, &forward, &mut reported);
            for c in 0..8 {
                let moved = f64::from(reported.moved[c]);
                let off = camera.focal_px() * (moved - (with[c] - without[c]));
                sum += off * off;
                worst = worst.max(off.abs());
                count += 1.0;
            }
        }
        [(sum / count).sqrt(), worst]
    }

    #[test]
    #[ignore = "15 s: full solutions"]
    fn the_chip_knows_what_weight_does() {
        for (sizes_n, most) in [
            ([0.02, 0.05], [0.02, 0.15]),
            ([0.05, 0.2], [0.02, 0.15]),
            ([0.002, 0.02], [0.2, 2.0]),
        ] {
            let [rms, worst] = weight_off_px(sizes_n);
            println!("{sizes_n:?} N: {rms:.4}, {worst:.4} px");
            assert!(rms < most[0] && worst < most[1], "{rms} {worst} px");
        }
    }

    #[test]
    fn the_chip_predicts_what_the_film_does() {
        let [rms, worst] = off_px(&film_model());
        assert!(rms < 0.004 && worst < 0.04, "{rms} {worst} px");
    }
}
