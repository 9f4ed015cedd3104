//! The film run forwards, from what is known of a unit: a few numbers in a weights file, tables in
//! a model file.

pub mod building;
mod honest;
mod left_open;
mod left_out;
mod nearest;
mod noise;
mod tables;
mod ten_loads;
mod unit;

use std::sync::Mutex;

use anyhow::{Result, anyhow, ensure};
use hivtac_film::reduced::{LARGEST_SIZE, LARGEST_TILT, NOMINAL_RADIUS_MM, Pose, Unit};
use hivtac_scene::{Camera, FILM_DISTANCE_MM, MARKER_REST_MM, MARKERS, Preset};
use hivtac_sensing::forward::{
    self, KNOTS, Limits, Mounting, PARTS, PLACES, RestImage, SIZES, Stiffness, Tolerance,
};
use hivtac_sensing::model::{ForwardSpec, SystematicSpec, TableSpec};
use serde::{Deserialize, Serialize};

pub use left_open::Open;
use left_open::left_open;
pub use noise::Noise;
pub use tables::UnitSetup;
pub use ten_loads::{Bench, Fit, KnownLoad, fit};
pub use unit::Known;

/// What is known of a unit's film and camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FilmModel {
    /// Gauss–Newton steps from the network's answer, 0–3.
    pub steps: u8,
    /// The tip's radius, mm.
    pub tip_radius_mm: f64,
    /// What a tare takes for the rest position less where markers 0–3 rest, px: what the pixel grid
    /// does there.
    pub rest_px: [[f64; 2]; 4],
    /// Standard uncertainty of a marker in a frame, px, when it is as large as at rest: away from
    /// the pattern's middle, and across that.
    pub noise_px: [f64; 2],
    /// How many times that it is when the marker is four times as large.
    pub noise_at_four_areas: [f64; 2],
    /// What the errors on the unit that it was made on are beside what the markers' noise makes, at
    /// even sizes from nothing to the largest: standard uncertainties of the force across itself,
    /// N, of |F|, as sizes, and of the place, mm.
    #[serde(default)]
    pub beside_noise: [[f64; 3]; SIZES],
    /// The unit; without it the film is the nominal one, and the rest picture tells the markers'
    /// places.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<OwnUnit>,
    /// What its calibration leaves open of it: the unit moved along each column of its numbers'
    /// factor, by a quarter.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub open: Vec<Open>,
}

/// A calibration leaves fewer directions open than this.
const MOST_OPEN: usize = 64;
/// What units that somebody built and did not calibrate differ in, for dots 0.15 mm off, a camera
/// rolled by 2° and 2 % longer, a film 20 % stiffer and 10 % thicker, posts 0.3 mm off and a tip of
/// 0.25 to 1 mm: `hivtac-studies units` finds that 95 of 100 errors lie within their bounds then.
const OTHER_UNITS: Tolerance = Tolerance {
    shape: 0.03,
    stiffness: 0.2,
};

/// A unit as its calibration found it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OwnUnit {
    /// Young's modulus in parts of the nominal one.
    pub stiffness: f64,
    /// Thickness in parts of the nominal one.
    pub thickness: f64,
    /// The posts' grip in parts of the nominal one.
    pub grip: f64,
    /// How far each post is off its place, by the marker beside it, mm.
    pub posts_mm: [[f64; 2]; 4],
    /// How far each marker is glued beside its place, mm.
    pub markers_mm: [[f64; 2]; 4],
    /// The camera's focal length, px.
    pub focal_px: f64,
    /// How far the camera is rolled, x towards y, degrees.
    pub roll_deg: f64,
}

impl OwnUnit {
    fn check(&self) -> Result<()> {
        self.film().check()?;
        ensure!(
            (10.0..=10_000.0).contains(&self.focal_px) && self.roll_deg.abs() <= 45.0,
            "film.unit: a focal length of {} px and a roll of {}° are no camera's",
            self.focal_px,
            self.roll_deg
        );
        Ok(())
    }

    fn film(&self) -> Unit {
        Unit {
            stiffness: self.stiffness,
            thickness: self.thickness,
            grip: self.grip,
            posts_mm: self.posts_mm,
            markers_mm: self.markers_mm,
        }
    }

