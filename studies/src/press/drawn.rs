//! Draws random units, as people build them.

use hivtac_calibration::forward::tolerances::{
    FOCAL, MARKER_MM, MIDDLE_PX, POST_MM, ROLL_DEG, STIFFNESS, THICKNESS,
};
use hivtac_twin::film::reduced::Unit;
use hivtac_twin::{Lens, Mechanics, Mounting, Options};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Largest error of a glued marker along an axis, mm.
const MARKER_AT_MOST_MM: f64 = 0.3;
/// Largest deviation of a drawn number, in standard deviations.
const AT_MOST: f64 = 2.5;
/// Range of the tip's radius, mm, with a uniform distribution.
const TIP_RADIUS_MM: [f64; 2] = [0.25, 1.0];
/// The focal length of all lenses, µm.
const FOCAL_UM: f64 = 2100.0;

/// A unit that was drawn at random.
#[derive(Clone, Debug)]
pub struct Drawn {
    /// Its scene.
    pub options: Options,
    /// Its tip's radius, mm.
    pub tip_radius_mm: f64,
}

impl Drawn {
    /// The unit with this number, with a camera's focal length in px.
    pub fn new(number: u64, focal_px: f64) -> Self {
        let mut random = seeded(number);
        let mut drawn = |sigma: f64, at_most: f64| {
            let mut all = std::iter::repeat_with(|| sigma * normal(&mut random));
            all.find(|value| value.abs() <= at_most).unwrap_or(0.0)
        };
        let mut usual = |sigma: f64| drawn(sigma, AT_MOST * sigma);
        let mounting = Mounting {
            shift_px: [usual(MIDDLE_PX), usual(MIDDLE_PX)],
            roll_deg: usual(ROLL_DEG),
        };
        let longer = 1.0 + usual(FOCAL);
        let (stiffness, thickness) = (1.0 + usual(STIFFNESS), 1.0 + usual(THICKNESS));
        let posts_mm = std::array::from_fn(|_| [usual(POST_MM), usual(POST_MM)]);
        let glued_mm: [[f64; 2]; 4] =
            std::array::from_fn(|_| [0, 1].map(|_| drawn(MARKER_MM, MARKER_AT_MOST_MM)));
        let [from, to] = TIP_RADIUS_MM;
        Self {
            options: Options {
                film: Mechanics {
                    unit: Unit {
                        stiffness,
                        thickness,
                        posts_mm,
                        ..Unit::default()
                    },
                    ..Mechanics::default()
                },
                glued_mm: glued_mm.into(),
                lens: Lens {
                    pitch_um: Some(FOCAL_UM / (focal_px * longer)),
                    ..Lens::default()
                },
                mounting,
                ..Options::default()
            },
            tip_radius_mm: random.random_range(from..to),
        }
    }
}

/// A random number generator, the same for the same seed.
pub fn seeded(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// The sum of twelve uniform numbers: nearly normal, with variance 1.
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| random.random_range(-0.5..0.5)).sum()
}
