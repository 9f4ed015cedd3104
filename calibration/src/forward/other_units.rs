//! Describes uncalibrated units: how their images move differently from the nominal film's, as the
//! chip reads them by their rest picture, and which force moves them as far.

use crate::parallel;
use anyhow::{Context, Result, ensure};
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::{Forward, Markers, Mounting, Stiffness};
use hivtac_sensor::force::forward::{Pose as ChipPose, RELATIVE};
use hivtac_sensor::force::model::{CovarianceSpec, OthersSpec};
use hivtac_sensor::force::rest::Rest;
use hivtac_shell::{Design, Equilibrium, Film, Law, Material};
use hivtac_terms::list::List;
use hivtac_terms::units::Px;
use hivtac_twin::film::MARKER_CENTRES_MM;
use hivtac_twin::film::reduced::{LARGEST_SIZE, Pose};
use hivtac_twin::units::{FOCAL, MARKER_MM, POST_MM, ROLL_DEG, STIFFNESS, THICKNESS};
use hivtac_twin::{Camera, Disc};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::covariances::{Covariance, KNOTS, Moved, OF_FOUR, covariances, knots, sum_of_squares};
use super::in_focal_lengths;

/// Number of films that are drawn.
const FILMS: usize = 60;
/// The largest deviation that is drawn, in standard deviations.
const AT_MOST: f64 = 2.5;
/// The stretch with which films are mounted, along each axis.
const STRETCH: [f64; 2] = [-0.003, 0.03];
/// Range of their overhang beyond the posts, from 0, mm; every third has none.
const OVERHANG_MM: f64 = 8.0;
/// Radii of the posts that hold them, mm.
const POST_RADIUS_MM: [f64; 2] = [1.0, 3.0];
/// Range of slopes and curves of their thickness, ±.
const UNEVEN: f64 = 0.05;
/// Range of C₂/C₁ of rubber that stiffens.
const STIFFENING: [f64; 2] = [0.02, 0.2];
/// Range of the tips' radii, evenly drawn, mm, and the largest tilt of forces along x and y, rad.
const TIP_RADIUS_MM: [f64; 2] = [0.25, 1.0];
const TILT: f64 = 0.2;
/// The focal length by which rest pictures are read, px.
const FOCAL_PX: f64 = 175.0;
/// Fineness of the meshes.
const FINENESS: f64 = 0.3;
const _: () = assert!(KNOTS[0] as usize == RELATIVE, "their sizes are the same");
/// Tolerance of the size of images when a force is searched, in parts of the wanted size.
const NEAR: f64 = 0.06;
/// The number of forces that are tried for each size.
const TRIES: usize = 3;
/// Newton's steps to the size of the images.
const SIZE_STEPS: usize = 8;

/// How much units differ when only their rest picture is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OtherUnits {
    /// Coefficients a and b, N, of |F| = a·s + b·s³, the force whose images move as far as the
    /// nominal film's at the size s. Those of the film as the guide builds it, without stretch.
    pub stiffness_n: [f64; 2],
    /// Standard uncertainty of that force, in parts of it, at the squares of even parts of the
    /// largest size: 95 of 100 films are within 1.96 times it.
    pub relative: [f64; RELATIVE],
    /// Number of knots along size, y and x of the covariance of the motion's shape, apart from its
    /// size.
    counts: [u8; 3],
    end_mm: f32,
    /// Row by row, of each knot.
    factors: Vec<Vec<Vec<f64>>>,
}

impl OtherUnits {
    /// From films as people mount them, solved by finite elements and read by a chip.
    ///
    /// # Errors
    /// When too many of them find no equilibrium.
    pub(super) fn of_films(chip: &Forward<'_>, camera: &Camera) -> Result<Self> {
        let drawn = parallel::map(FILMS, |number| {
            Other::random(number as u64, chip, camera)?.matches()
        });
        let drawn: Vec<Vec<Match>> = drawn.into_iter().filter_map(Result::ok).collect();
        ensure!(
            10 * drawn.len() >= 9 * FILMS,
            "only {} of {FILMS} films find all their equilibria",
            drawn.len()
        );
        let poses: Vec<Pose> = knots(KNOTS).collect();
        let factors = (0..poses.len()).map(|knot| {
            let part = 1.0 / (drawn.len() as f64).sqrt();
            let shapes = drawn
                .iter()
                .map(|film| film[knot].left.map(|left| part * left));
            sum_of_squares(&shapes.collect::<Vec<_>>())
        });
        let spec = covariances(KNOTS, &factors.collect::<Vec<Covariance>>());
        let magnitudes = |size: f64| -> Vec<f64> {
            let of_film = |film: &Vec<Match>| {
                let own = poses.iter().zip(film).filter(|(pose, _)| pose.size == size);
                let (count, sum) = own.fold((0.0, 0.0), |(count, sum), (_, own)| {
                    (count + 1.0, sum + own.magnitude_n.ln())
                });
                (sum / count).exp()
            };
            drawn.iter().map(of_film).collect()
        };
        let sizes: [f64; RELATIVE] =
            std::array::from_fn(|k| LARGEST_SIZE * (k as f64 / (RELATIVE - 1) as f64).powi(2));
        let law = &chip.stiffness;
        let relative = |k: usize| {
            // At size 0 there is no force.
            let size = sizes[k.max(1)];
            let nominal_n = f64::from(law.magnitude_n(size as f32));
            let mut off: Vec<f64> = magnitudes(size)
                .iter()
                .map(|own| (own / nominal_n - 1.0).abs())
                .collect();
            off.sort_by(f64::total_cmp);
            off[off.len() * 95 / 100] / 1.96
        };
        Ok(Self {
            stiffness_n: [law.linear_n, law.cubic_n].map(f64::from),
            relative: std::array::from_fn(relative),
            counts: spec.counts,
            end_mm: spec.end_mm,
            factors: spec.factors,
        })
    }

