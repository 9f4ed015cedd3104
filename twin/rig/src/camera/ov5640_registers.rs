//! The OV5640's register file: addresses, values after a reset, and the registers that only the
//! sensor writes.
//!
//! Sources: the drivers of Linux, OpenMV, esp32-camera and GreenWaves, also for the meaning of
//! bits. Values after a reset are known for some registers only; all others count as zero, and a
//! picture must not depend on them ([`RECOMMENDED`]).

/// System control: reset (bit 7), standby (bit 6).
pub const SYSTEM: u16 = 0x3008;
/// Chip number, high byte; read-only.
pub const CHIP_HIGH: u16 = 0x300A;
/// Chip number, low byte; read-only.
pub const CHIP_LOW: u16 = 0x300B;
/// Outputs: VSYNC, HREF, PCLK and the upper four data lines (bits 6:0).
pub const OUTPUTS_HIGH: u16 = 0x3017;
/// Outputs: the next four data lines (bits 7:4).
pub const OUTPUTS_LOW: u16 = 0x3018;
/// Bits 3:0: 8 for a divider of 2, 10 for one of 2.5.
pub const PLL_BITS: u16 = 0x3034;
/// Divider of all clocks (bits 7:4), of MIPI's (3:0).
pub const PLL_DIVIDER: u16 = 0x3035;
/// Multiplier.
pub const PLL_MULTIPLIER: u16 = 0x3036;
/// Divides by two (bit 4); divider before the PLL (bits 3:0).
pub const PLL_PREDIVIDER: u16 = 0x3037;
/// Clock of the registers: the PLL (bit 1).
pub const CLOCK_SOURCE: u16 = 0x3103;
/// Dividers, as powers of two: PCLK (bits 5:4), lines (bits 1:0).
pub const ROOT_DIVIDERS: u16 = 0x3108;
/// Gain of red, 12 bits in two registers, where 0x400 is one.
pub const RED: u16 = 0x3400;
/// Gain of green.
pub const GREEN: u16 = 0x3402;
/// Gain of blue.
pub const BLUE: u16 = 0x3404;
/// Gains are as written (bit 0).
pub const MANUAL_WHITE: u16 = 0x3406;
/// Exposure, 20 bits in three registers, in sixteenths of a line.
pub const EXPOSURE: u16 = 0x3500;
/// Manual control of gain (bit 1) and exposure (bit 0).
pub const MANUAL: u16 = 0x3503;
/// Gain, ten bits in two registers, in sixteenths.
pub const GAIN: u16 = 0x350A;
/// First column, then first row, last column, last row: two registers each.
pub const WINDOW: u16 = 0x3800;
/// Columns, then rows that are sent.
pub const OUTPUT: u16 = 0x3808;
/// Clocks of a line, then lines of a frame.
pub const TOTAL: u16 = 0x380C;
/// Columns and rows that are left out at each edge of the read part.
pub const OFFSET: u16 = 0x3810;
/// Steps from column to column: odd (bits 7:4), even (bits 3:0).
pub const COLUMN_STEPS: u16 = 0x3814;
/// The same from row to row.
pub const ROW_STEPS: u16 = 0x3815;
/// Flip (bits 2:1).
pub const FLIP: u16 = 0x3820;
/// Mirror (bits 2:1).
pub const MIRROR: u16 = 0x3821;
/// Divider of PCLK (bits 4:0), if [`PCLK_CONTROL`] says so.
pub const PCLK_DIVIDER: u16 = 0x3824;
/// Longest automatic exposure, lines.
pub const MAX_EXPOSURE: u16 = 0x3A02;
/// Largest automatic gain, sixteenths.
pub const MAX_GAIN: u16 = 0x3A18;
/// Level above which the automatic control moves.
pub const HIGHEST: u16 = 0x3A1B;
/// Level below which it moves.
pub const LOWEST: u16 = 0x3A1E;
/// Order of bytes.
pub const BYTE_ORDER: u16 = 0x4300;
/// [`PCLK_DIVIDER`] counts (bit 1).
pub const PCLK_CONTROL: u16 = 0x460C;
/// Polarities of PCLK (bit 5), HREF (bit 1) and VSYNC (bit 0).
pub const POLARITY: u16 = 0x4740;
/// Gamma (bit 5).
pub const ISP: u16 = 0x5000;
/// Scaling (bit 5), matrix (bit 1), white (bit 0).
pub const ISP_1: u16 = 0x5001;
/// End of the path: YUV or RGB.
pub const PATH: u16 = 0x501F;
/// Test picture (bit 7).
pub const TEST: u16 = 0x503D;
/// Nine coefficients.
pub const MATRIX: u16 = 0x5381;
/// Mean level of the newest frame.
pub const LEVEL: u16 = 0x56A1;

