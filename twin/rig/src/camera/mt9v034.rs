//! The MT9V034, mono with a global shutter: turns a scene into its output by its registers.
//!
//! Source: onsemi's MT9V034 data sheet, and the drivers of Linux (`mt9v032.c`) and OpenMV
//! (`mt9v0xx.c`). The picture is that of the array of binned pixels, 376 × 240, from which the
//! window is cut. Without binning each of its pixels is sent four times. Not simulated: context B,
//! high dynamic range, companding, triggered frames, test patterns, LVDS, noise of its rows, and
//! the selection of pixels for the automatic control.

use super::mt9v034_registers::{self as reg, Registers};
use super::output::{Format, Output, Window};
use super::part::{Part, Timing};
use crate::frame_source::{Coding, FrameSource, Picture};
use crate::rules::Rules;
use crate::truth::Exposed;

/// Range of the input clock, Hz.
const INPUT_CLOCK_HZ: std::ops::RangeInclusive<u64> = 13_000_000..=27_000_000;
/// The array's columns and rows, and the numbers of its first column and row.
const ARRAY: [u32; 2] = [752, 480];
const FIRST: [u32; 2] = [1, 4];
/// Fewest clocks of a row: the conversion time of the converters, one for each column.
const LEAST_ROW_CLOCKS: u32 = 690;
/// Fewest blank rows of a frame.
const LEAST_BLANK_ROWS: u32 = 4;
/// Fewest clocks of a row without distortion while columns are binned (onsemi MT9V024).
const BINNED_ROW_CLOCKS: u32 = 704;
/// Fewest blank rows without dark first rows while rows are binned (PX4Flow, `mt9v34.c`).
const BINNED_BLANK_ROWS: u32 = 10;
/// Dark rows for each missing blank one.
const DARK_ROWS: u32 = 2;
/// Columns by which every other row is shifted if it has too few clocks.
const TORN_BY: usize = 2;
/// Reserved registers, and the values that the data sheet recommends for them (Rev. G, table 8).
const RECOMMENDED: [(u8, u16); 5] = [
    (0x13, 0x2D2E),
    (0x20, 0x03C7),
    (0x24, 0x001B),
    (0x2B, 0x0003),
    (0x2F, 0x0003),
];
/// Exposure time, ns, at which the simulated light exposes the film well with a gain of one.
const WELL_EXPOSED_NS: f64 = 2_000_000.0;
/// Brightness of a well exposed picture, in 64ths of white: the film's 141 of 255.
const WELL_EXPOSED: f64 = 141.0 / 255.0 * 64.0;
/// Relative distance from its target at which the automatic control stops.
const CLOSE: f64 = 0.03;
/// Largest factor of a small step of the automatic control.
const SMALL_STEP: f64 = 17.0 / 16.0;
/// The automatic control moves every third frame (R0xA6 and R0xA9 after a reset).
const FRAMES_PER_MOVE: u32 = 3;

/// The sensor's state.
#[derive(Debug, Default)]
pub struct Mt9v034 {
    registers: Registers,
    /// Light of the current frame over the light that exposes it well.
    light: f64,
    /// Frames since the automatic control moved.
    waited: u32,
    /// The automatic control moves in small steps.
    hesitant: bool,
}

impl Mt9v034 {
    /// Returns a sensor out of reset. With `used`, its registers have the values of another
    /// program. With `hesitant`, its automatic control moves in small steps.
    pub fn new(used: bool, hesitant: bool) -> Self {
        Self {
            hesitant,
            registers: match used {
                true => Registers::used(),
                false => Registers::default(),
            },
            ..Self::default()
        }
    }

    /// Returns how many columns and rows are binned into one.
    fn binning(&self) -> [u32; 2] {
        let mode = self.registers.get(reg::READ_MODE);
        // 2 and 3 are both four.
        [mode >> 2 & 3, mode & 3].map(|field| 1 << field.min(2))
    }