    /// As a model file holds it.
    pub(super) fn spec(&self) -> OthersSpec {
        let [linear_n, cubic_n] = self.stiffness_n.map(|part| part as f32);
        OthersSpec {
            stiffness: Stiffness { linear_n, cubic_n },
            relative: self.relative.map(|part| part as f32),
            covariance: CovarianceSpec {
                counts: self.counts,
                end_mm: self.end_mm,
                factors: self.factors.clone(),
            },
        }
    }
}

/// A unit, and how a chip reads its rest picture.
struct Other<'a> {
    film: Film,
    rest: Equilibrium,
    rest_px: Markers,
    mounting: Mounting,
    camera: &'a Camera,
    to_px: [f64; 2],
    chip: &'a Forward<'a>,
    /// Tilt of the forces that press it.
    tilt: [f64; 2],
}

/// The force that moves a unit's images as far as a load moves the nominal film's.
struct Match {
    magnitude_n: f64,
    /// The remaining difference of their motion, focal lengths.
    left: Moved,
}

impl<'a> Other<'a> {
    fn random(number: u64, chip: &'a Forward<'a>, camera: &'a Camera) -> Result<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let design = design(number, &mut random);
        let (roll_deg, focal) = (ROLL_DEG * normal(&mut random), FOCAL * normal(&mut random));
        let (sin, cos) = libm::sincos(roll_deg.to_radians());
        let focal_px = FOCAL_PX * (1.0 + focal);
        let film = Film::new(&design)?;
        let mut other = Self {
            rest: film.rest(),
            film,
            rest_px: Markers::default(),
            mounting: Mounting {
                per_px: [0.0; 2],
                beside_mm: Markers::default(),
            },
            camera,
            to_px: [cos, sin].map(|part| part * focal_px),
            chip,
            tilt: [(); 2].map(|()| random.random_range(-TILT..TILT)),
        };
        let rest_px = other.seen(&other.rest);
        other.rest_px = Markers::of(rest_px.map(|place| place.map(|part| part as f32)));
        other.mounting = chip.rest_image.mounting(&rest(&other.rest_px));
        Ok(other)
    }

    /// Images of the dots, px from the camera's axis.
    fn seen(&self, state: &Equilibrium) -> [[f64; 2]; 4] {
        let [cos, sin] = self.to_px;
        std::array::from_fn(|dot| {
            let disc = Disc::marker(self.film.design().dots_mm[dot]);
            let at = disc.centroid_px(|point| self.film.displacement(state, point), self.camera);
            let [x, y] = in_focal_lengths(at, self.camera);
            [cos * x - sin * y, sin * x + cos * y]
        })
    }

    /// The matches of all knots, in their order.
    fn matches(&self) -> Result<Vec<Match>> {
        let poses: Vec<Pose> = knots(KNOTS).collect();
        let places = poses.len() / usize::from(KNOTS[0]);
        let mut all: Vec<Option<Match>> = poses.iter().map(|_| None).collect();
        for place in 0..places {
            let mut state = self.rest.clone();
            // Ratio of this film's force to the nominal film's.
            let mut stiffer = 1.0;
            for knot in (place..poses.len()).step_by(places) {
                let pose = Pose {
                    tilt: self.tilt,
                    ..poses[knot]
                };
                all[knot] = Some(match pose.size > 0.0 {
                    true => self.matched(&pose, &mut state, &mut stiffer)?,
                    false => Match {
                        magnitude_n: 0.0,
                        left: Moved::defaults(OF_FOUR),
                    },
                });
            }
        }
        all.into_iter()
            .collect::<Option<_>>()
            .context("a knot was not asked for")
    }

