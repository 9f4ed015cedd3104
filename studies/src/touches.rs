//! What is no single tip: two touches at once, and flat faces, by the full solver.

use std::f64::consts::TAU;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::data::dataset::Observation;
use hivtac_calibration::evaluation::answer::Chip;
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_shell::{Design, Film, Touch, markers};
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;
use hivtac_twin::Camera;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{normal, seeded};

/// Noise of each coordinate of a centroid, px: what the simulated camera's frames have at 320×240.
const NOISE_PX: f64 = 0.011;
/// Radius of each of two tips, mm.
const TIP_MM: f64 = 0.5;
/// A rigid flat face presses a film with its rim: so many small tips on a circle.
const RIM_TIPS: u32 = 16;
const RIM_TIP_MM: f64 = 0.3;
/// All of two touches together, N, and the parts that the first has.
const PAIR_N: f64 = 0.1;
const PARTS: [f64; 2] = [0.5, 0.8];
/// How far two touches are apart, mm.
const APART_MM: [f64; 6] = [0.5, 1.0, 2.0, 3.0, 4.0, 6.0];
/// Between them, mm, and which way the second is, degrees.
const PAIRS_AT: [([f64; 2], f64); 3] = [([0.0, 0.0], 0.0), ([0.0, 0.0], 45.0), ([2.0, 1.0], 0.0)];
/// Radii of flat faces, mm, their forces, N, and their middles, mm.
const FACES_MM: [f64; 3] = [1.0, 2.0, 3.0];
const FACES_N: [f64; 3] = [0.05, 0.1, 0.2];
const FACES_AT: [[f64; 2]; 2] = [[0.0, 0.0], [2.0, 1.0]];

/// Press the film with two tips at once and with flat faces, and see what the sensor makes of it.
#[derive(Args)]
pub struct Touches {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Frames of each press: as many draws of noise.
    #[arg(long, default_value_t = 200)]
    frames: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// Tips that press at once, and what they are.
struct Press {
    name: String,
    touches: Vec<Touch>,
}

/// What the sensor made of the frames of a press.
#[derive(Serialize)]
struct Outcome {
    name: String,
    /// Frames without a force, because no single contact explains them.
    unexplained: u32,
    frames: u32,
    /// Means over the others, if there are any.
    found: Option<Found>,
}

/// Means over frames with a force.
#[derive(Serialize)]
struct Found {
    /// |F| less that of all touches together, mN.
    magnitude_mn: f64,
    /// Angle to the sum of all forces, degrees.
    direction_deg: f64,
    /// How far the place is from the middle of all forces, mm.
    place_mm: f64,
    /// Stated standard uncertainties: degrees, mN, mm.
    sigma: [f64; 3],
}

/// The sensor without its camera: centroids of the film's markers, with noise, in place of frames.
struct CentroidSource<'m> {
    model: Model<'m>,
    weights: &'m Weights,
    camera: Camera,
}

impl Touches {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or the film finds no equilibrium.
    pub fn run(&self) -> Result<()> {
        let weights = Weights::load(&self.weights)?;
        let bytes = export(&weights)?;
        let source = CentroidSource {
            model: Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?,
            camera: weights.conditions.camera()?,
            weights: &weights,
        };
        let film = Film::new(&Design::default())?;
        let presses: Vec<Press> = pairs().into_iter().chain(faces()).collect();
        let rows = presses.par_iter();
        let rows = rows.map(|press| self.outcome(&source, &film, press));
        let rows: Vec<Outcome> = rows.collect::<Result<_>>()?;
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| press | `unexplained` | \\|F\\| less the sum's | direction beside the sum's | place \
             beside their middle | stated σ: direction, \\|F\\|, place \
             |\n|---|--:|--:|--:|--:|---|\n",
        );
        text.extend(rows.iter().map(Outcome::line));
        print!("{text}");
        page::write("touches.md", include_str!("touches.md"), &text)
    }

    fn outcome(&self, source: &CentroidSource<'_>, film: &Film, press: &Press) -> Result<Outcome> {
        let state = (film.press_all(&press.touches)).with_context(|| press.name.clone())?;
        let moved_px = source.moved_px(film, &state)?;
        let mut chip = Chip::new(source.model, &source.weights.rest)?;
        let mut random = seeded(1);
        let (mut unexplained, mut forces) = (0, Vec::new());
        for _ in 0..self.frames {
            let (force, status) = chip.force(&source.observation(&moved_px, &mut random))?;
            if status.contains(Status::UNEXPLAINED) {
                unexplained += 1;
            } else {
                forces.push(force);
            }
        }
        Ok(Outcome {
            name: press.name.clone(),
            unexplained,
            frames: self.frames,
            found: Found::of(&forces, &press.touches),
        })
    }
}

