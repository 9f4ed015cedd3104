//! Known presses on simulated sensors, and the sensor's answers.

mod bound;
mod real;
mod rows;
mod unit;

pub use bound::Information;
pub use real::RealFilm;
pub use rows::{Errors, Judged, judged};
pub use unit::{Answer, Tared, TestedUnit};

use hivtac_shell::halton;
use hivtac_twin::{FilmError, Load};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Forces, mN.
pub const FORCES_MN: [u32; 3] = [50, 100, 200];
/// Largest coordinate of a press's place along x and along y, mm.
pub const REACH_MM: f64 = 4.0;
/// The largest α and β, degrees.
pub const ANGLE_DEG: f64 = 8.0;

/// The press with this number, with a force between two values, N. Force, place and angles are
/// evenly spread within their limits.
pub fn press(number: u32, [from_n, to_n]: [f64; 2], reach_mm: f64) -> Result<Load, FilmError> {
    let either = |base| 2.0 * part(number, base) - 1.0;
    let force_n = from_n + (to_n - from_n) * part(number, 11);
    Load::from_angles(force_n, ANGLE_DEG * either(2), ANGLE_DEG * either(3))?
        .with_offset_mm([5, 7].map(|base| reach_mm * either(base)))
}

/// A number between 0 and 1 for the press `number`, evenly spread; each base gives another
/// coordinate.
fn part(number: u32, base: usize) -> f64 {
    halton(number as usize + 20, base)
}

/// A random number generator, the same for the same seed.
pub fn seeded(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// The sum of twelve uniform numbers: nearly normal, with variance 1.
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| random.random_range(-0.5..0.5)).sum()
}
