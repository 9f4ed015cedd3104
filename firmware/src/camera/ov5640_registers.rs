//! Lists the OV5640's registers that the firmware writes, and why. All other registers keep their
//! value after reset.
//!
//! Sources: names and bits as in the drivers of Linux (`drivers/media/i2c/ov5640.c`), OpenMV
//! (`ov5640.c`), esp32-camera (`ov5640.c`) and GreenWaves (`ov5640.c` of its SDK). *All of them*
//! below means that these agree about a value whose meaning is not public.

use super::omnivision::{Format, RESTS, Values};
use super::registers::few;
use crate::seeded_bugs;
use hivtac_portable::device::camera::ov5640::{
    HEIGHT, LINE_CLOCKS, LINES, LONGEST_EXPOSURE, SUBSAMPLING, WIDTH, WINDOW,
};
use hivtac_terms::camera::{Rate, White};
use hivtac_terms::units::Sixteenths;

/// System control: reset (bit 7), standby (bit 6).
const SYSTEM: u16 = 0x3008;
/// The clock of the registers: the PLL (bit 1) or XCLK.
const REGISTERS_CLOCK: u16 = 0x3103;
/// Resets every register to its power-up value, while XCLK drives them.
pub const RESET: &[(u16, u8)] = &[(REGISTERS_CLOCK, 0x11), (SYSTEM, 0x82)];
/// Standby while registers are written.
pub const BEGIN: &[(u16, u8)] = &[(SYSTEM, 0x42)];
/// The camera runs.
pub const END: &[(u16, u8)] = &[(SYSTEM, 0x02)];

/// Registers and values that select a format: the order of bytes, and the path's end. All other
/// registers are the same for all formats.
pub fn format(format: Format) -> &'static [(u16, u8)] {
    match format {
        // Y0 Cb Y1 Cr, as Linux' YUYV.
        _ if seeded_bugs::camera_register() => &[(BYTE_ORDER, 0x30), (PATH, 0x00)],
        Format::Yuv422 => &[(BYTE_ORDER, 0x30), (PATH, 0x00)],
        // The high byte of each pixel comes first, as in Linux' big-endian RGB565.
        Format::Rgb565 => &[(BYTE_ORDER, 0x61), (PATH, 0x01)],
    }
}
const BYTE_ORDER: u16 = 0x4300;
const PATH: u16 = 0x501F;

/// Registers for the frame rate, in addition to [`TABLE`]: the PLL's divider, bits 7:4. It divides
/// all clocks, so that a frame stays the same number of lines.
pub const fn clock(rate: Rate) -> &'static [(u16, u8)] {
    match rate {
        Rate::Full => &[(PLL_DIVIDER, 0x11)],
        Rate::Half => &[(PLL_DIVIDER, 0x21)],
        Rate::Quarter => &[(PLL_DIVIDER, 0x41)],
    }
}
const PLL_DIVIDER: u16 = 0x3035;

/// Registers for the gains with which white is white: red, green, blue of 12 bits, where 0x400 is a
/// gain of one.
pub fn white(White { red, blue }: White) -> Values {
    const ONE: u8 = 64;
    let gain = |(register, gain): (u16, u8)| {
        let [high, low] = (u16::from(gain) << 4).to_be_bytes();
        [(register, high), (register + 1, low)]
    };
    let gains = [(0x3400, red), (0x3402, ONE), (0x3404, blue)];
    few(gains.into_iter().flat_map(gain))
}

/// Automatic control: a set bit makes its control manual.
pub const CONTROL: u16 = 0x3503;
/// [`CONTROL`]: exposure.
pub const MANUAL_EXPOSURE: u8 = 0x01;
/// [`CONTROL`]: gain.
pub const MANUAL_GAIN: u8 = 0x02;
/// Exposure and gain, of the automatic control or as set.
pub const LIGHT: [u16; 5] = [0x3500, 0x3501, 0x3502, 0x350A, 0x350B];
/// Mean level of the newest frame, as the automatic control sees it.
pub const LEVEL: u16 = 0x56A1;
/// Gain from which the automatic control has no more to give: its ceiling is 4, and it may stop a
/// step before.
pub const MOST_AUTOMATIC_GAIN: Sixteenths = Sixteenths(62);

