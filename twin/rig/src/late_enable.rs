//! ADC3's enable that comes right after a calibration: the converter may take it back (ST's HAL,
//! `ADC_Enable`, sets ADEN until ADRDY comes). By seed it does so once for each calibration.

use rigless::emulator::{Access, AccessKind};
use rigless::mcu::Operate;
use rigless::soc::Width;
use rigless::soc::stm32h743::Stm32h743;

/// ADC3_CR and its commands.
const CR: u64 = 0x5802_6008;
const ENABLE: u64 = 1;
const DISABLE: u64 = 1 << 1;
const CALIBRATE: u64 = 1 << 31;
/// Bits that are no commands: the mode of calibration, boost, and the regulator.
const KEPT: u64 = 1 << 28 | 1 << 16 | 3 << 8;

/// Whether the next enable is taken back.
#[derive(Debug)]
pub struct LateEnable {
    happens: bool,
    calibrated: bool,
}

impl LateEnable {
    /// Returns a converter that takes its enable back or not, by `seed`.
    pub fn new(seed: u64) -> Self {
        Self {
            happens: seed % 2 == 1,
            calibrated: false,
        }
    }

    /// Handles an access by the core.
    pub fn accessed(&mut self, part: &mut Stm32h743, access: &Access, value: u64) {
        if !self.happens || access.kind != AccessKind::Write || access.address != CR {
            return;
        }
        if value & CALIBRATE != 0 {
            self.calibrated = true;
        } else if value & ENABLE != 0 && std::mem::take(&mut self.calibrated) {
            // The model has accepted the enable, and accepts this.
            let _ = part.write(access.virtual_time, CR, Width::W32, value & KEPT | DISABLE);
        }
    }
}
