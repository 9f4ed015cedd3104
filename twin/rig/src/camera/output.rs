//! The OV7725's output by its registers: size, format, clock, polarities and the timing of a frame.
//!
//! Frame timing (datasheet, "Timing specifications"): VGA 784 × 510 pixel periods with 640 × 480
//! active, QVGA 576 × 278 with 320 × 240 active, VSYNC for the first four lines, then 18 or 22
//! blank ones before the first row. A pixel period is two pixel clocks, one for raw data. At 24 MHz
//! with the power-up divider and loop (×4 ÷ 2) that is VGA at 60 frames per second.

use super::registers::{self as reg, Registers};

/// Duration of the OV7725's VSYNC, lines.
const VSYNC_LINES: u32 = 4;
/// Fastest pixel clock of the sensor, Hz. Its data sheet gives 48 MHz; drivers run it up to 187
/// frames per second of QVGA (Linux, gspca's `ov534.c`), which is 60 MHz.
const FASTEST_PIXEL_CLOCK_HZ: u64 = 60_000_000;
/// Range of the input clock, Hz.
const INPUT_CLOCK_HZ: std::ops::RangeInclusive<u64> = 10_000_000..=48_000_000;

/// How a pixel is coded on the lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Y and alternating Cb, Cr; two bytes per pixel.
    Yuv,
    /// Red 5, green 6, blue 5 bits, high byte first.
    Rgb565,
    /// Red 5, green 5, blue 5 bits, high byte first.
    Rgb555,
    /// Red 4, green 4, blue 4 bits, high byte first.
    Rgb444,
    /// G B G R.
    Gbr,
    /// One byte per pixel, B G / G R.
    Bayer,
    /// One byte per pixel, without colour.
    Mono,
}

/// The area of the pixel array that is read, and the size in which it is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Columns and rows of the pixel array: 640 × 480, or 320 × 240 in QVGA mode.
    pub array: [u32; 2],
    /// Offset of the window from the array's corner.
    pub start: [i32; 2],
    /// Columns and rows of the window.
    pub size: [u32; 2],
    /// Columns and rows that are sent.
    pub output: [u32; 2],
}

/// All parameters of one frame's signals.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Pixel clock, Hz.
    pub pixel_clock_hz: u64,
    /// Pixel clocks per line.
    pub line_clocks: u32,
    /// Lines per frame, blank ones included.
    pub lines: u32,
    /// Duration of VSYNC in lines, from the first one on.
    pub vsync_lines: u32,
    /// The line of the first row.
    pub first_row: u32,
    /// Rows sent; 0 if the registers ask for something that the sensor cannot do.
    pub rows: u32,
    /// Lines from row to row, as a fraction: a camera that scales sends fewer rows than it reads.
    pub row_lines: [u32; 2],
    /// Bytes per row.
    pub row_bytes: u32,
    /// Format.
    pub format: Format,
    /// Window.
    pub window: Window,
    /// COM3: flip, mirror and byte orders.
    pub com3: u8,
    /// Cr comes before Cb.
    pub cr_first: bool,
    /// VSYNC is high during the first lines of a frame.
    pub vsync_active_high: bool,
    /// HREF is high while a row is sent.
    pub href_active_high: bool,
    /// Data are stable at the rising edge of PCLK.
    pub stable_at_rising: bool,
    /// PCLK runs between rows.
    pub clock_between_rows: bool,
    /// The data lines are inverted.
    pub inverted: bool,
    /// The reason why no rows are sent.
    pub fault: Option<String>,
}

impl Output {
    /// Returns the output by the registers at an input clock (XCLK) in Hz. Returns `None` if the
    /// sensor sleeps or has no usable clock.
    pub fn new(registers: &Registers, input_clock_hz: u64) -> Option<Output> {
        if !INPUT_CLOCK_HZ.contains(&input_clock_hz) || registers.get(reg::COM2) & 0x10 != 0 {
            return None;
        }
        let mut output = Self::unchecked(registers, input_clock_hz);
        output.fault = output.impossible(registers);
        if output.fault.is_some() {
            output.rows = 0;
        }
        Some(output)
    }

