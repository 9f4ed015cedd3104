//! The MT9V034's register file: addresses, values after a reset, and the registers that only the
//! sensor writes.

/// Chip version; read-only.
pub const CHIP_VERSION: u8 = 0x00;
/// First column of the window, from 1.
pub const COLUMN_START: u8 = 0x01;
/// First row of the window, from 4.
pub const ROW_START: u8 = 0x02;
/// Rows of the window.
pub const WINDOW_HEIGHT: u8 = 0x03;
/// Columns of the window.
pub const WINDOW_WIDTH: u8 = 0x04;
/// Clocks of a row without data.
pub const HORIZONTAL_BLANKING: u8 = 0x05;
/// Rows of a frame without data.
pub const VERTICAL_BLANKING: u8 = 0x06;
/// Operating mode.
pub const CHIP_CONTROL: u8 = 0x07;
/// Exposure in rows.
pub const SHUTTER_WIDTH: u8 = 0x0B;
/// Conversion of levels to numbers.
pub const ADC: u8 = 0x1C;
/// Bit 0: every register goes back to its power-up value.
pub const RESET: u8 = 0x0C;
/// Binning of rows (bits 1:0) and columns (3:2), flips (5:4).
pub const READ_MODE: u8 = 0x0D;
/// Gain, sixteenths.
pub const ANALOG_GAIN: u8 = 0x35;
/// Polarities.
pub const PIXEL_CLOCK: u8 = 0x72;
/// Target brightness of the automatic control, in 64ths of white.
pub const DESIRED_BIN: u8 = 0xA5;
/// Largest automatic gain, sixteenths.
pub const MAX_GAIN: u8 = 0xAB;
/// Longest automatic exposure, rows.
pub const MAX_EXPOSURE: u8 = 0xAD;
/// Automatic functions: exposure (bit 0), gain (1).
pub const AEC_AGC_ENABLE: u8 = 0xAF;
/// Present gain, sixteenths; read-only.
pub const AGC_GAIN: u8 = 0xBA;
/// Present exposure, rows; read-only.
pub const AEC_EXPOSURE: u8 = 0xBB;

/// [`CHIP_CONTROL`]: frames without end.
pub const MASTER: u16 = 1 << 3;
/// [`CHIP_CONTROL`]: parallel data.
pub const PARALLEL_OUTPUT: u16 = 1 << 7;
/// [`PIXEL_CLOCK`]: LINE_VALID is low with data.
pub const INVERT_LINE: u16 = 1;
/// [`PIXEL_CLOCK`]: FRAME_VALID is low with rows.
pub const INVERT_FRAME: u16 = 1 << 1;
/// [`PIXEL_CLOCK`]: data are stable at the other edge.
pub const INVERT_CLOCK: u16 = 1 << 4;

/// Power-up values that are not zero.
const POWER_UP: [(u8, u16); 22] = [
    (CHIP_VERSION, 0x1324),
    (COLUMN_START, 1),
    (ROW_START, 4),
    (WINDOW_HEIGHT, 480),
    (WINDOW_WIDTH, 752),
    (HORIZONTAL_BLANKING, 94),
    (VERTICAL_BLANKING, 45),
    (CHIP_CONTROL, 0x0388),
    (0x08, 443),
    (0x09, 473),
    (0x0A, 0x0164),
    (SHUTTER_WIDTH, 480),
    (READ_MODE, 0x0300),
    (0x0F, 0x0100),
    (ADC, 0x0302),
    (ANALOG_GAIN, 16),
    (DESIRED_BIN, 58),
    (MAX_GAIN, 64),
    (MAX_EXPOSURE, 480),
    (AEC_AGC_ENABLE, 0x0003),
    (AGC_GAIN, 16),
    (AEC_EXPOSURE, 480),
];

/// The registers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registers(Vec<u16>);

impl Default for Registers {
    fn default() -> Self {
        let mut all = vec![0; 256];
        for (address, value) in POWER_UP {
            all[usize::from(address)] = value;
        }
        Self(all)
    }
}

impl Registers {
    /// Returns registers with the values of another program.
    pub fn used() -> Self {
        let mut registers = Self::default();
        for (address, value) in [
            (CHIP_CONTROL, 0x0108),
            (READ_MODE, 0x033A),
            (PIXEL_CLOCK, 0x0013),
            (AEC_AGC_ENABLE, 0),
            (ANALOG_GAIN, 0x8010),
            (SHUTTER_WIDTH, 2),
        ] {
            registers.write(address, value);
        }
        registers
    }

    /// Returns the value of a register.
    pub fn get(&self, address: u8) -> u16 {
        self.0[usize::from(address)]
    }

    /// Writes a register. Returns whether the write was a reset of all registers.
    pub fn write(&mut self, address: u8, value: u16) -> bool {
        match address {
            CHIP_VERSION | AGC_GAIN | AEC_EXPOSURE => {}
            RESET if value & 1 != 0 => {
                *self = Self::default();
                return true;
            }
            // The reset bit clears itself.
            RESET => {}
            address => self.0[usize::from(address)] = value,
        }
        false
    }

    /// Sets a register that the sensor itself writes.
    pub fn measured(&mut self, address: u8, value: u16) {
        self.0[usize::from(address)] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_brings_the_power_up_values_back_and_the_version_stays() {
        let mut registers = Registers::used();
        assert_ne!(registers, Registers::default());
        assert!(!registers.write(CHIP_VERSION, 0));
        assert_eq!(registers.get(CHIP_VERSION), 0x1324);
        assert!(!registers.write(RESET, 0));
        assert!(registers.write(RESET, 1));
        assert_eq!(registers, Registers::default());
    }
}
