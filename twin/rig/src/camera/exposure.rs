//! The OV7725's automatic exposure and gain, frame by frame.
//!
//! In each frame the loop moves half of the way, as a ratio, and stops at a well exposed picture.
//! It changes exposure before gain. Not simulated: the width of the stable region, banding, and the
//! selection of pixels for the control.

use super::output::Output;
use super::registers::{self as reg, Registers};

/// Exposure time, ns, at which the simulated light exposes the film well with a gain of one.
const WELL_EXPOSED_NS: f64 = 4_000_000.0;
/// Relative distance from well exposed at which the loop stops.
const CLOSE: f64 = 0.03;

/// COM8 bits.
const AUTOMATIC_GAIN: u8 = 0x04;
const AUTOMATIC_EXPOSURE: u8 = 0x01;

/// The exposure and gain in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure in lines.
    lines: f64,
    /// Gain as a factor.
    gain: f64,
}

impl Exposure {
    /// Returns the exposure and gain in the registers, as after a reset.
    pub fn of(registers: &Registers) -> Self {
        let lines = u16::from_be_bytes([registers.get(reg::AECH), registers.get(reg::AEC)]);
        Self {
            lines: f64::from(lines),
            gain: gain_of(registers.get(reg::GAIN)),
        }
    }

    /// Returns the exposure of each row, in lines.
    pub fn lines(&self) -> u64 {
        self.lines as u64
    }

    /// Lets automatic exposure and gain move and updates their registers. Returns the light of the
    /// next frame over the light that exposes it well.
    pub fn next(&mut self, registers: &mut Registers, output: &Output) -> f64 {
        let control = registers.get(reg::COM8);
        let line_ns = output.clocks_ns(u64::from(output.line_clocks)) as f64;
        let wanted = WELL_EXPOSED_NS / line_ns;
        if control & AUTOMATIC_EXPOSURE != 0 {
            self.lines = approach(self.lines, wanted / self.gain, f64::from(output.lines));
            let [high, low] = (self.lines as u16).to_be_bytes();
            registers.measured(reg::AECH, high);
            registers.measured(reg::AEC, low);
        } else {
            let gain = self.gain;
            *self = Self {
                gain,
                ..Self::of(registers)
            };
        }
        if control & AUTOMATIC_GAIN != 0 {
            let ceiling = f64::from(2u32 << (registers.get(reg::COM9) >> 4 & 7));
            // If exposure is automatic, it changes before gain.
            let lines = match control & AUTOMATIC_EXPOSURE {
                0 => self.lines.max(1.0),
                _ => f64::from(output.lines),
            };
            let short = wanted / lines;
            self.gain = approach(self.gain, short.max(1.0), ceiling);
            registers.measured(reg::GAIN, code_of(self.gain));
        } else {
            self.gain = gain_of(registers.get(reg::GAIN));
        }
        let light = self.lines * self.gain / wanted;
        // The registers hold whole lines.
        if (light - 1.0).abs() < CLOSE {
            1.0
        } else {
            light
        }
    }
}

fn approach(value: f64, wanted: f64, most: f64) -> f64 {
    let ratio = wanted / value.max(1.0 / 16.0);
    let moved = if (ratio - 1.0).abs() < CLOSE {
        wanted
    } else {
        value.max(1.0 / 16.0) * ratio.sqrt()
    };
    moved.min(most)
}

/// Returns the gain of a register value: four bits that each double it, and sixteenths.
fn gain_of(code: u8) -> f64 {
    let doublings = (code >> 4).count_ones();
    f64::from(1u32 << doublings) * (1.0 + f64::from(code & 15) / 16.0)
}

fn code_of(gain: f64) -> u8 {
    let doublings = (gain.max(1.0).log2() as u32).min(4);
    let rest = gain / f64::from(1u32 << doublings) - 1.0;
    ((1 << doublings) - 1) << 4 | (rest * 16.0).round().clamp(0.0, 15.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lights(registers: &mut Registers, frames: usize) -> Vec<f64> {
        let output = Output::new(registers, 24_000_000).unwrap();
        let mut exposure = Exposure::of(registers);
        (0..frames)
            .map(|_| exposure.next(registers, &output))
            .collect()
    }

    #[test]
    fn the_first_frames_are_wrong_and_the_tenth_is_right() {
        let lights = lights(&mut Registers::default(), 10);
        assert!((lights[0] - 1.0).abs() > 0.2, "{lights:?}");
        assert!(
            lights.is_sorted_by(|a, b| (a - 1.0).abs() >= (b - 1.0).abs()),
            "{lights:?}"
        );
        assert_eq!(lights[9], 1.0);
    }

    #[test]
    fn what_is_locked_stays() {
        let mut registers = Registers::default();
        let found = lights(&mut registers, 10);
        registers.write(reg::COM8, 0x88);
        assert_eq!(lights(&mut registers, 2), [found[9]; 2]);
        registers.write(reg::AECH, 0);
        registers.write(reg::AEC, 20);
        let dark = lights(&mut registers, 1)[0];
        assert!(dark < 0.3, "{dark}");
    }

    #[test]
    fn a_gain_alone_makes_up_for_an_exposure_that_is_set() {
        let mut registers = Registers::default();
        registers.write(reg::COM8, 0x8C);
        registers.write(reg::AECH, 0);
        registers.write(reg::AEC, 100);
        let lights = lights(&mut registers, 20);
        assert_eq!(registers.get(reg::AEC), 100);
        assert_eq!(*lights.last().unwrap(), 1.0, "{lights:?}");
        assert!(registers.get(reg::GAIN) > 0, "it amplifies");
    }

    #[test]
    fn gain_codes_name_gains() {
        for (code, gain) in [(0x00, 1.0), (0x08, 1.5), (0x10, 2.0), (0x70, 8.0)] {
            assert_eq!((gain_of(code), code_of(gain)), (gain, code));
        }
    }
}
