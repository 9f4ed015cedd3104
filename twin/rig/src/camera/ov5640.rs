//! The OV5640: turns a scene into its output by its registers.
//!
//! The picture is that of the window for which the sensor's lens is meant, 2352 × 1764 of the
//! array, at 320 × 240; outside it is black. Of the PLL's tree only the branches to lines and PCLK
//! are simulated. After a reset the pins are no outputs, so nothing is sent. Not simulated:
//! banding, night mode, lens correction, sharpening and smoothing, gamma and automatic white
//! balance (a captured frame with one of these breaks a rule), the microcontroller, the focus
//! motor.

use super::colour::Colour;
use super::output::{Format, Output, Window};
use super::ov5640_registers::{self as reg, Registers};
use super::part::{Part, Timing};
use super::registers::random;
use crate::frame_source::{Coding, FrameSource, Picture};
use crate::rules::Rules;
use crate::truth::Exposed;

/// Range of the input clock, Hz.
const INPUT_CLOCK_HZ: std::ops::RangeInclusive<u64> = 6_000_000..=54_000_000;
/// Range of the PLL's own clock, Hz (Linux).
const PLL_HZ: std::ops::RangeInclusive<u64> = 500_000_000..=1_000_000_000;
/// Fastest clock of the lines, Hz: 15 frames a second of the whole array.
const FASTEST_LINES_HZ: u64 = 84_000_000;
/// Columns and rows of the array.
const ARRAY: [u32; 2] = [2_624, 1_964];
/// First column and row of the window that the picture shows, and its size.
const SHOWN: [u32; 2] = [136, 104];
const SHOWN_SIZE: [u32; 2] = [2_352, 1_764];
/// Columns and rows of the picture.
const PICTURE: [u32; 2] = [320, 240];
/// Fewest clocks of a line, fewest blank lines (OpenMV, Linux).
const LEAST_LINE_CLOCKS: u32 = 1_438;
const LEAST_BLANK_LINES: u32 = 24;
/// Lines of VSYNC, and from there to the first row.
const VSYNC_LINES: u32 = 2;
const LINES_TO_FIRST_ROW: u32 = 17;
/// Fewest lines by which an exposure is shorter than a frame.
const UNEXPOSED_LINES: u32 = 4;
/// Exposure time, ns, at which the simulated light exposes the film well with a gain of one: the
/// OV7725's 4 ms, and its 3.8 V/(lx s) over this part's 0.6.
const WELL_EXPOSED_NS: f64 = 25_300_000.0;
/// Mean level of a well exposed film, of 255.
const WELL_EXPOSED_LEVEL: f64 = 141.0;
/// Relative distance from well exposed at which the automatic control stops.
const CLOSE: f64 = 0.03;
/// Factor of a small step of the automatic control, and the frames from one to the next.
const SMALL_STEP: f64 = 17.0 / 16.0;
const FRAMES_PER_STEP: u32 = 4;
/// [`reg::ISP`]: the gamma curve is on.
const GAMMA: u8 = 0x20;
/// The matrix for which the scene's colours are meant, those of Linux' driver.
const MATRIX: [f64; 9] = [30.0, 91.0, 8.0, -10.0, -126.0, 136.0, 124.0, -108.0, -16.0];
/// COM3 of the OV7725, in whose bits [`Output`] has these.
const FLIPPED: u8 = 0x80;
const MIRRORED: u8 = 0x40;
const LUMA_FIRST: u8 = 0x10;
const COLOUR_BARS: u8 = 0x01;

/// The sensor's state.
#[derive(Debug)]
pub struct Ov5640 {
    registers: Registers,
    /// Light of the current frame over the light that exposes it well.
    light: f64,
    /// Frames since the automatic control moved.
    waited: u32,
    seed: u64,
    hesitant: bool,
}

/// The PLL's clocks.
struct Clocks {
    lines_hz: u64,
    pixels_hz: u64,
    fault: Option<String>,
}

impl Ov5640 {
    /// Returns a sensor out of reset. `seed` decides the light's colour. With `used`, its registers
    /// have the values of another program. With `hesitant`, its automatic control moves in small
    /// steps.
    pub fn new(seed: u64, used: bool, hesitant: bool) -> Self {
        Self {
            registers: match used {
                true => Registers::used(seed),
                false => Registers::default(),
            },
            light: 1.0,
            waited: 0,
            seed,
            hesitant,
        }
    }