/// Values after a reset that are known and not zero.
const POWER_UP: [(u16, u8); 36] = [
    (SYSTEM, 0x02),
    (CHIP_HIGH, 0x56),
    (CHIP_LOW, 0x40),
    (PLL_BITS, 0x1A),
    (PLL_DIVIDER, 0x11),
    (PLL_MULTIPLIER, 0x69),
    (PLL_PREDIVIDER, 0x03),
    (ROOT_DIVIDERS, 0x16),
    (RED, 0x04),
    (GREEN, 0x04),
    (BLUE, 0x04),
    (EXPOSURE + 1, 0x02),
    (GAIN + 1, 0x10),
    (WINDOW + 4, 0x0A),
    (WINDOW + 5, 0x3F),
    (WINDOW + 6, 0x07),
    (WINDOW + 7, 0x9F),
    (OUTPUT, 0x0A),
    (OUTPUT + 1, 0x20),
    (OUTPUT + 2, 0x07),
    (OUTPUT + 3, 0x98),
    (TOTAL, 0x0B),
    (TOTAL + 1, 0x1C),
    (TOTAL + 2, 0x07),
    (TOTAL + 3, 0xB0),
    (OFFSET + 1, 0x10),
    (OFFSET + 3, 0x04),
    (COLUMN_STEPS, 0x11),
    (ROW_STEPS, 0x11),
    (FLIP, 0x40),
    (PCLK_DIVIDER, 0x01),
    (HIGHEST, 0x78),
    (LOWEST, 0x68),
    (PCLK_CONTROL, 0x20),
    (POLARITY, 0x20),
    (ISP, 0xFF),
];

/// Registers without a public meaning, on whose values all drivers agree for binned pictures.
pub const RECOMMENDED: [(u16, u8); 26] = [
    (0x302D, 0x60),
    (0x3600, 0x08),
    (0x3601, 0x33),
    (0x3612, 0x29),
    (0x3618, 0x00),
    (0x3620, 0x52),
    (0x3621, 0xE0),
    (0x3622, 0x01),
    (0x3632, 0xE2),
    (0x3634, 0x40),
    (0x3703, 0x5A),
    (0x3704, 0xA0),
    (0x3705, 0x1A),
    (0x3708, 0x64),
    (0x3709, 0x52),
    (0x370B, 0x60),
    (0x370C, 0x03),
    (0x3715, 0x78),
    (0x3717, 0x01),
    (0x371B, 0x20),
    (0x3731, 0x12),
    (0x3901, 0x0A),
    (0x3905, 0x02),
    (0x3906, 0x10),
    (0x4001, 0x02),
    (0x4004, 0x02),
];

/// Registers that a write does not change.
const READ_ONLY: [u16; 3] = [CHIP_HIGH, CHIP_LOW, LEVEL];

/// The registers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registers {
    values: Vec<u8>,
    written: Vec<bool>,
}

impl Default for Registers {
    fn default() -> Self {
        let mut values = vec![0; 1 << 16];
        for (address, value) in POWER_UP {
            values[usize::from(address)] = value;
        }
        let written = vec![false; values.len()];
        Self { values, written }
    }
}

impl Registers {
    /// Returns registers with the values of another program, different for each seed.
    pub fn used(seed: u64) -> Self {
        let mut registers = Self::default();
        for address in (0x3000..0x5900).filter(|address| !READ_ONLY.contains(address)) {
            let mixed = (seed ^ u64::from(address)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            registers.values[usize::from(address)] = (mixed >> 56) as u8;
        }
        registers
    }

    /// Returns the value of a register.
    pub fn get(&self, address: u16) -> u8 {
        self.values[usize::from(address)]
    }

    /// Returns the value of two registers, the high one first.
    pub fn wide(&self, address: u16) -> u32 {
        u32::from(u16::from_be_bytes([
            self.get(address),
            self.get(address + 1),
        ]))
    }

    /// Writes a register. Returns whether the write was a reset of all registers.
    pub fn write(&mut self, address: u16, value: u8) -> bool {
        if address == SYSTEM && value & 0x80 != 0 {
            *self = Self::default();
            return true;
        }
        if !READ_ONLY.contains(&address) {
            self.measured(address, value);
            self.written[usize::from(address)] = true;
        }
        false
    }

    /// Sets a register that the sensor itself writes.
    pub fn measured(&mut self, address: u16, value: u8) {
        self.values[usize::from(address)] = value;
    }

    /// Returns a register of [`RECOMMENDED`] that was not written so since the reset.
    pub fn missing(&self) -> Option<(u16, u8)> {
        let mut all = RECOMMENDED.into_iter();
        all.find(|&(address, value)| {
            !self.written[usize::from(address)] || self.get(address) != value
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_brings_the_power_up_values_back_and_the_number_stays() {
        let mut registers = Registers::used(7);
        assert_ne!(registers, Registers::default());
        registers.write(CHIP_HIGH, 0);
        assert_eq!(registers.wide(CHIP_HIGH), 0x5640);
        assert!(registers.write(SYSTEM, 0x82));
        assert_eq!(registers, Registers::default());
    }

    #[test]
    fn what_the_drivers_agree_about_must_be_written() {
        let mut registers = Registers::default();
        for (address, value) in RECOMMENDED {
            assert!(registers.missing().is_some());
            registers.write(address, value);
        }
        assert_eq!(registers.missing(), None);
    }
}
