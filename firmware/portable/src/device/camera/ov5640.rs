//! OmniVision OV5640: 320 × 240, RGB565 or YUV422, rows exposed one after the other.
//!
//! Frames and model are those of the OV7725: with a lens of 1.8 mm, the window makes a radian as
//! many pixels.

use super::Facts;
use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, Rate, White};
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::Microseconds;

/// Name in the device's hello.
pub const NAME: &str = "ov5640";
/// Its identification number.
pub const ID: u16 = 0x5640;
/// Its lens and pixels: 1.8 mm on 10.29 µm is 174.9 px a radian, where the OV7725 has 175.
pub const PRESET: Preset = Preset::Ov7725;
/// Columns of a frame, px.
pub const WIDTH: u16 = 320;
/// Rows of a frame, px.
pub const HEIGHT: u16 = 240;
/// What it can send; the first one if no other is requested.
pub const PIXELS: &[PixelFormat] = &[PixelFormat::Rgb565, PixelFormat::Yuv422];

/// Clock that the board supplies, Hz.
pub const XCLK_HZ: u32 = 12_500_000;
/// Gains of white in the middle between OmniVision's presets for sunlight (98, 79 of 64ths) and for
/// an office (84, 125).
pub const WHITE: White = White { red: 91, blue: 102 };

/// Columns and rows of the array, of 1.4 µm, that a frame shows.
pub const WINDOW: [u16; 2] = [2_352, 1_764];
/// Of so many columns and rows one is read, binned from two.
pub const SUBSAMPLING: u16 = 4;
/// Lines from frame to frame: those of the window, two for the interpolation, 24 blank ones. Linux
/// and OpenMV have no fewer blank ones.
pub const LINES: u16 = WINDOW[1] / SUBSAMPLING + 2 + 24;
/// Clocks of a line: OpenMV has no fewer.
pub const LINE_CLOCKS: u16 = 1_438;
/// The clock of the lines at the full rate, Hz: that of OpenMV. Lower rates divide it.
const FULL_CLOCK_HZ: u64 = 80_000_000;
/// Longest exposure, lines, as in Linux.
pub const LONGEST_EXPOSURE: u16 = LINES - 4;
/// Lines from the VSYNC edge that begins a frame to the first row (data sheet, DVP timing).
const LINES_TO_FIRST_ROW: u32 = 17;
/// The same to the middle row. A row's exposure ends when it is read, which is when it is sent.
const LINES_TO_MIDDLE_ROW: u32 = LINES_TO_FIRST_ROW + (WINDOW[1] / SUBSAMPLING) as u32 / 2;
/// Exposure of its rows, one after the other: a row of a frame is 1.84 lines.
pub const MOTION: Motion =
    Motion::rolling((LINES as u32 * HEIGHT as u32 / (WINDOW[1] / SUBSAMPLING) as u32) as u16);

/// The limits of its settings.
pub const LIMITS: CameraLimits = super::limits(
    [
        frame_us(Rate::Full),
        frame_us(Rate::Half),
        frame_us(Rate::Quarter),
    ],
    [
        exposures(Rate::Full),
        exposures(Rate::Half),
        exposures(Rate::Quarter),
    ],
);

/// Its facts.
pub const FACTS: Facts = Facts {
    name: NAME,
    limits: LIMITS,
    motion: MOTION,
    frame_us,
};

/// Time from frame to frame, µs.
pub const fn frame_us(rate: Rate) -> u32 {
    let clocks = LINES as u64 * LINE_CLOCKS as u64 * rate.divisor() as u64;
    (clocks * 1_000_000 / FULL_CLOCK_HZ) as u32
}

/// Shortest and longest exposure: from one line to the longest.
const fn exposures(rate: Rate) -> [Microseconds; 2] {
    [
        Microseconds(frame_us(rate).div_ceil(LINES as u32)),
        exposed(LONGEST_EXPOSURE as u32, rate),
    ]
}

/// The number of lines nearest to a time, at least 1 and at most [`LONGEST_EXPOSURE`].
pub fn lines(exposure: Microseconds, rate: Rate) -> u16 {
    super::lines_in(exposure, frame_us(rate), LINES).clamp(1, LONGEST_EXPOSURE)
}

/// The exposure of a row, of a number of lines.
pub const fn exposed(lines: u32, rate: Rate) -> Microseconds {
    Microseconds(lines * frame_us(rate) / LINES as u32)
}

/// Time from the VSYNC edge that begins a frame to the middle of its middle row's exposure of at
/// most [`LINES`] lines, µs.
pub const fn middle_us(lines: u32, rate: Rate) -> i32 {
    super::middle_us(LINES_TO_MIDDLE_ROW, lines, frame_us(rate), LINES)
}