    /// Returns the clocks of a row, before columns are binned.
    fn row_clocks(&self) -> u32 {
        let wide = |address| u32::from(self.registers.get(address));
        wide(reg::WINDOW_WIDTH) + wide(reg::HORIZONTAL_BLANKING)
    }

    /// Returns the address of the register with the present exposure.
    fn exposure_register(&self) -> u8 {
        match self.registers.get(reg::AEC_AGC_ENABLE) & 1 {
            0 => reg::SHUTTER_WIDTH,
            _ => reg::AEC_EXPOSURE,
        }
    }

    fn window(&self) -> Window {
        let wide = |address| u32::from(self.registers.get(address));
        let binning = self.binning();
        let start = [wide(reg::COLUMN_START), wide(reg::ROW_START)];
        let size = [wide(reg::WINDOW_WIDTH), wide(reg::WINDOW_HEIGHT)];
        let along = |axis: usize| (start[axis] as i32 - FIRST[axis] as i32) / binning[axis] as i32;
        let binned = [size[0] / binning[0], size[1] / binning[1]];
        Window {
            array: [ARRAY[0] / binning[0], ARRAY[1] / binning[1]],
            start: [along(0), along(1)],
            size: binned,
            output: binned,
        }
    }

    /// Describes a setting of the registers that the sensor cannot do; `None` if all are possible.
    fn impossible(&self) -> Option<String> {
        let wide = |address| u32::from(self.registers.get(address));
        let [columns, _] = self.binning();
        let (row, blanking) = (self.row_clocks(), wide(reg::HORIZONTAL_BLANKING));
        let least = [61, 71, 71, 71, 91][columns as usize];
        if row < LEAST_ROW_CLOCKS {
            return Some(format!(
                "a row of {row} clocks (R0x04 + R0x05) is shorter than {LEAST_ROW_CLOCKS}"
            ));
        }
        if blanking < least {
            return Some(format!(
                "horizontal blanking of {blanking} clocks (R0x05) is shorter than {least}"
            ));
        }
        if wide(reg::VERTICAL_BLANKING) < LEAST_BLANK_ROWS {
            return Some(format!(
                "vertical blanking (R0x06) is shorter than {LEAST_BLANK_ROWS} rows"
            ));
        }
        let ends = [
            (reg::COLUMN_START, reg::WINDOW_WIDTH),
            (reg::ROW_START, reg::WINDOW_HEIGHT),
        ];
        let outside = (0..2).any(|axis| {
            let (start, size) = ends[axis];
            let (start, size) = (wide(start), wide(size));
            start < FIRST[axis] || size == 0 || start + size > FIRST[axis] + ARRAY[axis]
        });
        outside.then(|| "the window (R0x01 to R0x04) is not within the array".into())
    }

    /// Darkens the first rows of the window if a frame has too few blank ones, and shifts every
    /// other row if it has too few clocks.
    fn disturb(&self, picture: &mut Picture) {
        let [columns, rows] = self.binning();
        let width = picture.width as usize;
        let start = self.window().start[1].max(0) as usize;
        let blank = u32::from(self.registers.get(reg::VERTICAL_BLANKING));
        if rows > 1 && blank < BINNED_BLANK_ROWS {
            let dark = ((BINNED_BLANK_ROWS - blank) * DARK_ROWS) as usize;
            for row in picture.pixels.chunks_mut(width).skip(start).take(dark) {
                row.fill(0);
            }
        }
        if columns > 1 && self.row_clocks() < BINNED_ROW_CLOCKS {
            for row in picture.pixels.chunks_mut(width).step_by(2) {
                row.rotate_left(TORN_BY);
            }
        }
    }

    /// Lets the automatic control move. Returns exposure in rows, and gain.
    fn controlled(&mut self, row_ns: f64) -> [f64; 2] {
        let automatic = self.registers.get(reg::AEC_AGC_ENABLE);
        let (aec, agc) = (automatic & 1 != 0, automatic & 2 != 0);
        self.waited += 1;
        if (aec || agc) && self.waited >= FRAMES_PER_MOVE {
            self.waited = 0;
            self.control(row_ns, aec, agc);
        }
        let registers = &self.registers;
        let rows = registers.get(self.exposure_register());
        let gain = match agc {
            true => reg::AGC_GAIN,
            false => reg::ANALOG_GAIN,
        };
        let gain = registers.get(gain) & 0x7F;
        [f64::from(rows), f64::from(gain) / 16.0]
    }

