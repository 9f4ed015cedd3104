//! Draws random units, as people build them.

use hivtac_twin::Options;
use hivtac_twin::film::Layout;
use hivtac_twin::units::{TIP_RADIUS_MM, random_unit};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The focal length of all lenses, µm.
const FOCAL_UM: f64 = 2100.0;

/// A unit that was drawn at random.
#[derive(Clone, Debug)]
pub struct RandomUnit {
    /// Its scene.
    pub options: Options,
    /// Its tip's radius, mm.
    pub tip_radius_mm: f64,
}

impl RandomUnit {
    /// The unit with this number and these dots, with a camera's focal length in px.
    pub fn new(number: u64, layout: Layout, focal_px: f64) -> Self {
        let mut random = seeded(number);
        let options = random_unit(|| normal(&mut random), layout, FOCAL_UM, focal_px);
        let [from, to] = TIP_RADIUS_MM;
        Self {
            options,
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
