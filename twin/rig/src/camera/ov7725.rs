//! The OV7725: turns a scene into its output by its registers.

use super::colour::{self, Colour};
use super::exposure::Exposure;
use super::output::{Format, Output};
use super::part::{Part, Timing};
use super::registers::{self, Registers};
use crate::frame_source::{Coding, FrameSource, Picture};
use crate::rules::Rules;
use crate::truth::Exposed;

/// The sensor's state.
#[derive(Debug)]
pub struct Ov7725 {
    registers: Registers,
    exposing: Exposure,
    /// Light of the current frame over the light that exposes it well.
    light: f64,
    seed: u64,
    hesitant: bool,
}

impl Ov7725 {
    /// Returns a sensor out of reset. `seed` decides the values on which sources disagree. With
    /// `used`, the registers have the values of another program. With `hesitant`, the automatic
    /// control moves in small steps.
    pub fn new(seed: u64, used: bool, hesitant: bool) -> Self {
        let registers = match used {
            true => Registers::used(seed),
            false => Registers::of_seed(seed),
        };
        Self {
            exposing: Exposure::of(&registers, hesitant),
            registers,
            light: 1.0,
            seed,
            hesitant,
        }
    }
}

impl Part for Ov7725 {
    fn output(&self, clock_hz: u64) -> Option<Output> {
        Output::new(&self.registers, clock_hz)
    }

    fn expose(&mut self, output: &Output) -> Timing {
        self.light = self.exposing.next(&mut self.registers, output);
        let lines_ns = |lines: u64| output.clocks_ns(lines * u64::from(output.line_clocks));
        // A row's exposure ends when the row is read, and it is sent at that time.
        let middle_row = output.first_row - output.vsync_lines + output.rows / 2;
        Timing {
            exposure_ns: lines_ns(self.exposing.lines()),
            readout_ns: lines_ns(output.rows.into()),
            ends_ns: lines_ns(middle_row.into()),
        }
    }

    fn picture(&self, source: &dyn FrameSource, exposed: Exposed, rules: &Rules) -> Picture {
        if let Some(address) = self.registers.unwritten() {
            rules.broken(|| {
                format!(
                    "OV7725: a frame was captured that depends on register 0x{address:02X}, which \
                     was never written and has no value after a reset that its data sheets agree \
                     about"
                )
            });
        }
        if colour::is_bent(&self.registers) {
            rules.broken(|| {
                "OV7725: a frame was captured with its gamma curve or special effects (0x64), \
                 which are not simulated"
                    .to_owned()
            });
        }
        let wanted = match super::output::format(self.registers.get(registers::COM7)) {
            Format::Yuv => Coding::Yuv422,
            _ => Coding::Rgb565,
        };
        let picture = source.picture(exposed, wanted);
        let response = registers::response(self.seed);
        Colour::of(&self.registers, response, self.light).apply(picture)
    }

    fn read(&self, address: u16) -> u16 {
        self.registers.get(address as u8).into()
    }

    fn read_as_another(&self, address: u16) -> u16 {
        match address as u8 {
            registers::PID => 0x76,
            _ => self.read(address),
        }
    }

    fn write(&mut self, address: u16, value: u16) -> bool {
        let reset = self.registers.write(address as u8, value as u8);
        if reset {
            self.exposing = Exposure::of(&self.registers, self.hesitant);
        }
        reset
    }

    fn forget(&mut self) {
        self.registers.write(registers::GREEN, 0);
    }

    fn reset(&mut self) {
        *self = Self::new(self.seed, false, self.hesitant);
    }
}