/// The array's middle column and row (Linux: 2592 × 1944 from column 16 and row 14 on).
const MIDDLE: [u16; 2] = [1_312, 986];
/// Columns and rows read around the window, for the interpolation, as in OpenMV.
const MARGIN: [u16; 2] = [16, 8];
/// First column and row that are read.
const START: [u16; 2] = [
    MIDDLE[0] - (WINDOW[0] + MARGIN[0]) / 2,
    MIDDLE[1] - (WINDOW[1] + MARGIN[1]) / 2,
];
/// Last ones.
const STOP: [u16; 2] = [
    START[0] + WINDOW[0] + MARGIN[0] - 1,
    START[1] + WINDOW[1] + MARGIN[1] - 1,
];
/// The margin's part before the window, of the read array.
const OFFSET: [u16; 2] = [MARGIN[0] / 2 / SUBSAMPLING, MARGIN[1] / 2 / SUBSAMPLING];

const _: () = assert!(START[0].is_multiple_of(2) && START[1].is_multiple_of(2));

/// Registers, and their bits, without which no frame can be read: format, clocks, pins, size.
pub const NEEDED: &[(u16, u16)] = &[
    (BYTE_ORDER, 0xFF),
    (PATH, 0x07),
    (PLL_DIVIDER, 0xFF),
    (0x3017, 0x7F),
    (0x3018, 0xF0),
    (0x3034, 0x0F),
    (0x3036, 0xFF),
    (0x3037, 0x1F),
    (REGISTERS_CLOCK, 0x02),
    (0x3108, 0x33),
    (0x3808, 0x0F),
    (0x3809, 0xFF),
    (0x380A, 0x07),
    (0x380B, 0xFF),
    (0x380C, 0x1F),
    (0x380D, 0xFF),
    (0x380E, 0xFF),
    (0x380F, 0xFF),
    (0x3814, 0xFF),
    (0x3815, 0xFF),
    (0x3824, 0x1F),
    (0x460C, 0x02),
    (0x4740, 0x23),
    (0x5001, 0x20),
];

const fn high(value: u16) -> u8 {
    value.to_be_bytes()[0]
}

const fn low(value: u16) -> u8 {
    value.to_be_bytes()[1]
}

