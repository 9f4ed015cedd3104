//! The OV7725's register file: addresses, values after a reset, and the registers that only the
//! sensor writes.
//!
//! Source: OmniVision OV7725 datasheet 1.31, "Register set", with datasheet 1.1 and the drivers of
//! Linux and OpenMV. If these disagree about the value after a reset, the value counts as unknown.
//! [`Registers::of_seed`] has a different value for each seed, and [`Registers::unwritten`] names
//! such a register that the picture depends on.

/// Gain.
pub const GAIN: u8 = 0x00;
/// Gain of blue.
pub const BLUE: u8 = 0x01;
/// Gain of red.
pub const RED: u8 = 0x02;
/// Gain of green.
pub const GREEN: u8 = 0x03;
/// Exposure in lines, high byte.
pub const AECH: u8 = 0x08;
/// Exposure in lines, low byte.
pub const AEC: u8 = 0x10;
/// Automatic functions: exposure (bit 0), white balance (1), gain (2).
pub const COM8: u8 = 0x13;
/// Largest automatic gain, bits 6:4.
pub const COM9: u8 = 0x14;
/// Highest level at which the automatic control rests.
pub const AEW: u8 = 0x24;
/// Lowest level at which the automatic control rests.
pub const AEB: u8 = 0x25;
/// Levels outside of which the automatic control moves fast: sixteenths, the upper one in bits 7:4.
pub const VPT: u8 = 0x26;
/// Mean level of the newest frame; read-only.
pub const YAVE: u8 = 0x2F;
/// Fixed gains of blue (bits 3:2) and red (1:0).
pub const FIXGAIN: u8 = 0x4D;
/// Lens correction.
pub const LC_CTR: u8 = 0x46;
/// White balance: gains applied (bit 7), calculated (6).
pub const AWB_CTRL0: u8 = 0x63;
/// FIFO, special effects, colour matrix, gamma.
pub const DSP_CTRL1: u8 = 0x64;
/// DSP_CTRL1 bit 4: the colour matrix is applied.
pub const COLOUR_MATRIX: u8 = 0x10;
/// White balance: the unit of a gain.
pub const AWB_CTRL1: u8 = 0x69;
/// Colour matrix, six coefficients.
pub const MTX1: u8 = 0x94;
/// Signs of the colour matrix's coefficients, and whether they count twice.
pub const MTX_CTRL: u8 = 0x9A;
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
const POWER_UP: [(u8, u8); 56] = [
    (BLUE, 0x80),
    (RED, 0x80),
    (COM2, 0x01),
    (PID, 0x77),
    (VER, 0x21),
    (COM3, 0x10),
    (COM4, 0x41),
    (0x0E, 0x01),
    (0x0F, 0x43),
    (AEC, 0x40),
    (CLKRC, 0x80),
    (COM8, 0x8F),
    (COM9, 0x4A),
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
    (0x43, 0x80),
    (0x44, 0x80),
    (0x45, 0x80),
    (AWB_CTRL0, 0xE0),
    (DSP_CTRL1, 0xFF),
    (DSP_CTRL3, 0x10),
    (AWB_CTRL1, 0x5C),
    (MTX1, 0x2C),
    (0x95, 0x24),
    (0x96, 0x08),
    (0x97, 0x14),
    (0x98, 0x24),
    (0x99, 0x38),
    (MTX_CTRL, 0x9E),
    (0x9C, 0x20),
    (0xA7, 0x40),
    (0xA8, 0x40),
    (0xAC, 0xFF),
];

/// Registers whose value after a reset differs between sources or is missing: first and last of
/// each range.
const DISPUTED: [(u8, u8); 10] = [
    (0x0F, 0x0F),
    (0x24, 0x26),
    (0x3D, 0x3D),
    (0x41, 0x45),
    (LC_CTR, LC_CTR),
    (AWB_CTRL0, DSP_CTRL3),
    (AWB_CTRL1, AWB_CTRL1),
    (0x8E, 0x8F),
    (MTX1, MTX_CTRL),
    (0xAC, 0xAC),
];
/// Reserved bits. Their values after a reset differ between revisions of the part, and some
/// revisions keep them.
const RESERVED: [(u8, u8); 8] = [
    (0x0E, 0x06),
    (0x0F, 0x3A),
    (COM9, 0x09),
    (0x41, 0xFC),
    (AWB_CTRL0, 0x20),
    (0x65, 0xF0),
    (AWB_CTRL1, 0xF0),
    (MTX_CTRL, 0x40),
];

/// Registers that a write does not change: ids and measured averages.
const READ_ONLY: [u8; 8] = [0x05, 0x06, 0x07, PID, VER, 0x1C, 0x1D, YAVE];

/// The register file that decides the sensor's output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Registers {
    values: [u8; 256],
    after_reset: [u8; 256],
    written: [bool; 256],
    /// Bits that a write does not change.
    fixed: [u8; 256],
}

impl Default for Registers {
    /// Returns the values of datasheet 1.31.
    fn default() -> Self {
        let mut values = [0; 256];
        for (address, value) in POWER_UP {
            values[usize::from(address)] = value;
        }
        Self {
            values,
            after_reset: values,
            written: [false; 256],
            fixed: [0; 256],
        }
    }
}