    /// Moves half of the way to the target brightness, as a ratio; exposure before gain.
    fn control(&mut self, row_ns: f64, aec: bool, agc: bool) {
        let registers = &self.registers;
        let wide = |address| f64::from(registers.get(address));
        let wanted = wide(reg::DESIRED_BIN) / WELL_EXPOSED * WELL_EXPOSED_NS / row_ns;
        let gain = match agc {
            true => reg::AGC_GAIN,
            false => reg::ANALOG_GAIN,
        };
        let mut rows = wide(self.exposure_register()).max(1.0);
        let mut gain = (wide(gain) / 16.0).max(1.0);
        let ratio = wanted / (rows * gain);
        if (ratio - 1.0).abs() < CLOSE {
            return;
        }
        let step = match self.hesitant {
            true => ratio.clamp(1.0 / SMALL_STEP, SMALL_STEP),
            false => ratio.sqrt(),
        };
        let aim = rows * gain * step;
        if aec {
            rows = aim.clamp(1.0, wide(reg::MAX_EXPOSURE)).round();
        }
        if agc {
            gain = (aim / rows).clamp(1.0, wide(reg::MAX_GAIN) / 16.0);
        }
        if aec {
            self.registers.measured(reg::AEC_EXPOSURE, rows as u16);
        }
        if agc {
            let gain = (gain * 16.0).round() as u16;
            self.registers.measured(reg::AGC_GAIN, gain);
        }
    }
}

impl Part for Mt9v034 {
    fn output(&self, clock_hz: u64) -> Option<Output> {
        let control = self.registers.get(reg::CHIP_CONTROL);
        let sends = control & reg::MASTER != 0 && control & reg::PARALLEL_OUTPUT != 0;
        if !INPUT_CLOCK_HZ.contains(&clock_hz) || !sends {
            return None;
        }
        let (window, [columns, _]) = (self.window(), self.binning());
        let blank_rows = u32::from(self.registers.get(reg::VERTICAL_BLANKING));
        let [width, rows] = window.output;
        // An exposure longer than a frame lengthens the frame.
        let exposure = u32::from(self.registers.get(self.exposure_register())) + 2;
        let polarity = self.registers.get(reg::PIXEL_CLOCK);
        let flips = self.registers.get(reg::READ_MODE) >> 4 & 3;
        let fault = self.impossible();
        Some(Output {
            pixel_clock_hz: clock_hz / u64::from(columns),
            line_clocks: self.row_clocks() / columns,
            row_lines: [1, 1],
            lines: (rows + blank_rows).max(exposure),
            vsync_lines: blank_rows,
            first_row: blank_rows,
            rows: if fault.is_some() { 0 } else { rows },
            row_bytes: width,
            format: Format::Mono,
            window,
            // Flip and mirror, in the bits of the OV7725's COM3.
            com3: ((flips & 1) << 7 | (flips >> 1) << 6) as u8,
            cr_first: false,
            // FRAME_VALID is high with the rows; blanking is its other level.
            vsync_active_high: polarity & reg::INVERT_FRAME != 0,
            href_active_high: polarity & reg::INVERT_LINE == 0,
            // PIXCLK rises in the middle of each datum. While columns are binned it is high in the
            // first clock of a datum and low afterwards (onsemi MT9V032, pixel data format).
            stable_at_rising: (polarity & reg::INVERT_CLOCK == 0) == (columns == 1),
            clock_between_rows: true,
            inverted: false,
            fault,
        })
    }

