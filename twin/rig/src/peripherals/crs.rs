//! The clock recovery system (CRS), and its trimming of the internal 48 MHz oscillator.
//!
//! RM0433 chapter 9: the configuration register is write-protected while the frequency error
//! counter is enabled. Simulated: that protection, and the oscillator's frequency. Not simulated:
//! the counter, its flags and interrupts.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32h743::generated::crs::Register;

/// HSI48 without trimming, Hz: 0.6 % fast, the limit of DS12110 table 46 at 30 °C. USB full speed
/// allows 0.25 %.
pub const HSI48_UNTRIMMED_HZ: u64 = 48_288_000;

/// CR: frequency error counter enabled; automatic trimming enabled.
const COUNTER: u64 = 1 << 5;
const TRIMS: u64 = 1 << 6;
/// CFGR: synchronization source, bits 29:28. OTG_FS is 3; OTG_HS is 2, the value after a reset.
const SOURCE_BIT: u32 = 28;
const OTG_FS: u64 = 3;
const CONFIGURATION_AFTER_RESET: u64 = 0x2022_BB7F;

/// The clock recovery system.
#[derive(Debug)]
pub struct Crs {
    configuration: u64,
}

impl Default for Crs {
    fn default() -> Self {
        Self {
            configuration: CONFIGURATION_AFTER_RESET,
        }
    }
}

/// Returns whether registers with these values trim the oscillator to the packets of the host on
/// OTG_FS.
pub fn trims(registers: &RegisterFile) -> bool {
    let source = registers.get(Register::Cfgr) >> SOURCE_BIT & 3;
    let wanted = COUNTER | TRIMS;
    registers.get(Register::Cr) & wanted == wanted && source == OTG_FS
}

impl Device for Crs {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        _value: u64,
        registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
        if register != Register::Cfgr {
            return;
        }
        if registers.get(Register::Cr) & COUNTER != 0 {
            registers.set(Register::Cfgr, self.configuration);
        } else {
            self.configuration = registers.get(Register::Cfgr);
        }
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
    use rigless::soc::stm32h743::{builder, generated::CRS};
    use rigless::time::VirtualNanos;

    #[test]
    fn the_source_cannot_be_changed_while_the_counter_is_enabled() {
        let mut crs = Single::new(builder(), "CRS", Crs::default()).unwrap();
        let mut trims_after = |writes: &[(u64, u64)]| {
            for (offset, value) in writes {
                let address = CRS.base + offset;
                crs.write(VirtualNanos(0), address, Width::W32, *value)
                    .unwrap();
            }
            trims(crs.bus().registers("CRS").unwrap())
        };
        let (enable, select) = ((0, COUNTER | TRIMS), (4, OTG_FS << SOURCE_BIT));
        assert!(!trims_after(&[enable, select]));
        assert!(trims_after(&[(0, 0), select, enable]));
    }
}
