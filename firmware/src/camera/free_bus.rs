//! Frees an I²C bus that a device holds, with nine clocks and a stop (UM10204, section 3.1.16).

use embassy_stm32::pac::RCC;
use embassy_stm32::pac::gpio::{Gpio, vals::Moder};

/// Half a clock period, in core cycles: 5 µs at 480 MHz.
const HALF: u32 = 2_400;

/// The two lines of a bus on one port: open-drain outputs, with or without their alternate
/// function.
pub struct Lines {
    /// Their port.
    pub port: Gpio,
    /// Pin of the clock line.
    pub clock: usize,
    /// Pin of the data line.
    pub data: usize,
}

impl Lines {
    /// Clocks until the device releases the data line, at most nine times, then sends a stop. Takes
    /// at most 0.2 ms.
    pub fn free(&self) {
        self.set(self.clock, true);
        self.set(self.data, true);
        self.mode(Moder::OUTPUT);
        for _ in 0..9 {
            if self.port.idr().read().idr(self.data) == embassy_stm32::pac::gpio::vals::Idr::HIGH {
                break;
            }
            self.step(self.clock, false);
            self.step(self.clock, true);
        }
        self.step(self.clock, false);
        self.step(self.data, false);
        self.step(self.clock, true);
        self.step(self.data, true);
        self.mode(Moder::ALTERNATE);
    }

    fn step(&self, pin: usize, high: bool) {
        self.set(pin, high);
        cortex_m::asm::delay(HALF);
    }

    fn set(&self, pin: usize, high: bool) {
        self.port.bsrr().write(|w| match high {
            true => w.set_bs(pin, true),
            false => w.set_br(pin, true),
        });
    }

    fn mode(&self, mode: Moder) {
        critical_section::with(|_| {
            self.port.moder().modify(|w| {
                w.set_moder(self.clock, mode);
                w.set_moder(self.data, mode);
            });
        });
    }
}

/// Resets I²C1. Its clock and filters must then be set again.
pub fn reset_i2c1() {
    critical_section::with(|_| {
        RCC.apb1lrstr().modify(|w| w.set_i2c1rst(true));
        RCC.apb1lrstr().modify(|w| w.set_i2c1rst(false));
    });
}
