//! The properties of each camera on which forces and answers depend. The firmware's drivers set its
//! registers accordingly.

pub mod mt9v034;
pub mod ov5640;
pub mod ov7725;

use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, Rate, RateLimits};
use hivtac_terms::units::Microseconds;

/// The properties of a camera on which its settings and its frames' times depend.
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

/// The times of a camera that exposes its rows one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Rolling {
    /// Lines from frame to frame, blank ones included.
    pub lines: u16,
    /// Longest exposure, lines.
    pub longest_exposure: u16,
    /// Lines from the VSYNC edge that begins a frame to the middle row. A row's exposure ends when
    /// it is read, which is when it is sent.
    to_middle_row: u32,
    /// Clocks of a frame.
    frame_clocks: u64,
    /// These clocks at the full rate, Hz. Lower rates divide them.
    full_clock_hz: u64,
}

impl Rolling {
    /// Time from frame to frame, µs.
    pub const fn frame_us(&self, rate: Rate) -> u32 {
        let clocks = self.frame_clocks * rate.divisor() as u64;
        quotient((clocks * 1_000_000) as i64, self.full_clock_hz as i64) as u32
    }

    /// The limits of its settings: exposures from one line to the longest.
    const fn limits(&self) -> CameraLimits {
        let rates = Rate::ALL;
        let (mut frames_us, mut exposures) = ([0; 3], [[Microseconds(0); 2]; 3]);
        let mut k = 0;
        while k < rates.len() {
            frames_us[k] = self.frame_us(rates[k]);
            let shortest = Microseconds(frames_us[k].div_ceil(self.lines as u32));
            let longest = self.exposed(self.longest_exposure as u32, rates[k]);
            exposures[k] = [shortest, longest];
            k += 1;
        }
        limits(frames_us, exposures)
    }

    /// The number of lines nearest to a time, from 1 to the longest exposure.
    pub fn lines_in(&self, time: Microseconds, rate: Rate) -> u16 {
        let frame_us = self.frame_us(rate);
        let nearest =
            (time.0.min(frame_us) * u32::from(self.lines) + frame_us / 2) / frame_us.max(1);
        let nearest = u16::try_from(nearest).unwrap_or(self.lines);
        nearest.min(self.longest_exposure).max(1)
    }

    /// The exposure of a row, of a number of lines.
    pub const fn exposed(&self, lines: u32, rate: Rate) -> Microseconds {
        let us = lines as i64 * self.frame_us(rate) as i64;
        Microseconds(quotient(us, self.lines as i64) as u32)
    }

    /// Time from the VSYNC edge that begins a frame to the middle of its middle row's exposure of a
    /// number of lines, µs. Negative if a long exposure's middle comes before the edge.
    pub const fn middle_us(&self, lines: u32, rate: Rate) -> i32 {
        let half_lines = 2 * self.to_middle_row as i64 - lines as i64;
        quotient(
            half_lines * self.frame_us(rate) as i64,
            2 * self.lines as i64,
        ) as i32
    }
}

/// A quotient without a panic; 0 when dividing by zero.
const fn quotient(number: i64, divisor: i64) -> i64 {
    match number.checked_div(divisor) {
        Some(quotient) => quotient,
        None => 0,
    }
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
        assert_eq!(ov5640::ROWS.lines_in(full.longest, Rate::Full), 463);
        assert_eq!(ov5640::ROWS.lines_in(Microseconds(1), Rate::Quarter), 1);
        assert_eq!(
            ov5640::ROWS.lines_in(Microseconds(u32::MAX), Rate::Half),
            463
        );
        let longest = ov5640::ROWS.exposed(463, Rate::Half);
        assert_eq!(longest, ov5640::LIMITS.at(Rate::Half).longest);
    }

    #[test]
    fn a_longer_exposure_has_an_earlier_middle() {
        let [short, long] = [1, 463].map(|lines| ov5640::ROWS.middle_us(lines, Rate::Full));
        assert_eq!([short, long], [4_250, 98]);
        let [short, long] = [1, 276].map(|lines| ov7725::ROWS.middle_us(lines, Rate::Full));
        assert_eq!([short, long], [3_260, 92]);
    }
}