    fn expose(&mut self, output: &Output) -> Timing {
        let row_ns = output.clocks_ns(u64::from(output.line_clocks)) as f64;
        let [rows, gain] = self.controlled(row_ns);
        let light = rows * gain * row_ns / WELL_EXPOSED_NS;
        // The registers hold whole rows.
        self.light = match (light - 1.0).abs() < CLOSE {
            true => 1.0,
            false => light,
        };
        Timing {
            exposure_ns: (rows * row_ns) as u64,
            // All rows are exposed at once, before the first one is read.
            readout_ns: 0,
            ends_ns: 0,
        }
    }

    fn picture(&self, source: &dyn FrameSource, exposed: Exposed, rules: &Rules) -> Picture {
        let mut recommended = RECOMMENDED.into_iter();
        let missing = recommended.find(|&(address, value)| self.registers.get(address) != value);
        if let Some((address, value)) = missing {
            rules.broken(|| {
                format!(
                    "MT9V034: a frame was captured without {value:04X} in reserved register \
                     0x{address:02X}, as its data sheet recommends"
                )
            });
        }
        let mut picture = source.picture(exposed, Coding::Mono);
        self.disturb(&mut picture);
        if picture.coding == Coding::Mono && self.light != 1.0 {
            for pixel in &mut picture.pixels {
                *pixel = (f64::from(*pixel) * self.light).min(255.0) as u16;
            }
        }
        picture
    }

    fn read(&self, address: u16) -> u16 {
        self.registers.get(address as u8)
    }

    fn read_as_another(&self, address: u16) -> u16 {
        match address as u8 {
            reg::CHIP_VERSION => 0x1313,
            _ => self.read(address),
        }
    }

    fn write(&mut self, address: u16, value: u16) -> bool {
        let reset = self.registers.write(address as u8, value);
        if reset {
            self.waited = 0;
        }
        reset
    }

    fn forget(&mut self) {
        let after_reset = Registers::default().get(reg::ADC);
        self.registers.write(reg::ADC, after_reset);
    }