    fn unchecked(registers: &Registers, input_clock_hz: u64) -> Output {
        let qvga = registers.get(reg::COM7) & 0x40 != 0;
        let [total, blank_before, lines] = if qvga { [576, 22, 278] } else { [784, 18, 510] };
        let format = format(registers.get(reg::COM7));
        let clocks = if format == Format::Bayer { 1 } else { 2 };
        let dummy_pixels = registers.wide(
            reg::EXHCL,
            0,
            u32::from(registers.get(reg::EXHCH) & 0xF0) << 4,
        );
        let dummy_lines = registers.wide(reg::ADVFH, 8, u32::from(registers.get(reg::ADVFL)));
        let window = window(registers, qvga);
        let com10 = registers.get(reg::COM10);
        Output {
            pixel_clock_hz: pixel_clock_hz(registers, input_clock_hz),
            line_clocks: (total + dummy_pixels) * clocks,
            lines: lines + dummy_lines,
            vsync_lines: VSYNC_LINES,
            first_row: VSYNC_LINES + blank_before,
            rows: window.output[1],
            row_lines: [1, 1],
            row_bytes: window.output[0] * clocks,
            format,
            window,
            com3: registers.get(reg::COM3),
            cr_first: registers.get(reg::DSP_CTRL3) & 0x80 != 0,
            vsync_active_high: com10 & 0x02 == 0,
            href_active_high: com10 & 0x08 == 0,
            stable_at_rising: com10 & 0x10 == 0,
            clock_between_rows: com10 & 0x20 == 0,
            inverted: com10 & 0x80 != 0,
            fault: None,
        }
    }

    /// Describes a setting of the registers that the sensor cannot do; `None` if all are possible.
    fn impossible(&self, registers: &Registers) -> Option<String> {
        let Window {
            array,
            size,
            output,
            ..
        } = self.window;
        if size[0] > array[0] || size[1] > array[1] {
            let [[w, h], [aw, ah]] = [size, array];
            return Some(format!(
                "window {w}×{h} (HSIZE, VSIZE) is larger than the array, {aw}×{ah} (COM7)"
            ));
        }
        if output[0] > size[0] || output[1] > size[1] {
            let [[w, h], [ww, wh]] = [output, size];
            return Some(format!(
                "output {w}×{h} (HOUTSIZE, VOUTSIZE) is larger than the window, {ww}×{wh}"
            ));
        }
        if self.pixel_clock_hz > FASTEST_PIXEL_CLOCK_HZ {
            return Some(format!(
                "pixel clock {} Hz is over 60 MHz (CLKRC, COM4)",
                self.pixel_clock_hz
            ));
        }
        (registers.get(reg::COM10) & 0x40 != 0)
            .then(|| "HSYNC instead of HREF (COM10 bit 6) is not simulated".into())
    }

    /// Returns the row that is sent in a line of the frame; `None` in a blank line.
    pub fn row_of(&self, line: u32) -> Option<u32> {
        let [lines, rows] = self.row_lines;
        let after = line.checked_sub(self.first_row)?;
        let row = (after * rows).div_ceil(lines);
        (row < self.rows && row * lines / rows == after).then_some(row)
    }

    /// Returns the pixel clocks of one frame.
    pub fn frame_clocks(&self) -> u64 {
        u64::from(self.line_clocks) * u64::from(self.lines)
    }

    /// Returns the time of a number of pixel clocks, ns, rounded down.
    pub fn clocks_ns(&self, clocks: u64) -> u64 {
        let ns = u128::from(clocks) * 1_000_000_000 / u128::from(self.pixel_clock_hz);
        u64::try_from(ns).unwrap_or(u64::MAX)
    }
}

fn pixel_clock_hz(registers: &Registers, input_clock_hz: u64) -> u64 {
    let multiplier = [1, 4, 6, 8][usize::from(registers.get(reg::COM4) >> 6)];
    let clkrc = registers.get(reg::CLKRC);
    let divider = if clkrc & 0x40 != 0 {
        1
    } else {
        2 * (u64::from(clkrc & 0x3F) + 1)
    };
    input_clock_hz * multiplier / divider
}

/// Returns the coding of pixels by COM7.
pub(super) fn format(com7: u8) -> Format {
    match (com7 & 3, com7 >> 2 & 3) {
        (0, _) => Format::Yuv,
        (2, 0) => Format::Gbr,
        (2, 1) => Format::Rgb565,
        (2, 2) => Format::Rgb555,
        (2, _) => Format::Rgb444,
        _ => Format::Bayer,
    }
}

