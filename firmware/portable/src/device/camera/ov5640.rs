//! OmniVision OV5640: 320 × 240, RGB565 or YUV422, rows exposed one after the other.
//!
//! Frames and model are those of the OV7725: with a lens of 1.8 mm, the window has as many pixels a
//! radian.

use super::{Facts, Rolling};
use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, Rate, White};
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;

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
/// Its pixel formats; the first is the default.
pub const PIXELS: &[PixelFormat] = &[PixelFormat::Rgb565, PixelFormat::Yuv422];

/// Clock that the board supplies, Hz.
pub const XCLK_HZ: u32 = 12_500_000;
/// Gains of white in the middle between OmniVision's presets for sunlight (98, 79 of 64ths) and for
/// an office (84, 125).
pub const WHITE: White = White { red: 91, blue: 102 };

/// Columns and rows of the array, of 1.4 µm, that a frame shows.
pub const WINDOW: [u16; 2] = [2_352, 1_764];
/// One column and row in this many is read, binned from two.
pub const SUBSAMPLING: u16 = 4;
/// Lines from frame to frame: those of the window, two for the interpolation, 24 blank ones. Linux
/// and OpenMV have no fewer blank ones.
pub const LINES: u16 = WINDOW[1] / SUBSAMPLING + 2 + 24;
/// Clocks of a line: OpenMV has no fewer.
pub const LINE_CLOCKS: u16 = 1_438;
/// Clocks from frame to frame.
const FRAME_CLOCKS: u64 = LINES as u64 * LINE_CLOCKS as u64;
/// The clock of the lines at the full rate, Hz: that of OpenMV. Lower rates divide it.
const FULL_CLOCK_HZ: u64 = 80_000_000;
/// Longest exposure, lines, as in Linux.
pub const LONGEST_EXPOSURE: u16 = LINES - 4;
/// Lines from the VSYNC edge that begins a frame to the first row (data sheet, DVP timing).
const LINES_TO_FIRST_ROW: u32 = 17;
/// The same to the middle row.
const LINES_TO_MIDDLE_ROW: u32 = LINES_TO_FIRST_ROW + (WINDOW[1] / SUBSAMPLING) as u32 / 2;
/// Exposure of its rows, one after the other: a row of a frame is 1.84 lines.
pub const MOTION: Motion =
    Motion::rolling((LINES as u32 * HEIGHT as u32 / (WINDOW[1] / SUBSAMPLING) as u32) as u16);

/// The times of its rows.
pub const ROWS: Rolling = Rolling {
    lines: LINES,
    longest_exposure: LONGEST_EXPOSURE,
    to_middle_row: LINES_TO_MIDDLE_ROW,
    frame_clocks: FRAME_CLOCKS,
    full_clock_hz: FULL_CLOCK_HZ,
};
/// The limits of its settings.
pub const LIMITS: CameraLimits = ROWS.limits();

/// Its facts.
pub const FACTS: Facts = Facts {
    name: NAME,
    limits: LIMITS,
    motion: MOTION,
    frame_us,
};

/// Time from frame to frame, µs.
pub const fn frame_us(rate: Rate) -> u32 {
    ROWS.frame_us(rate)
}
