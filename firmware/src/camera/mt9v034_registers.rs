//! The MT9V034's registers that the firmware writes, and why. Everything else keeps its value after
//! reset.
//!
//! Numbers and names: onsemi's MT9V034 data sheet, beside the drivers of Linux (`mt9v032.c`) and
//! OpenMV (`mt9v0xx.c`).

use super::{HEIGHT, WIDTH};
use crate::seeded_bugs;
use hivtac_terms::camera::Rate;
use hivtac_terms::threshold::PixelFormat;

/// Bit 0: every register back to its power-up value.
pub const RESET: u8 = 0x0C;
/// What is automatic: exposure (bit 0) and gain (bit 1), for both of the sensor's contexts; the
/// other one has them eight bits above.
pub const AEC_AGC_ENABLE: u8 = 0xAF;
/// [`AEC_AGC_ENABLE`]: exposure.
pub const AUTOMATIC_EXPOSURE: u16 = 0x0101;
/// [`AEC_AGC_ENABLE`]: gain.
pub const AUTOMATIC_GAIN: u16 = 0x0202;
/// [`AEC_AGC_ENABLE`]: neither.
pub const LOCKED: u16 = 0x0000;
/// Exposure, rows, when it is not automatic.
pub const SHUTTER_WIDTH: u8 = 0x0B;
/// Analog gain in sixteenths, 16 to 64, when it is not automatic; bit 15, an attenuation, is clear.
pub const ANALOG_GAIN: u8 = 0x35;
/// What the automatic control has found: gain, as in [`ANALOG_GAIN`]; exposure in rows.
pub const FOUND: [u8; 2] = [0xBA, 0xBB];
/// Longest exposure, rows. At the full rate 2.5 ms: half of it is a part of a force's latency.
pub const fn longest_exposure(rate: Rate) -> u16 {
    match rate {
        Rate::Full => 96,
        Rate::Half => 210,
        Rate::Quarter => 420,
    }
}

/// Columns and rows of the array that make one pixel.
const BINNING: u16 = 2;
/// The array: its size, and the number of its first column and row.
const ARRAY: [u16; 2] = [752, 480];
const FIRST: [u16; 2] = [1, 4];
/// Columns and rows of the array that are read: about its middle, where the lens looks.
const WINDOW: [u16; 2] = [WIDTH * BINNING, HEIGHT * BINNING];
/// Clocks of a row. The converters, one for each column, take so many, however narrow the window.
pub const ROW_CLOCKS: u16 = 690;
/// Shortest horizontal blanking while columns are binned by two, clocks.
const LEAST_BLANKING: u16 = 71;
/// Blank rows of a frame, at least 4.
pub const fn blank_rows(rate: Rate) -> u16 {
    match rate {
        Rate::Full => 6,
        Rate::Half => 164,
        Rate::Quarter => 480,
    }
}

/// [`TABLE`]'s companion: how often the camera sends a frame, and how long it exposes at most.
pub const fn rows_for(rate: Rate) -> &'static [(u8, u16)] {
    match rate {
        Rate::Full => const { &rows_registers(Rate::Full) },
        Rate::Half => const { &rows_registers(Rate::Half) },
        Rate::Quarter => const { &rows_registers(Rate::Quarter) },
    }
}

const fn rows_registers(rate: Rate) -> [(u8, u16); 3] {
    let longest = longest_exposure(rate);
    // A longer exposure would lengthen the frame.
    assert!(longest + 2 <= HEIGHT + blank_rows(rate));
    [
        // Vertical blanking, rows.
        (0x06, blank_rows(rate)),
        // Longest automatic exposure, and the one before the control has looked.
        (0xAD, longest),
        (SHUTTER_WIDTH, longest),
    ]
}

const _: () = assert!(WINDOW[0] + LEAST_BLANKING <= ROW_CLOCKS);

/// The only pixel format of a sensor that sees no colours: a byte a pixel, the upper eight of its
/// ten bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Luma.
    Mono,
}

impl Format {
    /// The one of such pixels, if the camera sends it.
    pub const fn of(pixels: PixelFormat) -> Option<Format> {
        match pixels {
            PixelFormat::Mono => Some(Format::Mono),
            PixelFormat::Rgb565 | PixelFormat::Yuv422 => None,
        }
    }

    /// Its pixels.
    pub const fn pixels(self) -> PixelFormat {
        PixelFormat::Mono
    }
}

/// Register, value: written in this order after a reset, and read back.
pub const TABLE: &[(u8, u16)] = &[
    // Chip control: context A (bit 15 clear), exposure while the frame before is read out (bit 8),
    // parallel data (bit 7), frames without end (bit 3). Bit 9, reserved and set after a reset, is
    // cleared as OpenMV's driver does.
    (0x07, 0x0188),
    // Column start, row start, window height and width, in columns and rows of the array.
    (0x01, FIRST[0] + (ARRAY[0] - WINDOW[0]) / 2),
    (0x02, FIRST[1] + (ARRAY[1] - WINDOW[1]) / 2),
    (0x03, WINDOW[1]),
    (0x04, WINDOW[0]),
    // Horizontal blanking, clocks.
    (0x05, ROW_CLOCKS - WINDOW[0]),
    // Read mode: rows (bits 1:0 = 1) and columns (bits 3:2 = 1) binned by two, neither flipped.
    // Bits 9:8 are reserved and set.
    (
        0x0D,
        if seeded_bugs::CAMERA_REGISTER {
            0x0300
        } else {
            0x0305
        },
    ),
    // Pixel operation mode: one slope, no high dynamic range, no colours.
    (0x0F, 0x0000),
    // ADC: ten bits in proportion to light, in both contexts.
    (0x1C, 0x0202),
    // Row noise correction on, in both contexts, as in OpenMV's table.
    (0x70, 0x0101),
    // Pixel clock: LINE_VALID and FRAME_VALID high with data, PIXCLK rising in the middle of each
    // datum. `mt9v034.rs` tells DCMI the same.
    (0x72, 0x0000),
    // Brightness that the automatic control looks for, in 64ths of white: a bright film that is not
    // saturated, as with the OV7725.
    (0xA5, 35),
    // Largest gain, sixteenths: beyond 4× noise costs more than light gains.
    (0xAB, 64),
    // Pixels that the automatic control counts: an eighth of the frame's, as in OpenMV's driver.
    (0xB0, WIDTH * HEIGHT / 8),
    (AEC_AGC_ENABLE, AUTOMATIC_EXPOSURE | AUTOMATIC_GAIN),
];