    fn clocks(&self, input_hz: u64) -> Clocks {
        let get = |address| u64::from(self.registers.get(address));
        // In halves.
        let before = match get(reg::PLL_PREDIVIDER) & 0x0F {
            0 | 1 => 2,
            5 => 3,
            7 => 5,
            other => 2 * other.min(8),
        };
        let pll_hz = input_hz * 2 * get(reg::PLL_MULTIPLIER) / before;
        let divider = match get(reg::PLL_DIVIDER) >> 4 {
            0 => 16,
            other => other,
        };
        let root = 1 + (get(reg::PLL_PREDIVIDER) >> 4 & 1);
        // In halves.
        let bits = match get(reg::PLL_BITS) & 0x0F {
            8 => 4,
            10 => 5,
            _ => 2,
        };
        let whole_hz = pll_hz / divider / root * 2 / bits;
        let roots = get(reg::ROOT_DIVIDERS);
        let by_hand = get(reg::PCLK_CONTROL) & 0x02 != 0;
        let divided = match get(reg::PCLK_DIVIDER) & 0x1F {
            0 => 1,
            other if by_hand => other,
            _ => 2,
        };
        let lines_hz = whole_hz >> (roots & 3);
        let fault = match () {
            () if get(reg::CLOCK_SOURCE) & 0x02 == 0 => {
                Some("the PLL is not in use (0x3103)".into())
            }
            () if !PLL_HZ.contains(&pll_hz) => Some(format!(
                "the PLL's {pll_hz} Hz are out of range (0x3036, 0x3037)"
            )),
            () if lines_hz > FASTEST_LINES_HZ => Some(format!(
                "the lines' clock of {lines_hz} Hz is over 84 MHz (0x3108)"
            )),
            () => None,
        };
        Clocks {
            lines_hz: lines_hz.max(1),
            pixels_hz: ((whole_hz >> (roots >> 4 & 3)) / divided).max(1),
            fault,
        }
    }

    /// Returns the sensor's columns and rows for each one that is read.
    fn steps(&self) -> [u32; 2] {
        [reg::COLUMN_STEPS, reg::ROW_STEPS].map(|address| {
            let steps = self.registers.get(address);
            (u32::from(steps >> 4) + u32::from(steps & 15)) / 2
        })
    }

    /// Returns how many columns and rows are read, and first ones and sizes of the shown part, in
    /// the array's.
    fn read_out(&self) -> [[u32; 2]; 3] {
        let wide = |address| self.registers.wide(address);
        let steps = self.steps().map(|step| step.max(1));
        let along = |axis: usize| {
            let at = 2 * axis as u16;
            let first = wide(reg::WINDOW + at);
            let size = (wide(reg::WINDOW + 4 + at) + 1).saturating_sub(first);
            let left_out = wide(reg::OFFSET + at);
            let read = (size / steps[axis]).saturating_sub(2 * left_out);
            (read, first + left_out * steps[axis], read * steps[axis])
        };
        let [x, y] = [along(0), along(1)];
        [[x.0, y.0], [x.1, y.1], [x.2, y.2]]
    }

    fn window(&self) -> Window {
        let [_, first, size] = self.read_out();
        let output = [0, 2].map(|at| self.registers.wide(reg::OUTPUT + at));
        // In the picture's pixels.
        let scaled = |value: f64, axis: usize| {
            (value * f64::from(PICTURE[axis]) / f64::from(SHOWN_SIZE[axis])).round()
        };
        let start =
            |axis: usize| scaled(f64::from(first[axis]) - f64::from(SHOWN[axis]), axis) as i32;
        Window {
            array: PICTURE,
            start: [start(0), start(1)],
            size: [0, 1].map(|axis| scaled(f64::from(size[axis]), axis) as u32),
            output,
        }
    }

    /// Returns the coding of pixels, and whether luma comes first in YUV; `None` if it is not
    /// simulated.
    fn format(&self) -> Option<(Format, bool)> {
        let order = self.registers.get(reg::BYTE_ORDER);
        match (self.registers.get(reg::PATH) & 7, order) {
            (0, 0x30) => Some((Format::Yuv, true)),
            (0, 0x3F) => Some((Format::Yuv, false)),
            (1, 0x61) => Some((Format::Rgb565, false)),
            _ => None,
        }
    }

