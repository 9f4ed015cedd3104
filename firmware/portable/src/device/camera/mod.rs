//! The facts of each camera on which forces and answers depend. The firmware's drivers have the
//! registers that bring them about.

pub mod mt9v034;
pub mod ov5640;
pub mod ov7725;

use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, Rate, RateLimits};
use hivtac_terms::units::Microseconds;

/// What a camera's settings and its frames' times depend on.
#[derive(Clone, Copy, Debug)]
pub struct Facts {
    /// Name in the device's hello.
    pub name: &'static str,
    /// The limits of its settings.
    pub limits: CameraLimits,
    /// Exposure of its rows.
    pub motion: Motion,
    /// Time from frame to frame, µs.
    pub frame_us: fn(Rate) -> u32,
}

/// The number of lines nearest to a time, of `lines` in a frame of `frame_us`.
fn lines_in(time: Microseconds, frame_us: u32, lines: u16) -> u16 {
    let nearest = (time.0.min(frame_us) * u32::from(lines) + frame_us / 2) / frame_us.max(1);
    u16::try_from(nearest).unwrap_or(lines)
}

/// Time from the edge that begins a frame to the middle of the exposure of a row, µs. The exposure
/// of `exposed` lines ends `to_row` lines after the edge, of `lines` in a frame of `frame_us`.
const fn middle_us(to_row: u32, exposed: u32, frame_us: u32, lines: u16) -> i32 {
    // Negative if a long exposure's middle comes before the edge.
    let half_lines = 2 * to_row as i64 - exposed as i64;
    (half_lines * frame_us as i64 / (2 * lines as i64)) as i32
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ov5640_has_119_frames_a_second_and_exposures_within_them() {
        let full = ov5640::LIMITS.at(Rate::Full);
        assert_eq!(full.frames_per_second, 119);
        assert_eq!(ov5640::lines(full.longest, Rate::Full), 463);
        assert_eq!(ov5640::lines(Microseconds(1), Rate::Quarter), 1);
        assert_eq!(ov5640::lines(Microseconds(u32::MAX), Rate::Half), 463);
        let longest = ov5640::exposed(463, Rate::Half);
        assert_eq!(longest, ov5640::LIMITS.at(Rate::Half).longest);
    }

    #[test]
    fn a_longer_exposure_has_an_earlier_middle() {
        let [short, long] = [1, 463].map(|lines| ov5640::middle_us(lines, Rate::Full));
        assert_eq!([short, long], [4_250, 98]);
        let [short, long] = [1, 276].map(|lines| ov7725::middle_us(lines, Rate::Full));
        assert_eq!([short, long], [3_260, 92]);
    }
}
