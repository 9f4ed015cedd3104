//! The facts of each camera on which forces and answers depend. The firmware's drivers have the
//! registers that bring them about.

pub mod mt9v034;
pub mod ov7725;

use hivtac_terms::camera::{CameraLimits, Rate, RateLimits};
use hivtac_terms::units::Microseconds;

/// Returns a camera's limits from its frame times, µs, and its shortest and longest exposures, at
/// each of [`Rate::ALL`].
const fn limits(frame_us: [u32; 3], exposures: [[Microseconds; 2]; 3]) -> CameraLimits {
    const fn at(frame_us: u32, exposures: [Microseconds; 2]) -> RateLimits {
        RateLimits::new((1_000_000 / frame_us) as u16, exposures)
    }
    CameraLimits([
        at(frame_us[0], exposures[0]),
        at(frame_us[1], exposures[1]),
        at(frame_us[2], exposures[2]),
    ])
}

const _: () = assert!(matches!(Rate::ALL, [Rate::Full, Rate::Half, Rate::Quarter]));
