//! Lists the OV7725's registers that the firmware writes, and why. All other registers keep their
//! value after reset.
//!
//! Numbers and names: OV7725 data sheet 1.31, table 17. Application note: OV7725 1.04.

use super::omnivision::{Format, RESTS, Values};
use super::registers::few;
use crate::seeded_bugs;
use hivtac_terms::camera::{Rate, White};
use hivtac_terms::units::Sixteenths;

/// Output format, size and register reset.
pub const COM7: u16 = 0x12;
/// [`COM7`]: resets every register to its power-up value.
pub const COM7_RESET: u8 = 0x80;

/// [`COM7`]: QVGA (bit 6), RGB565 (bits 3:2 = 01) out of the RGB path (bits 1:0 = 10).
const COM7_QVGA_RGB565: u8 = 0x46;
/// [`COM7`]: QVGA, YUV.
const COM7_QVGA_YUV: u8 = 0x40;
/// Byte order; mirror, flip and colour bars, which stay off.
const COM3: u16 = 0x0C;
/// [`COM3`]: luma before chroma in YUV, as after a reset. Without this bit chroma comes first.
const COM3_LUMA_FIRST: u8 = 0x10;

/// Registers and values that select a format. All other registers are the same for all formats.
pub fn format(format: Format) -> &'static [(u16, u8)] {
    match format {
        _ if seeded_bugs::camera_register() => &[(COM7, COM7_QVGA_YUV), (COM3, 0)],
        // The high byte of each pixel comes first. The pipeline's threshold table swaps the bytes
        // back.
        Format::Rgb565 => &[(COM7, COM7_QVGA_RGB565), (COM3, 0)],
        // Cb before Cr, as DSP_CTRL3 (0x66) is set.
        Format::Yuv422 => &[(COM7, COM7_QVGA_YUV), (COM3, COM3_LUMA_FIRST)],
    }
}

/// Automatic control: [`LOCKED`] plus the bits of the automatic values.
pub const COM8: u16 = 0x13;
/// [`COM8`]: no automatic control, so exposure and gain stay. With automatic bits added, it is fast
/// and resolves parts of a line. White balance is off: it would shift the threshold's hue with the
/// scene. The banding filter is off: the light is DC.
pub const LOCKED: u8 = 0x88;
/// [`COM8`]: exposure.
pub const AUTOMATIC_EXPOSURE: u8 = 0x01;
/// [`COM8`]: gain.
pub const AUTOMATIC_GAIN: u8 = 0x04;
/// Gain, and exposure in lines, low and high byte: the values of the automatic control.
pub const EXPOSURE: [u16; 3] = [0x00, 0x10, 0x08];

/// Registers for the gains with which white is white: blue, red.
pub fn white(White { red, blue }: White) -> Values {
    few([(0x01, blue), (0x02, red)])
}

/// Mean level of the newest frame, as the automatic control sees it.
pub const LEVEL: u16 = 0x2F;
/// The largest automatic gain, register value 0x1F.
pub const MOST_AUTOMATIC_GAIN: Sixteenths = Sixteenths(62);

/// Registers for the frame rate, in addition to [`TABLE`].
pub const fn clock(rate: Rate) -> &'static [(u16, u8)] {
    match rate {
        // No prescaler: PCLK = XCLK · 4 = 50 MHz.
        Rate::Full => &[(CLKRC, 0xC0)],
        // Prescaler 2 · (0 + 1).
        Rate::Half => &[(CLKRC, 0x80)],
        // Prescaler 2 · (1 + 1).
        Rate::Quarter => &[(CLKRC, 0x81)],
    }
}
const CLKRC: u16 = 0x11;

/// Registers, and their bits, without which no frame can be read: format, byte order, clocks,
/// signals and size.
pub const NEEDED: &[(u16, u16)] = &[
    (COM7, 0xFF),
    (COM3, 0xFF),
    (0x0D, 0xC0),
    (CLKRC, 0x7F),
    (0x15, 0xFF),
    (0x18, 0xFF),
    (0x1A, 0xFF),
    (0x29, 0xFF),
    (0x2C, 0xFF),
];