    /// Turns what the camera sees, in focal lengths, into px by its roll and its focal length.
    fn to_px(&self) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
        let (sin, cos) = libm::sincos(self.roll_deg.to_radians());
        let focal_px = self.focal_px;
        move |[x, y]| {
            [
                focal_px * (cos * x - sin * y),
                focal_px * (sin * x + cos * y),
            ]
        }
    }

    fn mounting(&self) -> Mounting {
        let (sin, cos) = libm::sincos(self.roll_deg.to_radians());
        Mounting {
            per_px: [cos, -sin].map(|part| (part / self.focal_px) as f32),
            beside_mm: self.markers_mm.map(|place| place.map(|part| part as f32)),
        }
    }
}

impl FilmModel {
    /// The nominal film, for units of which nothing is known: tolerances as `hivtac-studies units`
    /// finds them.
    pub fn nominal(steps: u8, noise: &Noise) -> Self {
        Self {
            steps,
            tip_radius_mm: NOMINAL_RADIUS_MM,
            rest_px: noise.rest_px,
            noise_px: noise.at_rest_px,
            noise_at_four_areas: noise.at_four_areas,
            beside_noise: Default::default(),
            unit: None,
            open: Vec::new(),
        }
    }

    /// Checks that every number is in range.
    ///
    /// # Errors
    /// Says which is not.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.steps <= forward::MOST_STEPS,
            "film.steps is {}: use 0 to 3",
            self.steps
        );
        for (name, value, [low, high]) in [
            ("tip_radius_mm", self.tip_radius_mm, [0.25, 2.0]),
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
        for part in self.beside_noise.as_flattened() {
            ensure!(
                (0.0..=1.0).contains(part),
                "film.beside_noise has {part}: use 0 to 1"
            );
        }
        ensure!(
            self.open.len() <= MOST_OPEN,
            "film.open has {} units: use at most {MOST_OPEN}",
            self.open.len()
        );
        let open = self.open.iter().map(|open| &open.unit);
        self.unit.iter().chain(open).try_for_each(OwnUnit::check)
    }

    /// What a model file holds of it.
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn spec(&self) -> Result<ForwardSpec> {
        self.check()?;
        // Tables are in focal lengths: all cameras have this lens.
        let camera = Camera::new(Preset::Ov7725, 320, 240)?;
        let setup = UnitSetup {
            unit: self.unit.as_ref().map_or_else(Unit::default, OwnUnit::film),
            tip_radius_mm: self.tip_radius_mm,
            camera: &camera,
        };
        let stiffness_n = setup.stiffness_n().map(|part| part as f32);
        let [moved, beside] = match (&self.unit, self.tip_radius_mm == NOMINAL_RADIUS_MM) {
            (None, true) => nominal_tables(&camera)?,
            _ => [setup.moved_table()?, setup.beside_table()?],
        };
        let mut spec = ForwardSpec {
            steps: self.steps,
            limits: Limits {
                size: LARGEST_SIZE as f32,
                tilt: LARGEST_TILT as f32,
            },
            stiffness: Stiffness {
                linear_n: stiffness_n[0],
                cubic_n: stiffness_n[1],
            },
            rest_image: rest_image(&camera),
            mounting: self.unit.as_ref().map(OwnUnit::mounting),
            noise: forward::Noise {
                rest_px: self.rest_px.map(|place| place.map(|part| part as f32)),
                at_rest_px: self.noise_px.map(|part| part as f32),
                at_four_areas: self.noise_at_four_areas.map(|part| part as f32),
            },
            own: self.systematic(&[]),
            other: OTHER_UNITS,
            moved,
            beside,
            own_table: None,
        };
        if let Some(unit) = &self.unit {
            let bytes = spec.to_bytes();
            let even = parsed(&bytes)?;
            spec.own_table = Some(setup.own_table(|pose| told(&even, pose))?);
            let bytes = spec.to_bytes();
            spec.own = self.systematic(&left_open(self, unit, &parsed(&bytes)?)?);
        }
        Ok(spec)
    }

    /// What is not known of the unit, and of the film that is run forwards.
    fn systematic(&self, left_open: &[[f32; PARTS]]) -> SystematicSpec {
        let mut knots = left_open.to_vec();
        knots.resize(KNOTS, [0.0; PARTS]);
        for (of_size, beside) in knots.chunks_mut(PLACES * PLACES).zip(self.beside_noise) {
            for knot in of_size {
                for (part, beside) in knot.iter_mut().zip(beside) {
                    *part = libm::hypotf(*part, beside as f32);
                }
            }
        }
        SystematicSpec {
            end_mm: left_open::END_MM as f32,
            knots,
        }
    }
}