impl Registers {
    /// Returns the values after a reset. Those on which sources disagree depend on the seed, and so
    /// do the reserved bits that a write does not change. The part of seed 1 takes all bits.
    pub fn of_seed(seed: u64) -> Self {
        let mut registers = Self::default();
        for address in DISPUTED.into_iter().flat_map(|(first, last)| first..=last) {
            registers.after_reset[usize::from(address)] = random(seed, address);
        }
        registers.values = registers.after_reset;
        for (address, bits) in RESERVED.into_iter().filter(|_| seed != 1) {
            registers.fixed[usize::from(address)] = bits & random(!seed, address);
        }
        registers
    }

    /// Returns the registers as another program may have left them: any value in any register,
    /// different for each seed.
    pub fn used(seed: u64) -> Self {
        let mut registers = Self::of_seed(seed);
        for address in (0..=0xAC).filter(|address| !READ_ONLY.contains(address)) {
            registers.values[usize::from(address)] = random(!seed, address);
        }
        registers
    }

    /// Returns the value of a register.
    pub fn get(&self, address: u8) -> u8 {
        self.values[usize::from(address)]
    }

    /// Writes a register. Returns whether the write was the register reset, which sets every
    /// register to its value after a reset.
    pub fn write(&mut self, address: u8, value: u8) -> bool {
        if address == COM7 && value & COM7_RESET != 0 {
            (self.values, self.written) = (self.after_reset, [false; 256]);
            return true;
        }
        if !READ_ONLY.contains(&address) {
            let address = usize::from(address);
            let fixed = self.fixed[address];
            self.values[address] = value & !fixed | self.after_reset[address] & fixed;
            self.written[address] = true;
        }
        false
    }

    /// Sets a register that the sensor itself writes.
    pub(super) fn measured(&mut self, address: u8, value: u8) {
        self.values[usize::from(address)] = value;
    }

    /// Returns a register that the picture depends on, was not written since the reset, and has no
    /// agreed value after one. Returns `None` if there is no such register.
    pub fn unwritten(&self) -> Option<u8> {
        let mut disputed = DISPUTED.into_iter().flat_map(|(first, last)| first..=last);
        disputed.find(|&address| !self.written[usize::from(address)] && self.matters(address))
    }

    fn matters(&self, address: u8) -> bool {
        let is_of_matrix = (MTX1..=MTX_CTRL).contains(&address);
        !is_of_matrix || self.get(DSP_CTRL1) & COLOUR_MATRIX != 0
    }

    /// Returns a value of `HIGH:low bits`: the register at `high` shifted up, joined with bits of
    /// another.
    pub(super) fn wide(&self, high: u8, shift: u32, low: u32) -> u32 {
        u32::from(self.get(high)) << shift | low
    }
}

/// Returns the sensor's response to white light in red, green and blue, with the fixed gains of the
/// maker's presets ([`FIXGAIN`] 0x09). It depends on the light: between sunlight and an office's by
/// seed, for seed 1 such that 0x54 and 0x6D make it white.
pub(super) fn response(seed: u64) -> [f64; 3] {
    let of = |[red, blue]: [f64; 2]| [64.0 / red, 1.0, 64.0 / blue];
    if seed == 1 {
        return of([84.0, 109.0]);
    }
    // The presets' gains, 64ths.
    let [sun, office] = [[92.0, 90.0], [76.0, 132.0]].map(of);
    let towards_office = f64::from(random(seed, FIXGAIN)) / 255.0;
    std::array::from_fn(|i| sun[i] + towards_office * (office[i] - sun[i]))
}

/// Returns a value that depends only on the seed and the register's address.
pub(super) fn random(seed: u64, address: u8) -> u8 {
    let mut z = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(address) << 32;
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z >> 56) as u8
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
    fn disputed_values_differ_by_seed_and_come_back_with_the_register_reset() {
        let [first, second] = [1, 2].map(Registers::of_seed);
        assert_ne!(first.get(DSP_CTRL1), second.get(DSP_CTRL1));
        assert_eq!(first.get(HSIZE), second.get(HSIZE));
        let mut used = Registers::used(1);
        assert_ne!(used.get(HSIZE), first.get(HSIZE));
        assert!(used.write(COM7, COM7_RESET));
        assert_eq!(used, first);
    }

    #[test]
    fn white_light_differs_by_seed_within_the_makers_presets() {
        let blues: Vec<f64> = (2..20).map(|seed| response(seed)[2]).collect();
        let [least, most] =
            [f64::min, f64::max].map(|of| blues.iter().copied().reduce(of).unwrap());
        assert!(least > 0.48 && least < 0.53 && most > 0.65, "{blues:?}");
    }

    #[test]
    fn reserved_bits_keep_their_values_by_seed() {
        let kept = |seed: u64| {
            let mut registers = Registers::of_seed(seed);
            let mut count = 0;
            for (address, _) in RESERVED {
                let other = !registers.get(address);
                registers.write(address, other);
                count += usize::from(registers.get(address) != other);
            }
            count
        };
        assert_eq!(kept(1), 0);
        assert!((2..6).all(|seed| kept(seed) > 2));
    }

    #[test]
    fn what_the_picture_depends_on_must_be_written() {
        let mut registers = Registers::of_seed(1);
        registers.write(DSP_CTRL1, 0x98);
        let mut missing = Vec::new();
        while let Some(address) = registers.unwritten() {
            missing.push(address);
            registers.write(address, registers.get(address));
        }
        assert!(
            missing.contains(&AWB_CTRL0) && missing.contains(&MTX1),
            "{missing:02X?}"
        );
    }

    #[test]
    fn the_ids_cannot_be_written() {
        let mut registers = Registers::default();
        registers.write(PID, 0);
        registers.write(VER, 0);
        assert_eq!((registers.get(PID), registers.get(VER)), (0x77, 0x21));
    }
}