    /// Describes a setting of the registers that the sensor cannot do; `None` if all are possible.
    fn impossible(&self, clocks: &Clocks, line_clocks: u32, row_bytes: u32) -> Option<String> {
        let [read, ..] = self.read_out();
        let [width, height] = [0, 2].map(|at| self.registers.wide(reg::OUTPUT + at));
        let [line, lines] = [0, 2].map(|at| self.registers.wide(reg::TOTAL + at));
        let ends = [4, 6].map(|at| self.registers.wide(reg::WINDOW + at));
        let left_out = 2 * self.registers.wide(reg::OFFSET + 2);
        let scales = self.registers.get(reg::ISP_1) & 0x20 != 0;
        if clocks.fault.is_some() {
            return clocks.fault.clone();
        }
        if self.format().is_none() {
            return Some("this format (0x4300, 0x501F) is not simulated".into());
        }
        if ends[0] >= ARRAY[0] || ends[1] >= ARRAY[1] || width == 0 || height == 0 {
            return Some("the window (0x3800 to 0x3807) is not within the array".into());
        }
        if width > read[0] || height > read[1] {
            let [columns, rows] = read;
            return Some(format!(
                "output {width}×{height} (0x3808 to 0x380B) is larger than what is read, \
                 {columns}×{rows} (0x3800 to 0x3807, 0x3814, 0x3815)"
            ));
        }
        if !scales && [width, height] != read {
            return Some("the picture has to be scaled, and scaling is off (0x5001)".into());
        }
        if line < LEAST_LINE_CLOCKS {
            return Some(format!(
                "a line of {line} clocks (0x380C) is shorter than 1438"
            ));
        }
        if lines < read[1] + left_out + LEAST_BLANK_LINES {
            return Some(format!(
                "{lines} lines (0x380E) are fewer than 24 more than the rows that are read"
            ));
        }
        (row_bytes > line_clocks)
            .then(|| format!("a row's {row_bytes} bytes take longer than a line (0x3824, 0x3108)"))
    }

    /// Lets the automatic control move. Returns exposure in lines, and gain.
    fn controlled(&mut self, line_ns: f64, longest: u32) -> [f64; 2] {
        let manual = self.registers.get(reg::MANUAL);
        let (aec, agc) = (manual & 1 == 0, manual & 2 == 0);
        self.waited += 1;
        let step = if self.hesitant { FRAMES_PER_STEP } else { 1 };
        if (aec || agc) && self.waited >= step {
            self.waited = 0;
            self.control(WELL_EXPOSED_NS / line_ns, longest, [aec, agc]);
        }
        let lines = self.lines().min(f64::from(longest));
        [
            lines,
            f64::from(self.registers.wide(reg::GAIN) & 0x3FF) / 16.0,
        ]
    }

    fn lines(&self) -> f64 {
        let sixteenths = u32::from(self.registers.get(reg::EXPOSURE) & 0x0F) << 16
            | self.registers.wide(reg::EXPOSURE + 1);
        f64::from(sixteenths) / 16.0
    }

    /// Moves towards well exposed, which takes `wanted` lines; exposure before gain.
    fn control(&mut self, wanted: f64, longest: u32, [aec, agc]: [bool; 2]) {
        let wide = |address| f64::from(self.registers.wide(address));
        let most_gain = (wide(reg::MAX_GAIN) / 16.0).max(1.0);
        let longest = wide(reg::MAX_EXPOSURE).min(f64::from(longest)).max(1.0);
        let mut gain = (wide(reg::GAIN) / 16.0).max(1.0);
        let mut lines = self.lines().max(1.0);
        let ratio = wanted / (lines * gain);
        let level = WELL_EXPOSED_LEVEL / ratio;
        let limit = |address| f64::from(self.registers.get(address));
        let rests = limit(reg::LOWEST)..=limit(reg::HIGHEST);
        let step = match self.hesitant {
            true if rests.contains(&level) => return,
            true => ratio.clamp(1.0 / SMALL_STEP, SMALL_STEP),
            false if (ratio - 1.0).abs() < CLOSE => return,
            false => ratio.sqrt(),
        };
        // Close to its aim it gets there.
        let aim = match (step - 1.0).abs() < CLOSE && !self.hesitant {
            true => wanted,
            false => lines * gain * step,
        };
        if aec {
            lines = (aim / if agc { 1.0 } else { gain })
                .clamp(1.0, longest)
                .round();
        }
        if agc {
            gain = (aim / lines).clamp(1.0, most_gain);
        }
        let [_, high, middle, low] = ((lines * 16.0) as u32).to_be_bytes();
        for (at, byte) in (0..).zip([high, middle, low]).filter(|_| aec) {
            self.registers.measured(reg::EXPOSURE + at, byte);
        }
        let gain = ((gain * 16.0).round() as u16).to_be_bytes();
        for (at, byte) in (0..).zip(gain).filter(|_| agc) {
            self.registers.measured(reg::GAIN + at, byte);
        }
    }