/// The first two tables of the nominal film under the nominal tip. Every file of such a film has
/// them: they are made once.
fn nominal_tables(camera: &Camera) -> Result<[TableSpec; 2]> {
    static MADE: Mutex<Option<[TableSpec; 2]>> = Mutex::new(None);
    let mut made = MADE.lock().map_err(|error| anyhow!("{error}"))?;
    if let Some(tables) = &*made {
        return Ok(tables.clone());
    }
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm: NOMINAL_RADIUS_MM,
        camera,
    };
    let tables = [setup.moved_table()?, setup.beside_table()?];
    *made = Some(tables.clone());
    Ok(tables)
}

/// A film as the chip reads it.
fn parsed(bytes: &[u8]) -> Result<forward::Forward<'_>> {
    forward::Forward::parse(bytes)
        .map_err(|error| anyhow!("a film's tables cannot be kept: {error}"))
}

/// What a film's tables say of a pose, as the chip reads them.
fn told(forward: &forward::Forward<'_>, pose: &Pose) -> [f64; 8] {
    let beside_mm = (forward.mounting).map_or([[0.0; 2]; 4], |mounting| mounting.beside_mm);
    let pose = forward::Pose {
        size: pose.size as f32,
        tilt: pose.tilt.map(|part| part as f32),
        place_mm: pose.place_mm.map(|part| part as f32),
    };
    let told = (forward.tables).predict(&pose, &forward.limits, &beside_mm);
    told.moved.map(f64::from)
}

/// What a rest picture says: of the nominal camera, on a film 10 mm away.
fn rest_image(camera: &Camera) -> RestImage {
    let [x, _] = MARKERS[2].centroid_px(|_| [0.0; 3], camera);
    let middle = (f64::from(camera.width()) - 1.0) / 2.0;
    let (distance, radius) = (FILM_DISTANCE_MM, MARKER_REST_MM * std::f64::consts::SQRT_2);
    let angle = libm::atan(radius / distance);
    let away = (distance * distance + radius * radius) / distance;
    RestImage {
        corner: ((x - middle) / camera.focal_px()) as f32,
        film_mm: [away as f32, (radius / angle) as f32],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_film::Film;

    fn film_model(unit: Option<OwnUnit>) -> FilmModel {
        FilmModel {
            unit,
            ..FilmModel::nominal(
                2,
                &Noise {
                    rest_px: [[0.0; 2]; 4],
                    at_rest_px: [0.01; 2],
                    at_four_areas: [1.0; 2],
                },
            )
        }
    }

    /// The number's digits in a base, mirrored at the point: fills 0 to 1 evenly.
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

    /// How far what the chip predicts is from the simulated film, px at 320×240: root mean square
    /// and largest.
    fn off_px(model: &FilmModel) -> [f64; 2] {
        let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
        let setup = UnitSetup {
            unit: model
                .unit
                .as_ref()
                .map_or_else(Unit::default, OwnUnit::film),
            tip_radius_mm: model.tip_radius_mm,
            camera: &camera,
        };
        let film = Film::of(setup.unit).unwrap();
        let bytes = model.spec().unwrap().to_bytes();
        let forward = forward::Forward::parse(&bytes).unwrap();
        let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
        for pose in poses() {
            let chip = told(&forward, &pose);
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

    /// Glued, held and made otherwise than it should be, as far as hands do.
    fn own_unit() -> OwnUnit {
        OwnUnit {
            stiffness: 1.3,
            thickness: 0.9,
            grip: 1.0,
            posts_mm: [[0.4, -0.3], [0.2, 0.5], [-0.6, 0.1], [0.3, 0.3]],
            markers_mm: [[0.2, 0.1], [-0.15, 0.2], [0.1, -0.25], [-0.2, -0.1]],
            focal_px: 175.0,
            roll_deg: 0.0,
        }
    }

    /// Where the tip is right beside a marker that is glued beside its place, steps between the
    /// places of the tables' tip are coarse, and it is some tenths of a pixel.
    #[test]
    fn the_chip_predicts_what_a_units_own_film_does() {
        let [rms, worst] = off_px(&film_model(Some(own_unit())));
        assert!(rms < 0.03 && worst < 0.45, "{rms} {worst} px");
    }

    #[test]
    fn the_chip_predicts_what_the_film_does() {
        let [rms, worst] = off_px(&film_model(None));
        assert!(rms < 0.003 && worst < 0.03, "{rms} {worst} px");
    }
}
