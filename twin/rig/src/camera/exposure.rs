//! The OV7725's automatic exposure and gain, frame by frame.
//!
//! In each frame the loop moves half of the way, as a ratio, and stops at a well exposed picture.
//! A hesitant one moves in small steps every few frames, and rests as soon as the level is within
//! its limits, as the manuals of the maker's other parts say. Exposure changes before gain. Not
//! simulated: banding, and the selection of pixels for the control.

use super::output::Output;
use super::registers::{self as reg, Registers};

/// Exposure time, ns, at which the simulated light exposes the film well with a gain of one.
const WELL_EXPOSED_NS: f64 = 4_000_000.0;
/// Relative distance from well exposed at which the loop stops.
const CLOSE: f64 = 0.03;

/// Mean level of a well exposed film, of 255.
const WELL_EXPOSED_LEVEL: f64 = 141.0;
/// Frames from one small step to the next.
const FRAMES_PER_STEP: u32 = 4;
/// Factor of a small step (OmniVision OV9650, automatic exposure: an additional sixteenth).
const SMALL_STEP: f64 = 17.0 / 16.0;

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
    /// The loop moves in small steps.
    hesitant: bool,
    /// Frames since the last step.
    waited: u32,
}

impl Exposure {
    /// Returns the exposure and gain in the registers, as after a reset.
    pub fn of(registers: &Registers, hesitant: bool) -> Self {
        Self {
            lines: lines_of(registers),
            gain: gain_of(registers.get(reg::GAIN)),
            hesitant,
            waited: 0,
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
        // A longer exposure would have no time for the reset of its row.
        let longest = f64::from(output.lines.saturating_sub(2));
        let aim = self.aim(registers, wanted);
        if control & AUTOMATIC_EXPOSURE != 0 {
            self.lines = (aim / self.gain).min(longest);
        } else {
            self.lines = lines_of(registers).min(longest);
        }
        let [high, low] = (self.lines as u16).to_be_bytes();
        registers.measured(reg::AECH, high);
        registers.measured(reg::AEC, low);
        if control & AUTOMATIC_GAIN != 0 {
            let ceiling = f64::from(2u32 << (registers.get(reg::COM9) >> 4 & 7));
            // If exposure is automatic, it changes before gain.
            let lines = match control & AUTOMATIC_EXPOSURE {
                0 => self.lines.max(1.0),
                _ => longest,
            };
            self.gain = (aim / lines).clamp(1.0, ceiling);
            registers.measured(reg::GAIN, code_of(self.gain));
        } else {
            self.gain = gain_of(registers.get(reg::GAIN));
        }
        let light = self.lines * self.gain / wanted;
        let level = (WELL_EXPOSED_LEVEL * light).round().min(255.0);
        registers.measured(reg::YAVE, level as u8);
        // The registers hold whole lines.
        if (light - 1.0).abs() < CLOSE {
            1.0
        } else {
            light
        }
    }

    /// Returns the exposure in lines, times gain, to which the loop moves. With `wanted`, the
    /// picture is well exposed.
    fn aim(&mut self, registers: &Registers, wanted: f64) -> f64 {
        let now = (self.lines * self.gain).max(1.0 / 16.0);
        if !self.hesitant {
            let ratio = wanted / now;
            let is_close = (ratio - 1.0).abs() < CLOSE;
            return if is_close { wanted } else { now * ratio.sqrt() };
        }
        self.waited = (self.waited + 1) % FRAMES_PER_STEP;
        let level = (WELL_EXPOSED_LEVEL * now / wanted).min(255.0);
        let limit = |address| f64::from(registers.get(address));
        let zone = registers.get(reg::VPT);
        let [above, below] = [zone & 0xF0, zone << 4].map(f64::from);
        match level {
            _ if self.waited > 0 => now,
            _ if (limit(reg::AEB)..=limit(reg::AEW)).contains(&level) => now,
            _ if level < below => now * 2.0,
            _ if level > above => now / 2.0,
            // A step is at least a line.
            _ if level < limit(reg::AEB) => (now * SMALL_STEP).max(now + 1.0),
            _ => (now / SMALL_STEP).max(1.0),
        }
    }
}

fn lines_of(registers: &Registers) -> f64 {
    u16::from_be_bytes([registers.get(reg::AECH), registers.get(reg::AEC)]).into()
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
        lights_of(registers, frames, false)
    }

    fn lights_of(registers: &mut Registers, frames: usize, hesitant: bool) -> Vec<f64> {
        let output = Output::new(registers, 24_000_000).unwrap();
        let mut exposure = Exposure::of(registers, hesitant);
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
    fn a_hesitant_loop_takes_dozens_of_frames_and_rests_within_its_limits() {
        let mut registers = Registers::default();
        for (address, value) in [(reg::AEW, 0x96), (reg::AEB, 0x64), (reg::VPT, 0xA1)] {
            registers.write(address, value);
        }
        let lights = lights_of(&mut registers, 120, true);
        assert!(lights[2] == lights[1] && lights[16] < 0.7, "{lights:?}");
        assert!((0.7..0.8).contains(&lights[119]), "{lights:?}");
        assert!((100..=106).contains(&registers.get(reg::YAVE)));
    }

    #[test]
    fn an_exposure_is_at_most_two_lines_shorter_than_a_frame() {
        let mut registers = Registers::default();
        registers.write(reg::COM8, 0x88);
        registers.write(reg::AECH, 0x02);
        registers.write(reg::AEC, 0);
        lights(&mut registers, 1);
        assert_eq!(registers.get(reg::AECH), 1);
        assert_eq!(registers.get(reg::AEC), 0xFC, "508 of 510");
    }

    #[test]
    fn gain_codes_name_gains() {
        for (code, gain) in [(0x00, 1.0), (0x08, 1.5), (0x10, 2.0), (0x70, 8.0)] {
            assert_eq!((gain_of(code), code_of(gain)), (gain, code));
        }
    }
}
