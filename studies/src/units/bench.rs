//! The loads of a unit's calibration, as a gauge, a stage or a hand measures them.

use anyhow::{Context, Result};
use hivtac_calibration::data::rest::Rest;
use hivtac_calibration::forward::Known;
use hivtac_calibration::loads::{Rough, SeenLoad};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_twin::Load;
use hivtac_twin::film::Dots;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::press::{ANGLE_DEG, REACH_MM, Tared, TestedUnit, normal, seeded};

/// The loads of a calibration: |F|, N, α and β, degrees, and the tip's place, mm.
const TEN: [(f64, f64, f64, [f64; 2]); 10] = [
    (0.1, 0.0, 0.0, [0.0, 0.0]),
    (0.2, 0.0, 0.0, [0.0, 0.0]),
    (0.1, 8.0, 0.0, [0.0, 0.0]),
    (0.1, -8.0, 0.0, [0.0, 0.0]),
    (0.1, 0.0, 8.0, [0.0, 0.0]),
    (0.1, 0.0, -8.0, [0.0, 0.0]),
    (0.1, 0.0, 0.0, [3.0, 0.5]),
    (0.1, 0.0, 0.0, [-0.5, 3.0]),
    (0.1, 0.0, 0.0, [-3.0, -0.5]),
    (0.1, 0.0, 0.0, [0.5, -3.0]),
];
/// Frames of each load.
const FRAMES: u64 = 4;
/// Range of the forces of presses anywhere, N.
const ANYWHERE_N: [f64; 2] = [0.02, 0.22];
/// Number of loads with known places, and of loads by hand.
const SEVENTY: usize = 70;
const BY_HAND: usize = 120;
/// Standard deviations: of the gauge, N; of a stage's zero, mm; of a noted place, mm. And of a
/// hand's direction on each axis, degrees.
const GAUGE_N: f64 = 1e-3;
const STAGE_MM: f64 = 0.1;
const PLACE_MM: f64 = 0.1;
const HAND_DEG: f64 = 3.0;
/// Standard uncertainty of a marker's mean coordinates, px, from the pixel grid and residual noise.
const MEAN_PX: f64 = 0.008;

/// The method of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bench {
    /// Ten loads on a stage.
    Ten,
    /// Seventy loads anywhere, each place known to 0.1 mm.
    Seventy,
    /// Three minutes by hand: places are unknown, and the direction is the film's normal to 3°.
    ByHand,
}

/// The differences of ten loads from the jig's nominal ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jig {
    /// Distance of each bore from its place, mm, in a direction drawn for each.
    pub place_mm: f64,
    /// Excess of the wedge's angle, degrees.
    pub tilt_deg: f64,
    /// Excess of each weight, as a part of it.
    pub weight: f64,
}