    /// Returns the coefficients of the colour matrix with their signs.
    fn matrix(&self) -> [f64; 9] {
        let signs = u32::from(self.registers.get(reg::MATRIX + 9)) << 8
            | u32::from(self.registers.get(reg::MATRIX + 10));
        std::array::from_fn(|i| {
            let value = f64::from(self.registers.get(reg::MATRIX + i as u16));
            if signs >> i & 1 == 1 { -value } else { value }
        })
    }

    fn colour(&self) -> Colour {
        let response = response(self.seed);
        let registers = [reg::RED, reg::GREEN, reg::BLUE];
        let gains = std::array::from_fn(|i| {
            let gain = f64::from(self.registers.wide(registers[i]) & 0xFFF) / 1024.0;
            gain * response[i] * self.light
        });
        Colour::between(&MATRIX, &self.matrix(), gains)
    }
}

/// Returns the sensor's response to white light in red, green and blue: between that of the
/// maker's presets for sunlight and for an office by seed, for seed 1 such that 91 and 102 of 64ths
/// make it white.
fn response(seed: u64) -> [f64; 3] {
    let of = |[red, blue]: [f64; 2]| [64.0 / red, 1.0, 64.0 / blue];
    if seed == 1 {
        return of([91.0, 102.0]);
    }
    let towards_office = f64::from(random(seed, 0x40)) / 255.0;
    let [sun, office] = [[98.0, 79.0], [84.0, 125.0]].map(of);
    std::array::from_fn(|i| sun[i] + towards_office * (office[i] - sun[i]))
}

impl Part for Ov5640 {
    fn output(&self, clock_hz: u64) -> Option<Output> {
        let get = |address| self.registers.get(address);
        let pins = get(reg::OUTPUTS_HIGH) & 0x7F == 0x7F && get(reg::OUTPUTS_LOW) & 0xF0 == 0xF0;
        if !INPUT_CLOCK_HZ.contains(&clock_hz) || get(reg::SYSTEM) & 0x40 != 0 || !pins {
            return None;
        }
        let clocks = self.clocks(clock_hz);
        let window = self.window();
        let [read, ..] = self.read_out();
        let [width, rows] = window.output;
        let [line, lines] = [0, 2].map(|at| u64::from(self.registers.wide(reg::TOTAL + at)));
        let line_clocks = (line * clocks.pixels_hz / clocks.lines_hz).max(1) as u32;
        let row_bytes = 2 * width;
        let fault = self.impossible(&clocks, line_clocks, row_bytes);
        let (format, luma_first) = self.format().unwrap_or((Format::Rgb565, false));
        let bit = |is_set, bit| if is_set { bit } else { 0 };
        let polarity = get(reg::POLARITY);
        Some(Output {
            pixel_clock_hz: clocks.pixels_hz,
            line_clocks,
            lines: (lines as u32).max(VSYNC_LINES + 1),
            vsync_lines: VSYNC_LINES,
            first_row: VSYNC_LINES + LINES_TO_FIRST_ROW,
            rows: if fault.is_some() { 0 } else { rows },
            row_lines: [read[1].max(1), rows.max(1)],
            row_bytes,
            format,
            window,
            // The chip is lit from behind: it sees a mirror image, unless it mirrors it.
            com3: bit(get(reg::FLIP) & 6 == 6, FLIPPED)
                | bit(get(reg::MIRROR) & 6 != 6, MIRRORED)
                | bit(luma_first, LUMA_FIRST)
                | bit(get(reg::TEST) & 0x80 != 0, COLOUR_BARS),
            cr_first: false,
            vsync_active_high: polarity & 0x01 == 0,
            href_active_high: polarity & 0x02 == 0,
            stable_at_rising: polarity & 0x20 != 0,
            clock_between_rows: true,
            inverted: false,
            fault,
        })
    }

