//! onsemi (Aptina) MT9V034, mono, with a global shutter: 160 × 152 pixels, each 2 × 2 binned.

use super::Facts;
use hivtac_sensor::motion::Motion;
use hivtac_terms::camera::{CameraLimits, Rate};
use hivtac_terms::geometry::Preset;
use hivtac_terms::threshold::PixelFormat;
use hivtac_terms::units::Microseconds;

/// Name in the device's hello.
pub const NAME: &str = "mt9v034";
/// Its identification number.
pub const ID: u16 = 0x1324;
/// Its lens and pixels.
pub const PRESET: Preset = Preset::Mt9v034;
/// Columns of a frame, px. More than the markers need: rows take the same time down to 80.
pub const WIDTH: u16 = 160;
/// Rows of a frame, px: the markers' reach in the calibrated range.
pub const HEIGHT: u16 = 152;
/// Its pixel formats.
pub const PIXELS: &[PixelFormat] = &[PixelFormat::Mono];

/// Clock that the board supplies, Hz; at most 27 MHz.
pub const XCLK_HZ: u32 = 240_000_000 / 9;

/// Exposure of its rows: all at once.
pub const MOTION: Motion = Motion::GLOBAL;

/// Clocks of a row. The converters, one for each column, need 690 for any width of the window, and
/// 704 while columns are binned (MT9V024 data sheet); PX4Flow saw distorted rows below 709.
pub const ROW_CLOCKS: u16 = 710;

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

/// Number of blank rows of a frame, at least 10: with fewer, PX4Flow saw dark rows while rows are
/// binned.
pub const fn blank_rows(rate: Rate) -> u16 {
    match rate {
        Rate::Full => 10,
        Rate::Half => 172,
        Rate::Quarter => 496,
    }
}

/// Longest exposure, rows. At the full rate it is 2.5 ms, and half of it is part of a force's
/// latency.
pub const fn longest_exposure(rate: Rate) -> u16 {
    match rate {
        Rate::Full => 94,
        Rate::Half => 210,
        Rate::Quarter => 420,
    }
}

/// Its facts.
pub const FACTS: Facts = Facts {
    name: NAME,
    limits: LIMITS,
    motion: MOTION,
    frame_us,
};

/// Time from frame to frame, µs: rows with data and blank ones.
pub const fn frame_us(rate: Rate) -> u32 {
    rows_us(HEIGHT + blank_rows(rate))
}

/// Shortest and longest exposure: from one row to the longest.
const fn exposures(rate: Rate) -> [Microseconds; 2] {
    [
        Microseconds(rows_us(1) + 1),
        Microseconds(rows_us(longest_exposure(rate))),
    ]
}

/// The time of `rows` rows, µs.
pub const fn rows_us(rows: u16) -> u32 {
    (rows as u64 * ROW_CLOCKS as u64 * 1_000_000 / XCLK_HZ as u64) as u32
}

/// The number of rows nearest to a time.
pub fn rows_in(exposure: Microseconds) -> u16 {
    let clocks = u64::from(exposure.0) * u64::from(XCLK_HZ) / 1_000_000;
    let row_clocks = u64::from(ROW_CLOCKS);
    u16::try_from((clocks + row_clocks / 2) / row_clocks).unwrap_or(u16::MAX)
}

/// Time from the VSYNC edge that begins a frame to the middle of its exposure, µs: negative,
/// because all rows' exposure ends before the first one is read.
pub const fn middle_us(exposed: Microseconds) -> i32 {
    -(exposed.0 as i32) / 2
}
