//! Lists the MT9V034's registers that the firmware writes, and why. All other registers keep their
//! value after reset.
//!
//! Numbers and names are from onsemi's MT9V034 data sheet, and from the drivers of Linux
//! (`mt9v032.c`), OpenMV (`mt9v0xx.c`) and PX4Flow (`mt9v34.c`).

use super::{HEIGHT, WIDTH};
use crate::seeded_bugs;
use hivtac_portable::device::camera::mt9v034::{ROW_CLOCKS, blank_rows, longest_exposure};
use hivtac_terms::camera::Rate;
use hivtac_terms::threshold::PixelFormat;

/// Bit 0 resets every register to its power-up value.
pub const RESET: u16 = 0x0C;
/// Enables automatic exposure (bit 0) and gain (bit 1) for one of the sensor's contexts, and eight
/// bits higher for the other one.
pub const AEC_AGC_ENABLE: u16 = 0xAF;
/// [`AEC_AGC_ENABLE`]: exposure.
pub const AUTOMATIC_EXPOSURE: u16 = 0x0101;
/// [`AEC_AGC_ENABLE`]: gain.
pub const AUTOMATIC_GAIN: u16 = 0x0202;
/// [`AEC_AGC_ENABLE`]: neither.
pub const LOCKED: u16 = 0x0000;
/// Exposure in rows, if it is not automatic.
pub const SHUTTER_WIDTH: u16 = 0x0B;
/// Analog gain in sixteenths, 16 to 64, if it is not automatic. Bit 15, an attenuation, is clear.
pub const ANALOG_GAIN: u16 = 0x35;
/// The values of the automatic control: gain, as in [`ANALOG_GAIN`]; exposure in rows.
pub const FOUND: [u16; 2] = [0xBA, 0xBB];
/// Columns and rows of the array that are binned to one pixel.
const BINNING: u16 = 2;
/// Size of the array, and the number of its first column and row.
const ARRAY: [u16; 2] = [752, 480];
const FIRST: [u16; 2] = [1, 4];
/// Columns and rows of the array that are read: around its middle, which the lens images.
const WINDOW: [u16; 2] = [WIDTH * BINNING, HEIGHT * BINNING];
/// Shortest horizontal blanking while columns are binned by two, clocks.
const LEAST_BLANKING: u16 = 71;

/// Registers, and their bits, without which no frame can be read: size, blanking, mode, binning and
/// signals.
pub const NEEDED: &[(u16, u16)] = &[
    (0x03, 0xFFFF),
    (0x04, 0xFFFF),
    (0x05, 0xFFFF),
    (0x06, 0xFFFF),
    (0x07, 0x0188),
    (0x0D, 0x003F),
    (0x72, 0x001F),
];

/// Registers for the frame rate and the longest exposure, in addition to [`table`].
pub const fn rows_for(rate: Rate) -> &'static [(u16, u16)] {
    match rate {
        Rate::Full => const { &rows_registers(Rate::Full) },
        Rate::Half => const { &rows_registers(Rate::Half) },
        Rate::Quarter => const { &rows_registers(Rate::Quarter) },
    }
}

const fn rows_registers(rate: Rate) -> [(u16, u16); 3] {
    let longest = longest_exposure(rate);
    // A longer exposure would lengthen the frame.
    assert!(longest + 2 <= HEIGHT + blank_rows(rate));
    [
        // Vertical blanking, rows.
        (0x06, blank_rows(rate)),
        // Longest automatic exposure, and the exposure before the control's first update.
        (0xAD, longest),
        (SHUTTER_WIDTH, longest),
    ]
}

const _: () = assert!(WINDOW[0] + LEAST_BLANKING <= ROW_CLOCKS);

/// The only pixel format of a mono sensor: a byte for each pixel, the upper eight of its ten bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Luma.
    Mono,
}

impl Format {
    /// Returns the format with these pixels; `None` if the camera does not send them.
    pub const fn of(pixels: PixelFormat) -> Option<Format> {
        match pixels {
            PixelFormat::Mono => Some(Format::Mono),
            PixelFormat::Rgb565 | PixelFormat::Yuv422 => None,
        }
    }

    /// The format's pixels.
    pub const fn pixels(self) -> PixelFormat {
        PixelFormat::Mono
    }
}

/// Read mode: rows (bits 1:0 = 1) and columns (bits 3:2 = 1) binned by two, neither flipped. Bits
/// 9:8 are reserved and set.
const READ_MODE: u16 = 0x0305;

/// Register, value: written in this order after a reset, and read back.
pub fn table() -> &'static [(u16, u16)] {
    if seeded_bugs::camera_register() {
        const { &with_read_mode(0x0300) }
    } else {
        const { &with_read_mode(READ_MODE) }
    }
}

const fn with_read_mode(read_mode: u16) -> [(u16, u16); 20] {
    [
        // Reserved registers, with the values that the data sheet recommends (Rev. G, table 8).
        (0x13, 0x2D2E),
        (0x20, 0x03C7),
        (0x24, 0x001B),
        (0x2B, 0x0003),
        (0x2F, 0x0003),
        // Chip control: context A (bit 15 clear), exposure during the readout of the previous frame
        // (bit 8), parallel data (bit 7), endless frames (bit 3). Bit 9, reserved and set after a
        // reset, is cleared as in OpenMV's driver.
        (0x07, 0x0188),
        // Column start, row start, window height and width, in columns and rows of the array.
        (0x01, FIRST[0] + (ARRAY[0] - WINDOW[0]) / 2),
        (0x02, FIRST[1] + (ARRAY[1] - WINDOW[1]) / 2),
        (0x03, WINDOW[1]),
        (0x04, WINDOW[0]),
        // Horizontal blanking, clocks.
        (0x05, ROW_CLOCKS - WINDOW[0]),
        (0x0D, read_mode),
        // Pixel operation mode: one slope, no high dynamic range, no colours.
        (0x0F, 0x0000),
        // ADC: ten bits in proportion to light, in both contexts.
        (0x1C, 0x0202),
        // Row noise correction on, in both contexts, as in OpenMV's table.
        (0x70, 0x0101),
        // Pixel clock: LINE_VALID and FRAME_VALID high with data, PIXCLK falling in the middle of
        // each datum of binned columns. `mt9v034.rs` sets DCMI to match.
        (0x72, 0x0000),
        // Target brightness of the automatic control, in 64ths of white: a bright film that is not
        // saturated, as with the OV7725.
        (0xA5, 35),
        // Largest gain, sixteenths: beyond 4× noise costs more than light gains.
        (0xAB, 64),
        // Number of pixels in the automatic control's histogram: an eighth of the frame's, as in
        // OpenMV's driver.
        (0xB0, WIDTH * HEIGHT / 8),
        (AEC_AGC_ENABLE, AUTOMATIC_EXPOSURE | AUTOMATIC_GAIN),
    ]
}