    fn matched(&self, pose: &Pose, state: &mut Equilibrium, stiffer: &mut f64) -> Result<Match> {
        let law = &self.chip.stiffness;
        let [size, nominal_n] = [pose.size, f64::from(law.magnitude_n(pose.size as f32))];
        let steeper = size * f64::from(law.per_size_n(size as f32)) / nominal_n;
        let mut magnitude_n = *stiffer * nominal_n;
        let at_mm = self.film.material_point(&self.rest, pose.place_mm);
        for attempt in 1.. {
            let force_n = pose.direction().map(|part| magnitude_n * part);
            *state = self.film.press_force(at_mm, force_n, state)?;
            let (found, left) = self.nearest(pose, state);
            let times = (size / found).powf(steeper);
            let is_near = (found / size - 1.0).abs() < NEAR;
            magnitude_n *= times.clamp(0.2, 5.0);
            if is_near || attempt == TRIES {
                *stiffer = magnitude_n / nominal_n;
                return Ok(Match {
                    magnitude_n,
                    left: left.map(|left| left * size / found),
                });
            }
        }
        unreachable!("the loop ends at the last attempt")
    }

    /// The size at which the chip's film moves the images most nearly as far, at the same tilt and
    /// place; and the remaining motion.
    fn nearest(&self, pose: &Pose, state: &Equilibrium) -> (f64, Moved) {
        let seen = self.seen(state);
        let mut moved = Moved::defaults(OF_FOUR);
        for (dot, parts) in moved.chunks_exact_mut(2).enumerate() {
            let px = [0, 1].map(|i| (seen[dot][i] - f64::from(self.rest_px[dot][i])) as f32);
            parts.copy_from_slice(&self.mounting.moved(px).map(f64::from));
        }
        let mut size = pose.size;
        let mut left = moved;
        for _ in 0..SIZE_STEPS {
            let at = ChipPose {
                size: size as f32,
                tilt: pose.tilt.map(|part| part as f32),
                place_mm: pose.place_mm.map(|part| part as f32),
                ..ChipPose::default()
            };
            let predicted =
                self.chip
                    .tables
                    .predict(&at, &self.chip.limits, &self.mounting.beside_mm);
            left = Moved::from_fn(OF_FOUR, |k| moved[k] - f64::from(predicted.moved[k]));
            let slopes = predicted.slopes[0].map(f64::from);
            let [along, square] = slopes
                .iter()
                .zip(left.iter())
                .fold([0.0; 2], |[along, square], (slope, left)| {
                    [along + slope * left, square + slope * slope]
                });
            size = (size + along / square)
                .clamp(0.3 * size, 2.0 * size)
                .min(1.2 * LARGEST_SIZE);
        }
        (size, left)
    }
}

/// Draws a film as somebody mounts it.
fn design(number: u64, random: &mut ChaCha8Rng) -> Design {
    let usual = |random: &mut ChaCha8Rng, sigma: f64| sigma * normal(random);
    let beside = |random: &mut ChaCha8Rng, sigma: f64| [(); 2].map(|()| usual(random, sigma));
    let nominal = Design::default();
    let neo_hooke = if number.is_multiple_of(3) { 0.0 } else { 1.0 };
    let stiffening = match number % 3 {
        2 => random.random_range(STIFFENING[0]..STIFFENING[1]),
        _ => 0.0,
    };
    // Every third has no overhang.
    let overhang_mm = match number / 3 % 3 {
        0 => 0.0,
        _ => random.random_range(0.0..OVERHANG_MM),
    };
    let down = loop {
        let vector = [(); 3].map(|()| random.random_range(-1.0..1.0));
        let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
        if (0.1..1.0).contains(&length) {
            break vector.map(|part| part / length);
        }
    };
    Design {
        material: Material {
            youngs_mpa: nominal.material.youngs_mpa * (1.0 + usual(random, STIFFNESS)),
            thickness_mm: nominal.material.thickness_mm * (1.0 + usual(random, THICKNESS)),
            ..nominal.material
        },
        law: Law {
            neo_hooke,
            stiffening,
        },
        stretch: [(); 2].map(|()| random.random_range(STRETCH[0]..STRETCH[1])),
        overhang_mm,
        post_radius_mm: random.random_range(POST_RADIUS_MM[0]..POST_RADIUS_MM[1]),
        post_shift_mm: [(); 4].map(|()| beside(random, POST_MM)),
        thickness_slope: [(); 2].map(|()| random.random_range(-UNEVEN..UNEVEN)),
        thickness_curve: [(); 3].map(|()| random.random_range(-UNEVEN..UNEVEN)),
        dot_stiffening: random.random_range(0.0..1.0),
        dots_mm: MARKER_CENTRES_MM
            .map(|[x, y]| {
                let [right, down] = beside(random, MARKER_MM);
                [x + right, y + down]
            })
            .to_vec(),
        down,
        tip_radius_mm: random.random_range(TIP_RADIUS_MM[0]..TIP_RADIUS_MM[1]),
        fineness: FINENESS,
        gauss_points: 2,
        ..nominal
    }
}

/// The rest picture as the sensor measures it.
fn rest(seen_px: &Markers) -> Rest {
    let px = |part: f32| Px((part * 65_536.0) as i32);
    Rest {
        features: Features {
            centroids: List::from_fn(4, |k| (px(seen_px[k][0]), px(seen_px[k][1]))),
            ..Features::default()
        },
        areas: [1; 4].into(),
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
