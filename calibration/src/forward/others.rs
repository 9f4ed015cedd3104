//! Units that somebody built and did not calibrate: how far their images move otherwise than the
//! nominal film's, as the chip reads them by their rest picture.

use anyhow::Result;
use hivtac_film::Film;
use hivtac_film::reduced::{LARGEST_SIZE, Pose};
use hivtac_scene::Camera;
use hivtac_sensing::features::Features;
use hivtac_sensing::forward::{DOTS, Forward, Mounting};
use hivtac_sensing::model::CovarianceSpec;
use hivtac_sensing::rest::Rest;
use hivtac_terms::units::Px;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::building::{FOCAL, MARKER_MM, POST_MM, ROLL_DEG, STIFFNESS, THICKNESS};
use super::covariances::{Moved, covariances, sum_of_squares};
use super::{UnitSetup, at_rest, told};
use hivtac_film::reduced::Unit;

/// Units that are drawn: their covariance is known to a tenth.
const UNITS: u64 = 200;
/// Nothing is drawn farther than so many standard deviations.
const AT_MOST: f64 = 2.5;
/// Tips' radii are evenly between, mm, and forces tilted by at most this along x and y, rad.
const TIP_RADIUS_MM: [f64; 2] = [0.25, 1.0];
const TILT: f64 = 0.2;
/// The focal length behind which rest pictures are read, px.
const FOCAL_PX: f64 = 175.0;

/// A unit, and what a chip makes of its rest picture.
struct Other<'a> {
    unit: DrawnUnit,
    film: Film,
    setup: UnitSetup<'a>,
    mounting: Mounting,
    /// How the forces are tilted that press it.
    tilt: [f64; 2],
}

/// A film and its camera, as somebody built them.
struct DrawnUnit {
    film: Unit,
    focal_px: f64,
    roll_deg: f64,
}

impl DrawnUnit {
    /// Turns what the camera sees, in focal lengths, into px.
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
}

/// What the tables of the nominal film leave of how other units' images move under the same force
/// at the same place.
///
/// # Errors
/// When a unit cannot be made.
pub fn others(chip: &Forward<'_>, camera: &Camera) -> Result<CovarianceSpec> {
    let drawn = (0..UNITS).map(|number| Other::drawn(number, chip, camera));
    let drawn: Vec<Other<'_>> = drawn.collect::<Result<_>>()?;
    let part = 1.0 / (UNITS as f64).sqrt();
    covariances(|pose| {
        let differences = drawn.iter().map(|other| {
            let difference = other.difference(chip, pose)?;
            Ok(difference.map(|more| part * more))
        });
        Ok(sum_of_squares(&differences.collect::<Result<Vec<_>>>()?))
    })
}

impl<'a> Other<'a> {
    fn drawn(number: u64, chip: &Forward<'_>, camera: &'a Camera) -> Result<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let mut usual = |sigma: f64| sigma * normal(&mut random);
        let unit = DrawnUnit {
            film: Unit {
                stiffness: 1.0 + usual(STIFFNESS),
                thickness: 1.0 + usual(THICKNESS),
                grip: 1.0,
                posts_mm: [(); DOTS].map(|()| [usual(POST_MM), usual(POST_MM)]),
                markers_mm: [(); DOTS].map(|()| [usual(MARKER_MM), usual(MARKER_MM)]),
            },
            focal_px: FOCAL_PX * (1.0 + usual(FOCAL)),
            roll_deg: usual(ROLL_DEG),
        };
        let [from, to] = TIP_RADIUS_MM;
        let setup = UnitSetup {
            unit: unit.film,
            tip_radius_mm: random.random_range(from..to),
            camera,
        };
        let film = Film::of(setup.unit)?;
        Ok(Self {
            mounting: chip.rest_image.mounting(&rest(&unit, &film, camera)),
            unit,
            film,
            setup,
            tilt: [(); 2].map(|()| random.random_range(-TILT..TILT)),
        })
    }

    /// How much more its images move than the chip predicts.
    fn difference(&self, chip: &Forward<'_>, pose: &Pose) -> Result<Moved> {
        let pose = Pose {
            tilt: self.tilt,
            ..*pose
        };
        let told = told(chip, &pose, &self.mounting.beside_mm);
        let size = self.same_force(chip, &pose);
        // Beyond what its film holds it moves as its size grows.
        let held = size.min(LARGEST_SIZE);
        let beyond = if size > held { size / held } else { 1.0 };
        let to_px = self.unit.to_px();
        let mut more = Moved::default();
        for (dot, more) in more.chunks_exact_mut(2).enumerate() {
            let moved = (self.setup).moved(&self.film, &Pose { size: held, ..pose }, dot)?;
            let px = to_px(moved.map(|part| beyond * part));
            let seen = self.mounting.moved(px.map(|part| part as f32));
            for i in [0, 1] {
                more[i] = f64::from(seen[i]) - told[2 * dot + i];
            }
        }
        Ok(more)
    }

    /// The size of the force that is of the pose's size on the chip's film.
    fn same_force(&self, chip: &Forward<'_>, pose: &Pose) -> f64 {
        let magnitude_n = chip.stiffness.magnitude_n(pose.size as f32);
        let [linear_n, cubic_n] = self.setup.stiffness_n().map(|part| part as f32);
        let own = hivtac_sensing::forward::Stiffness { linear_n, cubic_n };
        own.size_of(magnitude_n, 2.0 * LARGEST_SIZE as f32).into()
    }
}

/// What its rest picture shows.
fn rest(unit: &DrawnUnit, film: &Film, camera: &Camera) -> Rest {
    let to_px = unit.to_px();
    let px = |part: f64| Px((part * f64::from(Px::ONE.0)) as i32);
    let seen = at_rest(film.markers_mm(), camera).map(|place| {
        let [x, y] = to_px(place);
        (px(x), px(y))
    });
    Rest {
        features: Features {
            centroids: seen,
            ..Features::default()
        },
        areas: [1; DOTS],
    }
}

/// Nearly normal, with variance 1: the sum of twelve uniform numbers, within [`AT_MOST`].
fn normal(random: &mut ChaCha8Rng) -> f64 {
    loop {
        let sum: f64 = (0..12).map(|_| random.random_range(-0.5..0.5)).sum();
        if sum.abs() <= AT_MOST {
            return sum;
        }
    }
}
