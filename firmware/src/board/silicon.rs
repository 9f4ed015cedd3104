//! Checks the revision of the silicon, and ends the program on one that is too old.

use embassy_stm32::gpio::Level;
use embassy_stm32::pac::gpio::{Gpio, vals::Moder};
use embassy_stm32::pac::{DBGMCU, RCC};

/// REV_ID of the first revision with 480 MHz, X. V, the usual one, is 0x2003; Z and Y are 0x1001
/// and 0x1003.
const FIRST_REVISION: u16 = 0x2001;
/// A tenth of a second, in core cycles at the 64 MHz after a reset.
const TENTH: u32 = 6_400_000;

/// The LED's pin.
pub struct Led {
    /// Its port.
    pub port: Gpio,
    /// Its number.
    pub pin: usize,
    /// The level at which it is on.
    pub on: Level,
}

impl Led {
    fn set(&self, on: bool) {
        let high = (self.on == Level::High) == on;
        self.port.bsrr().write(|w| match high {
            true => w.set_bs(self.pin, true),
            false => w.set_br(self.pin, true),
        });
    }
}

/// Returns the REV_ID of this microcontroller.
pub fn revision() -> u16 {
    DBGMCU.idc().read().rev_id()
}

/// Returns only on silicon that can run this program. Earlier silicon has at most 400 MHz, and
/// setting up 480 MHz would wait for ever for a core voltage that it does not have. It also
/// corrupts reads of the DMA's memory (errata ES0396, "Reading from AXI SRAM may lead to data read
/// corruption").
pub fn refuse_old(led: &Led) {
    let revision = revision();
    if revision >= FIRST_REVISION {
        return;
    }
    defmt::error!(
        "silicon revision {=u16:x}: needs {=u16:x} (X) or later, which runs at 480 MHz",
        revision,
        FIRST_REVISION
    );
    flash_for_ever(led);
}

/// Flashes the LED twice a second, for ever.
fn flash_for_ever(led: &Led) -> ! {
    RCC.ahb4enr().modify(|w| {
        w.set_gpiocen(true);
        w.set_gpioeen(true);
    });
    // The read returns once the clock runs.
    let _ = RCC.ahb4enr().read();
    led.set(false);
    led.port
        .moder()
        .modify(|w| w.set_moder(led.pin, Moder::OUTPUT));
    loop {
        for _ in 0..2 {
            led.set(true);
            cortex_m::asm::delay(TENTH);
            led.set(false);
            cortex_m::asm::delay(TENTH);
        }
        cortex_m::asm::delay(6 * TENTH);
    }
}
