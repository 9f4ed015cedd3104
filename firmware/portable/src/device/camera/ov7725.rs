//! OmniVision OV7725: 320 × 240, RGB565 or YUV422, rows exposed one after the other.

use super::{Facts, Rolling};
use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, Rate};
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;

/// Name in the device's hello.
pub const NAME: &str = "ov7725";
/// Its identification number.
pub const ID: u16 = 0x7721;
/// Its lens and pixels.
pub const PRESET: Preset = Preset::Ov7725;
/// Columns of a frame, px.
pub const WIDTH: u16 = 320;
/// Rows of a frame, px.
pub const HEIGHT: u16 = 240;
/// Its pixel formats; the first is the default.
pub const PIXELS: &[PixelFormat] = &[PixelFormat::Rgb565, PixelFormat::Yuv422];

/// Clock that the board supplies, Hz.
pub const XCLK_HZ: u32 = 12_500_000;

/// Lines from frame to frame, blank ones included.
pub const LINES: u16 = 278;
/// Longest exposure, lines: the camera clamps longer ones (OmniVision OV7675, maximum exposure).
pub const LONGEST_EXPOSURE: u16 = LINES - 2;
/// Exposure of its rows: one after the other.
pub const MOTION: Motion = Motion::rolling(LINES);
/// Clocks from frame to frame: lines of 576 pixels of two bytes, one byte per PCLK.
const FRAME_CLOCKS: u64 = LINES as u64 * 576 * 2;
/// Lines from the VSYNC edge that begins a frame to the middle row: 22 blank lines and half of the
/// rows.
const LINES_TO_MIDDLE_ROW: u32 = 22 + HEIGHT as u32 / 2;
/// PCLK at the full rate: XCLK times the sensor's PLL factor. Lower rates divide it.
const FULL_PCLK_HZ: u64 = 4 * XCLK_HZ as u64;

/// The times of its rows.
pub const ROWS: Rolling = Rolling {
    lines: LINES,
    longest_exposure: LONGEST_EXPOSURE,
    to_middle_row: LINES_TO_MIDDLE_ROW,
    frame_clocks: FRAME_CLOCKS,
    full_clock_hz: FULL_PCLK_HZ,
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
