//! The CRC calculation unit.
//!
//! RM0433, "Cyclic redundancy check calculation unit". Simulated: words of 32 bits, any polynomial
//! of 32 bits, the reversals of input and output. Not simulated: shorter polynomials and writes.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32h743::generated::crc::Register;

/// CR: the unit begins anew. How each word is reversed: bits 6:5. The result is reversed.
const RESET: u64 = 1;
const REVERSAL_BIT: u32 = 5;
const REVERSES_OUTPUT: u64 = 1 << 7;

/// The unit.
#[derive(Debug)]
pub struct Crc {
    remainder: u32,
}

impl Default for Crc {
    fn default() -> Self {
        Self {
            remainder: u32::MAX,
        }
    }
}

impl Crc {
    fn take(&mut self, word: u32, polynomial: u32) {
        self.remainder ^= word;
        for _ in 0..u32::BITS {
            let divides = self.remainder >> 31 == 1;
            self.remainder = (self.remainder << 1) ^ if divides { polynomial } else { 0 };
        }
    }
}

/// Returns a word with its bits reversed within bytes, halfwords or the word.
fn reversed(word: u32, how: u64) -> u32 {
    match how & 3 {
        0 => word,
        1 => word.swap_bytes().reverse_bits(),
        2 => word.rotate_left(16).reverse_bits(),
        _ => word.reverse_bits(),
    }
}

impl Device for Crc {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
        let control = registers.get(Register::Cr);
        match register {
            Register::Dr => {
                let word = reversed(value as u32, control >> REVERSAL_BIT);
                self.take(word, registers.get(Register::Pol) as u32);
            }
            Register::Cr if value & RESET != 0 => {
                self.remainder = registers.get(Register::Init) as u32;
                registers.set(Register::Cr, control & !RESET);
            }
            _ => {}
        }
        let is_reversed = registers.get(Register::Cr) & REVERSES_OUTPUT != 0;
        let result = match is_reversed {
            true => self.remainder.reverse_bits(),
            false => self.remainder,
        };
        registers.set(Register::Dr, result.into());
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rigless::mcu::{Mcu, Operate, Single};
    use rigless::soc::Width;
    use rigless::soc::stm32h743::{builder, generated::CRC};
    use rigless::time::VirtualNanos;

    /// CRC-32/MPEG-2 and the CRC-32 of zip, by their parameters: both are of the words "1234" and
    /// "5678".
    #[test]
    fn known_sums_are_right() {
        for (control, text_order, expected) in
            [(1, true, 0x49E3_C2FB), (0xE1, false, !0x9AE0_DAAF_u32)]
        {
            let mut unit = Single::new(builder(), "CRC", Crc::default()).unwrap();
            let mut write = |offset: u64, value: u64| {
                let address = CRC.base + offset;
                unit.write(VirtualNanos(0), address, Width::W32, value)
                    .unwrap();
            };
            write(8, control);
            for word in [*b"1234", *b"5678"] {
                let word = match text_order {
                    true => u32::from_be_bytes(word),
                    false => u32::from_le_bytes(word),
                };
                write(0, word.into());
            }
            let registers = unit.bus().registers("CRC").unwrap();
            assert_eq!(registers.get(Register::Dr), u64::from(expected));
        }
    }
}