    fn expose(&mut self, output: &Output) -> Timing {
        let lines_ns = |lines: u64| output.clocks_ns(lines * u64::from(output.line_clocks));
        let line_ns = lines_ns(1_000) as f64 / 1_000.0;
        let longest = output.lines.saturating_sub(UNEXPOSED_LINES);
        let [lines, gain] = self.controlled(line_ns, longest);
        let light = lines * gain * line_ns / WELL_EXPOSED_NS;
        // The registers hold whole lines and sixteenths.
        let is_close = (light - 1.0).abs() < CLOSE;
        self.light = if is_close { 1.0 } else { light };
        let level = (WELL_EXPOSED_LEVEL * self.light).round().min(255.0);
        self.registers.measured(reg::LEVEL, level as u8);
        let [read, _] = output.row_lines;
        Timing {
            exposure_ns: (lines * line_ns) as u64,
            readout_ns: lines_ns(read.into()),
            ends_ns: lines_ns(u64::from(LINES_TO_FIRST_ROW + read / 2)),
        }
    }

    fn picture(&self, source: &dyn FrameSource, exposed: Exposed, rules: &Rules) -> Picture {
        if let Some((address, value)) = self.registers.missing() {
            rules.broken(|| {
                format!(
                    "OV5640: a frame was captured without {value:02X} in register 0x{address:04X}, \
                     about which all drivers agree"
                )
            });
        }
        let white = self.registers.get(reg::ISP_1) & 1 != 0;
        if white && self.registers.get(reg::MANUAL_WHITE) & 1 == 0 {
            rules.broken(|| {
                "OV5640: a frame was captured with automatic white balance, which is not simulated"
                    .to_owned()
            });
        }
        if self.registers.get(reg::ISP) & GAMMA != 0 {
            rules.broken(|| {
                "OV5640: a frame was captured with its gamma curve (0x5000), which is not simulated"
                    .to_owned()
            });
        }
        let wanted = match self.format() {
            Some((Format::Yuv, _)) => Coding::Yuv422,
            _ => Coding::Rgb565,
        };
        self.colour().apply(source.picture(exposed, wanted))
    }

    fn read(&self, address: u16) -> u16 {
        self.registers.get(address).into()
    }

    fn read_as_another(&self, address: u16) -> u16 {
        match address {
            // An OV5642.
            reg::CHIP_LOW => 0x42,
            address => self.read(address),
        }
    }

    fn write(&mut self, address: u16, value: u16) -> bool {
        let reset = self.registers.write(address, value as u8);
        if reset {
            self.waited = 0;
        }
        reset
    }

    fn forget(&mut self) {
        self.registers.write(reg::MATRIX + 3, 0);
    }