/// Registers and values, written in this order after a reset and a [`Format`]'s registers, and read
/// back. It has every register that affects the picture and whose value after a reset differs
/// between OmniVision's data sheets and the drivers of Linux and OpenMV.
pub const TABLE: &[(u16, u8)] = &[
    // COM4: PLL × 4; exposure is judged on the whole frame.
    (0x0D, 0x41),
    // COM5: no automatic frame rate, because dim light must not change the time between frames.
    (0x0E, 0x01),
    // COM6: as in OpenMV's table; its meaning is not public.
    (0x0F, 0xC5),
    // COM10: HREF high while data is valid, PCLK runs freely and data changes on its falling edge,
    // VSYNC high during its pulse. `ov7725.rs` sets DCMI to match.
    (0x15, 0x00),
    // HSTART, HSIZE, VSTRT, VSIZE, HREF, EXHCH: the sensor's window for QVGA, whole array (320 ×
    // 240 of binned pixels; sizes in units of 4 columns and 2 rows, low bits zero).
    (0x17, 0x3F),
    (0x18, 0x50),
    (0x19, 0x03),
    (0x1A, 0x78),
    (0x32, 0x00),
    (0x2A, 0x00),
    // HOUTSIZE, VOUTSIZE: 320 × 240 out, no scaling.
    (0x29, 0x50),
    (0x2C, 0x78),
    // COM8, COM9: automatic exposure and gain until the film is well exposed. Gain is at most 4×,
    // beyond which noise costs more than light gains. COM9's bits 2 and 1 are clear: the VSYNC or
    // HREF of a frame is never dropped during an exposure change, so every VSYNC edge has a whole
    // frame.
    (COM8, LOCKED | AUTOMATIC_EXPOSURE | AUTOMATIC_GAIN),
    (0x14, 0x18),
    // AEW, AEB, VPT: the control rests within RESTS; between 0x10 and 0xA0 it moves in small steps.
    (0x24, *RESTS.end()),
    (0x25, *RESTS.start()),
    (0x26, 0xA1),
    // COM12: direct offset of the analog part, as in the tables of OpenMV and gspca.
    (0x3D, 0x03),
    // COM16, and the black levels of blue, red and both greens: equal, so that black is neutral.
    (0x41, 0x08),
    (0x42, 0x80),
    (0x43, 0x80),
    (0x44, 0x80),
    (0x45, 0x80),
    // LC_CTR: no lens correction, because it is made for a different lens.
    (0x46, 0x00),
    // AWB_CTRL0, AWB_CTRL1: fixed gains are applied, none are calculated; 0x40 is a gain of one.
    (0x63, 0xA0),
    (0x69, 0x5E),
    // FIXGAIN: red one step above green, blue two, as in the tables of OpenMV and esp32-camera, to
    // which the maker's presets of white belong. GREEN: a gain of one.
    (0x4D, 0x09),
    (0x03, 0x40),
    // DSP_CTRL1: FIFO, colour matrix, interpolation, and correction of defective pixels. No gamma:
    // levels stay in proportion to light, by which the sensing weighs a marker's rim. No special
    // effects, no adjustment of colours to gain.
    (0x64, 0x9B),
    // DSP_CTRL2, DSP_CTRL3: for QVGA, as in the tables of OpenMV and gspca; Cb before Cr, no test
    // picture.
    (0x65, 0x2F),
    (0x66, 0x00),
    // DSP_CTRL4: YUV or RGB, no raw data.
    (0x67, 0x00),
    // DNSTH, EDGE0: no smoothing and no sharpening, which would move rims. DSPAUTO: no automatic
    // smoothing or sharpening, only scaling.
    (0x8E, 0x00),
    (0x8F, 0x00),
    (0xAC, 0x0F),
    // MTX1 to MTX6, MTX_CTRL: the application note's colour matrix. Half of it, the value after a
    // reset in some data sheets, makes red dots half as red.
    (0x94, 0xB0),
    (0x95, 0x9D),
    (0x96, 0x13),
    (0x97, 0x16),
    (0x98, 0x7B),
    (0x99, 0x91),
    (0x9A, 0x1E),
];