impl CentroidSource<'_> {
    /// How the images of markers move, px.
    fn moved_px(&self, film: &Film, state: &hivtac_shell::Equilibrium) -> Result<[[f64; 2]; 4]> {
        let rest = markers(film, &film.rest(), &self.camera);
        let there = markers(film, state, &self.camera);
        let moved = |k: usize| [0, 1].map(|i| there[k].seen_px[i] - rest[k].seen_px[i]);
        Ok(std::array::from_fn(moved))
    }

    /// What the sensor would make of that in a frame.
    fn observation(&self, moved_px: &[[f64; 2]; 4], random: &mut ChaCha8Rng) -> Observation {
        let rest_px = self.weights.rest.features_px();
        let off_px = (self.weights.film.as_ref()).map_or([[0.0; 2]; 4], |film| film.rest_px);
        let mut marker = |k: usize| {
            let at = [0, 1].map(|i| {
                let px = rest_px[2 * k + i] - off_px[k][i] + moved_px[k][i];
                Px((65_536.0 * (px + NOISE_PX * normal(random))).round() as i32)
            });
            Marker {
                x: at[0],
                y: at[1],
                area: self.weights.rest.areas_px[k],
            }
        };
        let markers: [Marker; 4] = std::array::from_fn(&mut marker);
        Observation {
            features_q16: Features::of_markers(&markers).to_array(),
            areas_px: self.weights.rest.areas_px,
        }
    }
}

impl Found {
    fn of(forces: &[Force], touches: &[Touch]) -> Option<Found> {
        let sum_n = total(touches);
        let size_n = length(sum_n);
        let middle_mm = [0, 1].map(|i| {
            let parts = touches
                .iter()
                .map(|touch| touch.force_n[2] * touch.at_mm[i]);
            parts.sum::<f64>() / sum_n[2]
        });
        let count = forces.len() as f64;
        let mean = |of: &dyn Fn(&Force) -> f64| forces.iter().map(of).sum::<f64>() / count;
        let far = |force: &Force| {
            let place = force.place.as_ref();
            let [x, y] = place.map_or([f64::NAN; 2], |place| {
                [place.x, place.y].map(|part| f64::from(part.0) * 1e-3)
            });
            (x - middle_mm[0]).hypot(y - middle_mm[1])
        };
        let direction = |force: &Force| {
            let found = force.cartesian.map(|part| f64::from(part.0));
            angle_deg(found, sum_n).unwrap_or(180.0)
        };
        let place_sigma = |force: &Force| {
            force
                .place
                .map_or(f64::NAN, |place| f64::from(place.sigma.0) * 1e-3)
        };
        (!forces.is_empty()).then(|| Found {
            magnitude_mn: mean(&|force| f64::from(force.magnitude.0) * 1e-3 - 1e3 * size_n),
            direction_deg: mean(&direction),
            place_mm: mean(&far),
            sigma: [
                mean(&|force| f64::from(force.direction_sigma.0) * 1e-3),
                mean(&|force| f64::from(force.magnitude_sigma.0) * 1e-3),
                mean(&place_sigma),
            ],
        })
    }
}

impl Outcome {
    fn line(&self) -> String {
        let before = format!(
            "| {} | {} of {} |",
            self.name, self.unexplained, self.frames
        );
        let Some(found) = &self.found else {
            return format!("{before} – | – | – | – |\n");
        };
        let [direction, force, place] = found.sigma;
        format!(
            "{before} {:+.1} mN | {:.1}° | {:.2} mm | {direction:.2}°, {force:.2} mN, {place:.3} \
             mm |\n",
            found.magnitude_mn, found.direction_deg, found.place_mm
        )
    }
}

/// Two tips, straight down.
fn pairs() -> Vec<Press> {
    let mut presses = Vec::new();
    for part in PARTS {
        for ([x, y], way_deg) in PAIRS_AT {
            for apart_mm in APART_MM {
                let (sin, cos) = way_deg.to_radians().sin_cos();
                let touch = |part: f64, way: f64| Touch {
                    force_n: [0.0, 0.0, -part * PAIR_N],
                    at_mm: [
                        x + way * apart_mm / 2.0 * cos,
                        y + way * apart_mm / 2.0 * sin,
                    ],
                    radius_mm: TIP_MM,
                };
                presses.push(Press {
                    name: format!(
                        "two tips, {:.0} and {:.0} mN, {apart_mm} mm apart at {way_deg}° around \
                         ({x}, {y})",
                        1e3 * part * PAIR_N,
                        1e3 * (1.0 - part) * PAIR_N
                    ),
                    touches: vec![touch(part, -1.0), touch(1.0 - part, 1.0)],
                });
            }
        }
    }
    presses
}

/// Flat faces, straight down, by their rims.
fn faces() -> Vec<Press> {
    let mut presses = Vec::new();
    for [x, y] in FACES_AT {
        for radius_mm in FACES_MM {
            for force_n in FACES_N {
                let touch = |number: u32| {
                    let (sin, cos) = (TAU * f64::from(number) / f64::from(RIM_TIPS)).sin_cos();
                    Touch {
                        force_n: [0.0, 0.0, -force_n / f64::from(RIM_TIPS)],
                        at_mm: [x + radius_mm * cos, y + radius_mm * sin],
                        radius_mm: RIM_TIP_MM,
                    }
                };
                presses.push(Press {
                    name: format!(
                        "flat face of {radius_mm} mm radius, {:.0} mN, at ({x}, {y})",
                        1e3 * force_n
                    ),
                    touches: (0..RIM_TIPS).map(touch).collect(),
                });
            }
        }
    }
    presses
}

/// The sum of their forces, N.
fn total(touches: &[Touch]) -> [f64; 3] {
    [0, 1, 2].map(|i| touches.iter().map(|touch| touch.force_n[i]).sum())
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}