    fn reset(&mut self) {
        *self = Self::new(self.seed, false, self.hesitant);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 320 × 240 in RGB565 of the usual window, as a driver sets it.
    const SET: [(u16, u8); 38] = [
        (reg::OUTPUTS_HIGH, 0xFF),
        (reg::OUTPUTS_LOW, 0xFF),
        (reg::CLOCK_SOURCE, 0x03),
        (reg::PLL_MULTIPLIER, 192),
        (reg::PLL_PREDIVIDER, 0x13),
        (reg::ROOT_DIVIDERS, 0x01),
        (reg::PCLK_DIVIDER, 4),
        (reg::PCLK_CONTROL, 0x22),
        (0x3800, 0x00),
        (0x3801, 128),
        (0x3802, 0x00),
        (0x3803, 100),
        (0x3804, 0x09),
        (0x3805, 0xBF),
        (0x3806, 0x07),
        (0x3807, 0x4F),
        (0x3808, 0x01),
        (0x3809, 0x40),
        (0x380A, 0x00),
        (0x380B, 0xF0),
        (0x380C, 0x05),
        (0x380D, 0x9E),
        (0x380E, 0x01),
        (0x380F, 0xD3),
        (0x3811, 2),
        (0x3813, 1),
        (reg::COLUMN_STEPS, 0x71),
        (reg::ROW_STEPS, 0x35),
        (reg::MIRROR, 0x07),
        (reg::BYTE_ORDER, 0x61),
        (reg::PATH, 0x01),
        (reg::ISP_1, 0x23),
        (reg::MAX_EXPOSURE, 0x01),
        (reg::MAX_EXPOSURE + 1, 0xCF),
        (reg::MAX_GAIN + 1, 0x40),
        (reg::HIGHEST, 0x96),
        (reg::LOWEST, 0x64),
        (reg::ISP, 0x07),
    ];
    const XCLK_HZ: u64 = 12_500_000;

    fn set(also: &[(u16, u8)]) -> Ov5640 {
        let mut part = Ov5640::new(1, false, false);
        for &(address, value) in SET.iter().chain(also) {
            part.write(address, value.into());
        }
        part
    }

    #[test]
    fn it_sends_nothing_after_a_reset_nor_in_standby() {
        assert_eq!(Ov5640::new(1, false, false).output(XCLK_HZ), None);
        assert!(set(&[]).output(XCLK_HZ).is_some());
        assert_eq!(set(&[(reg::SYSTEM, 0x42)]).output(XCLK_HZ), None);
        assert_eq!(set(&[]).output(0), None);
    }

    #[test]
    fn the_usual_window_is_the_picture_at_119_frames_a_second() {
        let output = set(&[]).output(XCLK_HZ).unwrap();
        assert_eq!(output.fault, None);
        assert_eq!((output.rows, output.row_bytes), (240, 640));
        assert_eq!(output.pixel_clock_hz, 40_000_000);
        let window = output.window;
        assert_eq!((window.start, window.size), ([0, 0], [320, 240]));
        let rate = 1e9 / output.clocks_ns(output.frame_clocks()) as f64;
        assert!((rate - 119.1).abs() < 0.1, "{rate}");
        assert_eq!(output.com3 & (MIRRORED | FLIPPED), 0);
        let rows = (0..output.lines).filter_map(|line| output.row_of(line));
        assert!(rows.eq(0..240));
    }

    #[test]
    fn the_divider_of_all_clocks_lowers_the_rate_alone() {
        let [full, half] = [0x11, 0x21].map(|divider| {
            let output = set(&[(reg::PLL_DIVIDER, divider)]).output(XCLK_HZ).unwrap();
            (output.clocks_ns(output.frame_clocks()), output.line_clocks)
        });
        // Times are rounded to nanoseconds.
        assert!(half.0.abs_diff(2 * full.0) <= 1, "{full:?} {half:?}");
        assert_eq!(half.1, full.1);
    }

    #[test]
    fn what_it_cannot_do_gives_no_rows_and_the_register() {
        for (also, reported) in [
            ((reg::PLL_MULTIPLIER, 100), "0x3036"),
            ((reg::PLL_MULTIPLIER, 210), "84 MHz"),
            ((reg::CLOCK_SOURCE, 0x01), "0x3103"),
            ((reg::PCLK_DIVIDER, 8), "0x3824"),
            ((0x3804, 0x0B), "not within the array"),
            ((reg::COLUMN_STEPS, 0xF1), "0x3814"),
            ((reg::ISP_1, 0x03), "0x5001"),
            ((0x380D, 0x00), "0x380C"),
            ((0x380F, 0x00), "0x380E"),
            ((reg::BYTE_ORDER, 0x6F), "0x4300"),
        ] {
            let output = set(&[also]).output(XCLK_HZ).unwrap();
            assert_eq!(output.rows, 0);
            assert!(
                output.fault.as_ref().unwrap().contains(reported),
                "{output:?}"
            );
        }
    }

    #[test]
    fn the_automatic_control_reaches_the_longest_exposure_and_then_amplifies() {
        let mut part = set(&[]);
        let output = part.output(XCLK_HZ).unwrap();
        for _ in 0..12 {
            part.expose(&output);
        }
        assert_eq!((part.light, part.lines()), (1.0, 463.0));
        let gain = part.registers.wide(reg::GAIN);
        assert!((48..=49).contains(&gain), "{gain}");
        part.write(reg::MANUAL, 0x03);
        part.write(reg::GAIN + 1, 24);
        part.expose(&output);
        assert!((part.light - 0.49).abs() < 0.01, "{}", part.light);
    }

    #[test]
    fn colours_are_the_scenes_with_the_drivers_matrix_and_the_lights_gains() {
        let gains = [(0x3400, 91u16), (0x3402, 64), (0x3404, 102)];
        let white = gains.into_iter().flat_map(|(at, gain)| {
            let [high, low] = (gain << 4).to_be_bytes();
            [(at, high), (at + 1, low)]
        });
        let matrix = [
            0x1E, 0x5B, 0x08, 0x0A, 0x7E, 0x88, 0x7C, 0x6C, 0x10, 0x01, 0x98,
        ];
        let mut also: Vec<(u16, u8)> = white.chain((reg::MATRIX..).zip(matrix)).collect();
        assert!(set(&also).colour().is_plain());
        also.push((reg::GREEN, 0x02));
        assert!(!set(&also).colour().is_plain());
    }
}