    fn reset(&mut self) {
        *self = Self::new(false, self.hesitant);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOCK_HZ: u64 = 26_666_666;

    /// Returns a sensor with the firmware's settings: 160 × 152 pixels of 2 × 2, 162 rows of 710
    /// clocks.
    fn binned() -> Mt9v034 {
        let mut part = Mt9v034::new(false, false);
        for (address, value) in [
            (reg::COLUMN_START, 217),
            (reg::ROW_START, 92),
            (reg::WINDOW_HEIGHT, 304),
            (reg::WINDOW_WIDTH, 320),
            (reg::HORIZONTAL_BLANKING, 390),
            (reg::VERTICAL_BLANKING, 10),
            (reg::READ_MODE, 0x0305),
            (reg::DESIRED_BIN, 35),
            (reg::MAX_EXPOSURE, 96),
            (reg::MAX_GAIN, 64),
            (reg::AEC_AGC_ENABLE, 0x0303),
        ] {
            assert!(!part.write(address.into(), value));
        }
        part
    }

    #[test]
    fn after_a_reset_it_sends_the_whole_array_sixty_times_a_second() {
        let output = Mt9v034::new(false, false).output(CLOCK_HZ).unwrap();
        assert_eq!((output.row_bytes, output.rows), (752, 480));
        let rate = 1e9 / output.clocks_ns(output.frame_clocks()) as f64;
        assert!((rate - 60.0).abs() < 0.5, "{rate}");
        assert!(!output.vsync_active_high && output.href_active_high && output.stable_at_rising);
    }

    #[test]
    fn binned_and_cut_it_sends_more_than_230_frames_a_second() {
        let mut part = binned();
        part.write(reg::AEC_AGC_ENABLE.into(), 0);
        part.write(reg::SHUTTER_WIDTH.into(), 96);
        let output = part.output(CLOCK_HZ).unwrap();
        assert_eq!((output.row_bytes, output.rows), (160, 152));
        assert_eq!(output.window.start, [108, 44]);
        assert_eq!(output.window.array, [376, 240]);
        assert_eq!(output.fault, None);
        assert!(!output.stable_at_rising, "columns are binned");
        let rate = 1e9 / output.clocks_ns(output.frame_clocks()) as f64;
        assert!((rate - 231.8).abs() < 0.1, "{rate}");
    }

    #[test]
    fn what_it_cannot_do_is_said_and_sends_no_rows() {
        for (address, value, word) in [
            (reg::HORIZONTAL_BLANKING, 369, "690"),
            (reg::VERTICAL_BLANKING, 3, "vertical"),
            (reg::COLUMN_START, 500, "window"),
            (reg::ROW_START, 0, "window"),
        ] {
            let mut part = binned();
            part.write(address.into(), value);
            let output = part.output(CLOCK_HZ).unwrap();
            let fault = output.fault.unwrap_or_default();
            assert_eq!(output.rows, 0, "{address:02X}");
            assert!(fault.contains(word), "{address:02X}: {fault}");
        }
        let mut part = binned();
        part.write(reg::WINDOW_WIDTH.into(), 660);
        part.write(reg::HORIZONTAL_BLANKING.into(), 70);
        part.write(reg::COLUMN_START.into(), 1);
        let fault = part.output(CLOCK_HZ).unwrap().fault.unwrap();
        assert!(fault.contains("71"), "{fault}");
    }

    #[test]
    fn too_few_blank_rows_darken_the_first_ones_and_too_few_clocks_tear_them() {
        let seen = |address: u8, value: u16| {
            let mut part = binned();
            part.write(address.into(), value);
            let mut picture = Picture {
                width: 376,
                height: 240,
                coding: Coding::Mono,
                pixels: (0..240)
                    .flat_map(|_| (0..376).map(|x| 1 + x % 200))
                    .collect(),
            };
            part.disturb(&mut picture);
            let at = |x: usize, y: usize| picture.pixels[y * 376 + x];
            [at(108, 44), at(108, 51), at(108, 52), at(108, 53)]
        };
        assert_eq!(seen(reg::VERTICAL_BLANKING, 10), [109; 4]);
        assert_eq!(seen(reg::VERTICAL_BLANKING, 6), [0, 0, 109, 109]);
        assert_eq!(seen(reg::HORIZONTAL_BLANKING, 384), [109; 4]);
        assert_eq!(seen(reg::HORIZONTAL_BLANKING, 383), [111, 109, 111, 109]);
    }

    #[test]
    fn it_is_silent_without_a_usable_clock_and_unless_it_is_the_master() {
        for clock_hz in [0, 12_000_000, 30_000_000] {
            assert_eq!(binned().output(clock_hz), None);
        }
        for control in [0x0180, 0x0108] {
            let mut part = binned();
            part.write(reg::CHIP_CONTROL.into(), control);
            assert_eq!(part.output(CLOCK_HZ), None, "{control:04X}");
        }
    }

    #[test]
    fn a_long_exposure_lengthens_the_frame() {
        let mut part = binned();
        part.write(reg::AEC_AGC_ENABLE.into(), 0);
        part.write(reg::SHUTTER_WIDTH.into(), 300);
        assert_eq!(part.output(CLOCK_HZ).unwrap().lines, 302);
    }

    #[test]
    fn the_control_finds_the_light_and_what_is_locked_stays() {
        let mut part = binned();
        let output = part.output(CLOCK_HZ).unwrap();
        for _ in 0..40 {
            part.expose(&output);
        }
        assert_eq!(part.output(CLOCK_HZ).unwrap().lines, 162);
        assert_eq!(part.light, 1.0);
        let found = [reg::AEC_EXPOSURE, reg::AGC_GAIN].map(|address| part.read(address.into()));
        assert!((70..=96).contains(&found[0]) && found[1] == 16, "{found:?}");
        part.write(reg::AEC_AGC_ENABLE.into(), 0);
        part.write(reg::SHUTTER_WIDTH.into(), 20);
        let timing = part.expose(&output);
        assert!(part.light < 0.3, "{}", part.light);
        assert_eq!((timing.readout_ns, timing.ends_ns), (0, 0));
        assert!(timing.exposure_ns.abs_diff(20 * 26_625) < 100, "{timing:?}");
    }
}
