//! The OV7725's register file: addresses, power-up values, and which registers only the sensor writes.
//!
//! Source: OmniVision OV7725 datasheet 1.31, "Register set". Registers that change brightness, colour or gain are
//! stored and read back, but do not change the picture: the scene decides it.

/// Product id, high byte; read-only.
pub const PID: u8 = 0x0A;
/// Product id, low byte; read-only.
pub const VER: u8 = 0x0B;
/// Output drive and soft sleep (bit 4).
pub const COM2: u8 = 0x09;
/// Flip, mirror, byte orders, colour bars.
pub const COM3: u8 = 0x0C;
/// Multiplier of the clock loop, bits 7:6.
pub const COM4: u8 = 0x0D;
/// Clock divider: bit 6 bypasses it, bits 5:0 divide by 2·(n + 1).
pub const CLKRC: u8 = 0x11;
/// Register reset (7), QVGA (6), RGB layout (3:2), output format (1:0).
pub const COM7: u8 = 0x12;
/// Polarities of PCLK, HREF and VSYNC.
pub const COM10: u8 = 0x15;
/// First column of the window, bits 9:2.
pub const HSTART: u8 = 0x17;
/// Columns of the window, bits 9:2.
pub const HSIZE: u8 = 0x18;
/// First row of the window, bits 8:1.
pub const VSTRT: u8 = 0x19;
/// Rows of the window, bits 8:1.
pub const VSIZE: u8 = 0x1A;
/// Columns of the output, bits 9:2.
pub const HOUTSIZE: u8 = 0x29;
/// Dummy pixels 11:8 (bits 7:4), low bits of the output size.
pub const EXHCH: u8 = 0x2A;
/// Dummy pixels 7:0.
pub const EXHCL: u8 = 0x2B;
/// Rows of the output, bits 8:1.
pub const VOUTSIZE: u8 = 0x2C;
/// Dummy lines, low byte.
pub const ADVFL: u8 = 0x2D;
/// Dummy lines, high byte.
pub const ADVFH: u8 = 0x2E;
/// Low bits of the window's start and size.
pub const HREF: u8 = 0x32;
/// Bit 7: Cr before Cb.
pub const DSP_CTRL3: u8 = 0x66;

/// COM7 bit 7: every register goes back to its power-up value.
pub const COM7_RESET: u8 = 0x80;

/// Power-up values that are not zero.
const POWER_UP: [(u8, u8); 43] = [
    (0x01, 0x80),
    (0x02, 0x80),
    (COM2, 0x01),
    (PID, 0x77),
    (VER, 0x21),
    (COM3, 0x10),
    (COM4, 0x41),
    (0x0E, 0x01),
    (0x0F, 0x43),
    (0x10, 0x40),
    (CLKRC, 0x80),
    (0x13, 0x8F),
    (0x14, 0x4A),
    (HSTART, 0x23),
    (HSIZE, 0xA0),
    (VSTRT, 0x07),
    (VSIZE, 0xF0),
    (0x1B, 0x40),
    (0x1C, 0x7F),
    (0x1D, 0xA2),
    (0x20, 0x10),
    (0x22, 0xFF),
    (0x23, 0x01),
    (0x24, 0x75),
    (0x25, 0x63),
    (0x26, 0xD4),
    (HOUTSIZE, 0xA0),
    (VOUTSIZE, 0xF0),
    (0x30, 0x80),
    (0x31, 0x60),
    (0x35, 0x80),
    (0x36, 0x80),
    (0x37, 0x80),
    (0x38, 0x80),
    (0x3D, 0x80),
    (0x3E, 0xE2),
    (0x41, 0x20),
    (0x42, 0x80),
    (0x63, 0xE0),
    (0x64, 0xFF),
    (DSP_CTRL3, 0x10),
    (0x9C, 0x20),
    (0xAC, 0xFF),
];

/// Registers that a write does not change: ids and measured averages.
const READ_ONLY: [u8; 8] = [0x05, 0x06, 0x07, PID, VER, 0x1C, 0x1D, 0x2F];

/// The register file as the sensor's outputs follow it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registers([u8; 256]);

impl Default for Registers {
    fn default() -> Self {
        let mut values = [0; 256];
        for (address, value) in POWER_UP {
            values[usize::from(address)] = value;
        }
        Self(values)
    }
}

impl Registers {
    /// The value of a register.
    pub fn get(&self, address: u8) -> u8 {
        self.0[usize::from(address)]
    }

    /// Writes a register. Answers whether it was the register reset, after which every register holds its power-up
    /// value.
    pub fn write(&mut self, address: u8, value: u8) -> bool {
        if address == COM7 && value & COM7_RESET != 0 {
            *self = Self::default();
            return true;
        }
        if !READ_ONLY.contains(&address) {
            self.0[usize::from(address)] = value;
        }
        false
    }

    /// A value of `HIGH:low bits`: the register at `high` shifted up, joined with bits of another.
    pub(super) fn wide(&self, high: u8, shift: u32, low: u32) -> u32 {
        u32::from(self.get(high)) << shift | low
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_up_values_come_back_with_the_register_reset() {
        let mut registers = Registers::default();
        assert!(!registers.write(COM7, 0x46));
        assert!(!registers.write(HSIZE, 0x50));
        assert_eq!((registers.get(COM7), registers.get(HSIZE)), (0x46, 0x50));
        assert!(registers.write(COM7, 0x80 | 0x46));
        assert_eq!(registers, Registers::default());
        assert_eq!((registers.get(COM7), registers.get(HSIZE)), (0, 0xA0));
    }

    #[test]
    fn the_ids_cannot_be_written() {
        let mut registers = Registers::default();
        registers.write(PID, 0);
        registers.write(VER, 0);
        assert_eq!((registers.get(PID), registers.get(VER)), (0x77, 0x21));
    }
}