impl Bench {
    /// All methods, with their names.
    pub const ALL: [(Bench, &'static str); 3] = [
        (Bench::Ten, "ten loads"),
        (Bench::Seventy, "seventy loads, places to 0.1 mm"),
        (Bench::ByHand, "three minutes by hand"),
    ];

    /// The weights for a unit after these loads; `number` selects the errors of gauge and stage.
    pub fn calibrate(
        self,
        weights: &Weights,
        unit: &TestedUnit,
        tared: &mut Tared<'_>,
        number: u64,
    ) -> Result<Weights> {
        self.calibrate_with(Jig::default(), weights, unit, tared, number)
    }

    /// The same with a jig that is not as drawn.
    pub fn calibrate_with(
        self,
        jig: Jig,
        weights: &Weights,
        unit: &TestedUnit,
        tared: &mut Tared<'_>,
        number: u64,
    ) -> Result<Weights> {
        let rest = tared.sensor.tare().context("no rest position")?;
        let rest = Rest::of_sensor(rest);
        let known = Known {
            gauge_n: GAUGE_N,
            stage_mm: STAGE_MM,
            place_mm: 0.0,
            from: None,
        };
        let mut random = seeded(7_000 + number);
        let loads = self.loads(jig, weights, &rest, unit, tared, &mut random)?;
        let (own, _) = weights.clone().fitted(rest, &loads, None, known)?;
        Ok(own)
    }

    fn loads(
        self,
        jig: Jig,
        weights: &Weights,
        rest: &Rest,
        unit: &TestedUnit,
        tared: &mut Tared<'_>,
        random: &mut ChaCha8Rng,
    ) -> Result<Vec<SeenLoad>> {
        let zero_mm = if self == Bench::Ten { STAGE_MM } else { 0.0 };
        let zero = [normal(random), normal(random)].map(|part| zero_mm * part);
        let there = |[x, y]: [f64; 2]| [x + zero[0], y + zero[1]];
        let mut loads = Vec::new();
        if self == Bench::Ten {
            for (number, (force_n, alpha, beta, place_mm)) in (0..).zip(TEN) {
                let meant = Load::from_angles(force_n, alpha, beta)?;
                let load = jig.load(meant, there(place_mm), [alpha, beta], number)?;
                let seen = tared.seen_px(unit, load, FRAMES, 50_000 + 10 * number)?;
                loads.push(SeenLoad {
                    each_place_mm: jig.place_mm,
                    ..with_gauge_error(seen, meant.vector_n(), place_mm, random)
                });
            }
            return Ok(loads);
        }
        let most = match self {
            Bench::Seventy => SEVENTY,
            _ => BY_HAND,
        };
        let model = export(weights)?;
        let rough = Rough::new(&model, rest)?;
        let mut number = 60_000;
        while loads.len() < most {
            number += 10;
            let force_n = random.random_range(ANYWHERE_N[0]..ANYWHERE_N[1]);
            let place_mm = [(); 2].map(|()| random.random_range(-REACH_MM..REACH_MM));
            let angles = match self {
                Bench::ByHand => [(); 2].map(|()| HAND_DEG * normal(random)),
                _ => [(); 2].map(|()| random.random_range(-ANGLE_DEG..ANGLE_DEG)),
            };
            let load = Load::from_angles(force_n, angles[0], angles[1])?;
            let load = load.with_offset_mm(there(place_mm))?;
            if !unit.shows_all(&load)? {
                continue;
            }
            let seen = tared.seen_px(unit, load, FRAMES, number)?;
            if self == Bench::ByHand {
                let load = with_gauge_error(seen, [0.0, 0.0, -force_n], [0.0; 2], random);
                loads.push(SeenLoad {
                    direction_rad: HAND_DEG.to_radians(),
                    each_place_mm: f64::INFINITY,
                    // Areas at rest suffice for a rough place.
                    place_mm: rough.place_mm(&load.observation(rest.areas_px)),
                    ..load
                });
            } else {
                let noted = place_mm.map(|part| part + PLACE_MM * normal(random));
                loads.push(SeenLoad {
                    each_place_mm: PLACE_MM,
                    ..with_gauge_error(seen, load.vector_n(), noted, random)
                });
            }
        }
        Ok(loads)
    }
}

impl Jig {
    /// The load that the jig really gives for load `number`, which is meant to be `meant`.
    fn load(self, meant: Load, place_mm: [f64; 2], angles: [f64; 2], number: u64) -> Result<Load> {
        // The golden angle: directions that differ.
        let (sin, cos) = (2.4 * number as f64).sin_cos();
        let [x, y] = place_mm;
        let place_mm = [x + self.place_mm * cos, y + self.place_mm * sin];
        let tilted = |angle: f64| match angle {
            0.0 => 0.0,
            _ => angle + angle.signum() * self.tilt_deg,
        };
        let [alpha, beta] = angles.map(tilted);
        let load = Load::from_angles((1.0 + self.weight) * meant.magnitude_n(), alpha, beta)?;
        Ok(load.with_offset_mm(place_mm)?)
    }
}

/// A load with this force, N, changed by the gauge's error, with this place, mm, and the markers'
/// places, px.
fn with_gauge_error(
    seen_px: Dots<[f64; 2]>,
    force_n: [f64; 3],
    place_mm: [f64; 2],
    random: &mut ChaCha8Rng,
) -> SeenLoad {
    let size_n = force_n.iter().map(|part| part * part).sum::<f64>().sqrt();
    let scale = 1.0 + GAUGE_N * normal(random) / size_n;
    SeenLoad {
        force_n: force_n.map(|part| scale * part),
        size_n: GAUGE_N,
        direction_rad: 0.0,
        place_mm,
        each_place_mm: 0.0,
        seen_px,
        noise_px: MEAN_PX,
        frames: FRAMES as usize,
    }
}
