//! Tells the supply voltage under which the microcontroller resets itself, an option byte.

use embassy_stm32::pac::FLASH;
use hivtac_wire::health::BrownOut;

/// Returns the level of the brown-out reset in use (RM0433, FLASH_OPTSR_CUR).
pub fn brown_out() -> BrownOut {
    match FLASH.optsr_cur().read().bor_lev() {
        0 => BrownOut::Off,
        1 => BrownOut::Low,
        2 => BrownOut::Middle,
        _ => BrownOut::High,
    }
}