/// Registers and values, written in this order in standby after a reset, and read back.
pub const TABLE: &[(u16, u8)] = &[
    // Clocks: 12.5 MHz / 3 · 192 = 800 MHz; / 2 (root) / 2.5 (ten bits) = 160 MHz. Half of that
    // is the lines' clock, as in OpenMV, which runs at it.
    (0x3034, 0x1A),
    (0x3036, 192),
    (0x3037, 0x13),
    (0x3108, 0x01),
    (REGISTERS_CLOCK, 0x03),
    // PCLK is a quarter of the 160 MHz: a row's 640 bytes leave in 16 µs of a line's 18. Faster
    // would only shorten the time that the DMA has for a word.
    (0x3824, 0x04),
    (0x460C, 0x22),
    // Pins: VSYNC, HREF, PCLK and data become outputs; MIPI is off.
    (0x3017, 0xFF),
    (0x3018, 0xFF),
    (0x300E, 0x58),
    (0x302E, 0x00),
    // VSYNC high during its pulse, HREF high while data is valid, data stable at PCLK's rising
    // edge: as OpenMV reads this value. Bit 0 is the opposite of its name (Linux).
    (0x4740, 0x20),
    // The microcontroller inside stays in reset: only its program would move a focus motor. Blocks
    // of JPEG are in reset and without clock.
    (0x3000, 0x20),
    (0x3002, 0x1C),
    (0x3004, 0xFF),
    (0x3006, 0xC3),
    // No current through a focus motor: the lens rests on its stop, which is far away.
    (0x3602, 0x00),
    (0x3603, 0x00),
    // The window of the array, first and last column and row.
    (0x3800, high(START[0])),
    (0x3801, low(START[0])),
    (0x3802, high(START[1])),
    (0x3803, low(START[1])),
    (0x3804, high(STOP[0])),
    (0x3805, low(STOP[0])),
    (0x3806, high(STOP[1])),
    (0x3807, low(STOP[1])),
    // 320 × 240 out.
    (0x3808, high(WIDTH)),
    (0x3809, low(WIDTH)),
    (0x380A, high(HEIGHT)),
    (0x380B, low(HEIGHT)),
    (0x4602, high(WIDTH)),
    (0x4603, low(WIDTH)),
    (0x4604, high(HEIGHT)),
    (0x4605, low(HEIGHT)),
    // Clocks of a line, lines of a frame.
    (0x380C, high(LINE_CLOCKS)),
    (0x380D, low(LINE_CLOCKS)),
    (0x380E, high(LINES)),
    (0x380F, low(LINES)),
    // The window's start in the read array.
    (0x3810, high(OFFSET[0])),
    (0x3811, low(OFFSET[0])),
    (0x3812, high(OFFSET[1])),
    (0x3813, low(OFFSET[1])),
    // Every fourth column and row, of two binned ones (GreenWaves). All rows would take the time of
    // two frames.
    (0x3814, 0x71),
    (0x3815, 0x35),
    // Binned, not flipped. Mirrored, because a chip that is lit from behind sees a mirror image
    // (Linux).
    (0x3820, 0x41),
    (0x3821, 0x07),
    // Analog part, all of them: for binning, then in general.
    (0x3612, 0x29),
    (0x3618, 0x00),
    (0x3708, 0x64),
    (0x3709, 0x52),
    (0x370C, 0x03),
    (0x3600, 0x08),
    (0x3601, 0x33),
    (0x302D, 0x60),
    (0x3620, 0x52),
    (0x3621, 0xE0),
    (0x3622, 0x01),
    (0x3632, 0xE2),
    (0x3634, 0x40),
    (0x3703, 0x5A),
    (0x3704, 0xA0),
    (0x3705, 0x1A),
    (0x370B, 0x60),
    (0x3715, 0x78),
    (0x3717, 0x01),
    (0x371B, 0x20),
    (0x3731, 0x12),
    (0x3901, 0x0A),
    (0x3905, 0x02),
    (0x3906, 0x10),
    (0x471C, 0x50),
    // The same where they differ: Linux' and GreenWaves' values.
    (0x3630, 0x36),
    (0x3631, 0x0E),
    (0x3633, 0x12),
    (0x3635, 0x13),
    (0x3636, 0x03),
    // Black level: from the second line on, two lines; renewed only with the gain, so that it
    // stays when the picture changes.
    (0x4001, 0x02),
    (0x4004, 0x02),
    (0x4005, 0x18),
    // No banding filter, because the light is DC; no night mode, which would lengthen frames.
    (0x3A00, 0x58),
    (0x350C, 0x00),
    (0x350D, 0x00),
    // Longest automatic exposure, at 60 and at 50 Hz.
    (0x3A02, high(LONGEST_EXPOSURE)),
    (0x3A03, low(LONGEST_EXPOSURE)),
    (0x3A14, high(LONGEST_EXPOSURE)),
    (0x3A15, low(LONGEST_EXPOSURE)),
    // The automatic control begins to move outside RESTS, and stops well within; it is fast below
    // 0x20 and above 0xD0.
    (0x3A1B, *RESTS.end()),
    (0x3A1E, *RESTS.start()),
    (0x3A0F, *RESTS.end() - 8),
    (0x3A10, *RESTS.start() + 8),
    (0x3A11, 0xD0),
    (0x3A1F, 0x20),
    // Gain is at most 4, beyond which noise costs more than light gains.
    (0x3A18, 0x00),
    (0x3A19, 0x40),
    // All parts of the picture have equal weight (OpenMV).
    (0x5688, 0x11),
    (0x5689, 0x11),
    (0x568A, 0x11),
    (0x568B, 0x11),
    (0x568C, 0x11),
    (0x568D, 0x11),
    (0x568E, 0x11),
    (0x568F, 0x11),
    // Defective pixels and interpolation. No gamma: levels stay in proportion to light, by which
    // the sensing weighs a marker's rim. No lens correction, which is made for a different lens.
    (0x5000, 0x07),
    // Scaling, colour matrix, gains of white; no special effects, no test picture.
    (0x5001, 0x23),
    (0x5025, 0x00),
    (0x503D, 0x00),
    // Gains of white as written, none calculated.
    (0x3406, 0x01),
    // Sharpening and smoothing are fixed, at none: they would move rims.
    (0x5302, 0x00),
    (0x5303, 0x00),
    (0x5306, 0x00),
    (0x5307, 0x00),
    (0x5308, 0x50),
    // The colour matrix of Linux, esp32-camera and GreenWaves: three coefficients each of Y, Cb
    // and Cr, and their signs.
    (0x5381, 0x1E),
    (0x5382, 0x5B),
    (0x5383, 0x08),
    (0x5384, 0x0A),
    (0x5385, 0x7E),
    (0x5386, 0x88),
    (0x5387, 0x7C),
    (0x5388, 0x6C),
    (0x5389, 0x10),
    (0x538A, 0x01),
    (0x538B, 0x98),
];