/// Returns window and output size. The nominal start is (140, 14) in VGA and (252, 6) in QVGA mode.
fn window(registers: &Registers, qvga: bool) -> Window {
    let href = u32::from(registers.get(reg::HREF));
    let low = u32::from(registers.get(reg::EXHCH));
    let nominal = if qvga { [252, 6] } else { [140, 14] };
    let start = [
        registers.wide(reg::HSTART, 2, href >> 4 & 3),
        registers.wide(reg::VSTRT, 1, href >> 6 & 1),
    ];
    Window {
        array: if qvga { [320, 240] } else { [640, 480] },
        start: [start[0] as i32 - nominal[0], start[1] as i32 - nominal[1]],
        size: [
            registers.wide(reg::HSIZE, 2, href & 3),
            registers.wide(reg::VSIZE, 1, href >> 2 & 1),
        ],
        output: [
            registers.wide(reg::HOUTSIZE, 2, low & 3),
            registers.wide(reg::VOUTSIZE, 1, low >> 2 & 1),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn qvga_rgb565() -> Registers {
        let mut registers = Registers::default();
        for (address, value) in [
            (reg::COM7, 0x46),
            (reg::HSTART, 0x3F),
            (reg::HSIZE, 0x50),
            (reg::VSTRT, 0x03),
            (reg::VSIZE, 0x78),
            (reg::HOUTSIZE, 0x50),
            (reg::VOUTSIZE, 0x78),
        ] {
            registers.write(address, value);
        }
        registers
    }

    #[test]
    fn powers_up_as_vga_yuv_at_sixty_frames_per_second() {
        let output = Output::new(&Registers::default(), 24_000_000).unwrap();
        assert_eq!(
            (output.row_bytes, output.rows, output.format),
            (1280, 480, Format::Yuv)
        );
        assert_eq!(output.pixel_clock_hz, 48_000_000);
        let rate = 1e9 / output.clocks_ns(output.frame_clocks()) as f64;
        assert!((rate - 60.0).abs() < 0.1, "{rate}");
        assert!(output.vsync_active_high && output.href_active_high && output.stable_at_rising);
        assert_eq!(output.fault, None);
    }

    #[test]
    fn qvga_rgb565_is_what_its_registers_say() {
        let output = Output::new(&qvga_rgb565(), 24_000_000).unwrap();
        assert_eq!(
            (output.row_bytes, output.rows, output.format),
            (640, 240, Format::Rgb565)
        );
        assert_eq!(output.window.start, [0, 0]);
        let rate = 1e9 / output.clocks_ns(output.frame_clocks()) as f64;
        assert!((rate - 149.9).abs() < 0.1, "{rate}");
    }

    #[test]
    fn qvga_with_the_vga_window_sends_no_rows_and_says_why() {
        let mut registers = Registers::default();
        registers.write(reg::COM7, 0x46);
        let output = Output::new(&registers, 24_000_000).unwrap();
        assert_eq!(output.rows, 0);
        assert!(output.fault.unwrap().contains("HSIZE"));
    }

    #[test]
    fn rows_of_a_scaled_picture_come_in_some_of_the_lines() {
        let output = Output {
            first_row: 10,
            rows: 4,
            row_lines: [7, 4],
            ..Output::new(&qvga_rgb565(), 24_000_000).unwrap()
        };
        let sent: Vec<_> = (0..20)
            .filter(|&line| output.row_of(line).is_some())
            .collect();
        assert_eq!(sent, [10, 11, 13, 15]);
        assert_eq!(output.row_of(15), Some(3));
    }

    #[test]
    fn the_divider_and_the_loop_set_the_pixel_clock() {
        let mut registers = qvga_rgb565();
        for (clkrc, com4, expected) in [
            (0x80, 0x41, 48_000_000),
            (0x81, 0x41, 24_000_000),
            (0xC0, 0x01, 24_000_000),
            (0x03, 0x01, 3_000_000),
        ] {
            registers.write(reg::CLKRC, clkrc);
            registers.write(reg::COM4, com4);
            assert_eq!(
                Output::new(&registers, 24_000_000).unwrap().pixel_clock_hz,
                expected
            );
        }
    }

    #[test]
    fn without_a_usable_clock_or_asleep_nothing_is_sent() {
        assert_eq!(Output::new(&Registers::default(), 0), None);
        assert_eq!(Output::new(&Registers::default(), 64_000_000), None);
        let mut asleep = Registers::default();
        asleep.write(reg::COM2, 0x11);
        assert_eq!(Output::new(&asleep, 24_000_000), None);
    }

    #[test]
    fn dummy_pixels_and_lines_slow_the_frames_down() {
        let mut registers = qvga_rgb565();
        registers.write(reg::EXHCH, 0x10);
        registers.write(reg::EXHCL, 0x02);
        registers.write(reg::ADVFL, 22);
        let output = Output::new(&registers, 24_000_000).unwrap();
        assert_eq!(output.line_clocks, (576 + 0x102) * 2);
        assert_eq!(output.lines, 300);
    }
}
