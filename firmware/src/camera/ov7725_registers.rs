//! The OV7725's registers that the firmware writes, and why. Everything else keeps its value after reset.
//!
//! Numbers and names: OV7725 data sheet 1.31, table 17.

use crate::seeded_bugs;
use hivtac_sensing::threshold::PixelFormat;

/// Product number, high and low byte.
pub const PID: (u8, u8) = (0x0A, 0x77);
/// Version.
pub const VER: (u8, u8) = (0x0B, 0x21);

/// Output format, size and register reset.
pub const COM7: u8 = 0x12;
/// [`COM7`]: every register back to its power-up value.
pub const COM7_RESET: u8 = 0x80;

/// [`COM7`]: QVGA (bit 6), RGB565 (bits 3:2 = 01) out of the RGB path (bits 1:0 = 10).
const COM7_QVGA_RGB565: u8 = 0x46;
/// [`COM7`]: QVGA, YUV.
const COM7_QVGA_YUV: u8 = 0x40;
/// Order of bytes; mirror, flip and colour bars, which stay off.
const COM3: u8 = 0x0C;
/// [`COM3`]: luma before chroma in YUV, as after a reset. Without it chroma comes first.
const COM3_LUMA_FIRST: u8 = 0x10;

/// The pixel formats that the sensing knows and this camera sends. Mono is not among them: its luma alone would have to be
/// picked out of YUV422, and red markers are hardly darker than the film in white light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// RGB565.
    Rgb565,
    /// YUV422, in the order Y0 Cb Y1 Cr.
    Yuv422,
}

impl Format {
    /// The one of such pixels, if the camera sends it.
    pub const fn of(pixels: PixelFormat) -> Option<Format> {
        match pixels {
            PixelFormat::Rgb565 => Some(Format::Rgb565),
            PixelFormat::Yuv422 => Some(Format::Yuv422),
            PixelFormat::Mono => None,
        }
    }

    /// Register, value: what makes the camera send it. Everything else is the same for all formats.
    pub const fn registers(self) -> &'static [(u8, u8)] {
        match self {
            _ if seeded_bugs::YUV_FORMAT => &[(COM7, COM7_QVGA_YUV), (COM3, 0)],
            // High byte of each pixel first. The pipeline unswaps the bytes in its threshold table.
            Format::Rgb565 => &[(COM7, COM7_QVGA_RGB565), (COM3, 0)],
            // Cb before Cr, as DSP_CTRL3 (0x66) has it after a reset.
            Format::Yuv422 => &[(COM7, COM7_QVGA_YUV), (COM3, COM3_LUMA_FIRST)],
        }
    }
}

/// Register, value: written in this order after a reset and a [`Format`]'s.
pub const TABLE: &[(u8, u8)] = &[
    // CLKRC: pixel clock = PLL output / (2·(1 + 1)). With COM4: 12.5 MHz XCLK → 12.5 MHz PCLK, 39 frames/s, which
    // leaves up to 25 ms of exposure and two thirds of the processing time free.
    (0x11, 0x01),
    // COM4: PLL × 4; exposure is judged on the whole frame.
    (0x0D, 0x41),
    // COM5: no automatic frame rate. Dim light must not change the time between frames.
    (0x0E, 0x01),
    // COM10: HREF high while data is valid, PCLK runs freely and data changes on its falling edge, VSYNC high
    // during its pulse. `ov7725.rs` tells DCMI the same.
    (0x15, 0x00),
    // HSTART, HSIZE, VSTRT, VSIZE, HREF, EXHCH: the sensor's window for QVGA, whole array (320 × 240 of binned
    // pixels; sizes in units of 4 columns and 2 rows, low bits zero).
    (0x17, 0x3F),
    (0x18, 0x50),
    (0x19, 0x03),
    (0x1A, 0x78),
    (0x32, 0x00),
    (0x2A, 0x00),
    // HOUTSIZE, VOUTSIZE: 320 × 240 out, no scaling.
    (0x29, 0x50),
    (0x2C, 0x78),
    // COM8: automatic exposure and gain on, so that the markers stay above the threshold's lowest value while the
    // light ages or differs from unit to unit. Automatic white balance off: it would turn the hue that the threshold
    // asks for with whatever is in view. Banding filter off: the light is DC.
    (0x13, 0x8D),
    // COM9: gain at most 4×: beyond it noise costs more than light gains. Bits 2 and 1 clear: never drop the VSYNC
    // or HREF of a frame during an exposure change, so that every VSYNC edge has a whole frame.
    (0x14, 0x18),
    // BLUE, RED: unity, as automatic white balance is off.
    (0x01, 0x80),
    (0x02, 0x80),
];
