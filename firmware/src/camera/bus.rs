//! The camera's control bus, I²C1.
//!
//! # Design
//! A transfer that fails is tried again on a freed bus. Two things are known to go wrong. A
//! microcontroller that was reset amid a byte leaves the camera waiting for the rest of it, holding
//! SDA low; its reset, where it has one, comes later. And I²C1 may report a bus error where there
//! was none (errata ES0396, "spurious bus error detection in master mode"), upon which the HAL
//! gives the transfer up in its middle.

use super::free_bus::{self, Lines};
use embassy_embedded_hal::SetConfig;
use embassy_stm32::i2c::{self, I2c, Master};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::time::Hertz;

/// Of the camera's control bus. The pins' own pull-ups help those on the board.
pub const BUS_CLOCK: Hertz = Hertz::khz(100);
/// Times that a transfer is tried.
const ATTEMPTS: u32 = 3;

/// The bus. Every transfer fails when the device does not answer, or the bus does not work, at
/// every attempt.
pub struct Bus(I2c<'static, Blocking, Master>);

impl Bus {
    /// At [`BUS_CLOCK`].
    pub fn new(bus: I2c<'static, Blocking, Master>) -> Self {
        Self(bus)
    }

    /// Writes a device's register of one byte.
    pub fn write_byte(&mut self, device: u8, register: u8, value: u8) -> Result<(), i2c::Error> {
        self.persist(|bus| bus.blocking_write(device, &[register, value]))
    }

    /// Writes a device's register of two bytes, the high one first.
    pub fn write_word(&mut self, device: u8, register: u8, value: u16) -> Result<(), i2c::Error> {
        let [high, low] = value.to_be_bytes();
        self.persist(|bus| bus.blocking_write(device, &[register, high, low]))
    }

    /// Reads a register of one byte as SCCB has it: with a stop between address and value.
    pub fn read_byte(&mut self, device: u8, register: u8) -> Result<u8, i2c::Error> {
        self.persist(|bus| {
            let mut value = [0];
            bus.blocking_write(device, &[register])?;
            bus.blocking_read(device, &mut value)?;
            Ok(value[0])
        })
    }

    /// Reads a register of two bytes, the high one first, with a repeated start before the value.
    pub fn read_word(&mut self, device: u8, register: u8) -> Result<u16, i2c::Error> {
        self.persist(|bus| {
            let mut value = [0; 2];
            bus.blocking_write_read(device, &[register], &mut value)?;
            Ok(u16::from_be_bytes(value))
        })
    }

    fn persist<T>(
        &mut self,
        transfer: impl Fn(&mut I2c<'static, Blocking, Master>) -> Result<T, i2c::Error>,
    ) -> Result<T, i2c::Error> {
        let mut attempt = 1;
        loop {
            let error = match transfer(&mut self.0) {
                Ok(value) => return Ok(value),
                Err(error) => error,
            };
            free();
            // Never fails: the clock is the one it was made with.
            let _ = self.0.set_config(&BUS_CLOCK);
            if attempt == ATTEMPTS {
                return Err(error);
            }
            attempt += 1;
        }
    }
}

/// Has a camera that holds the control bus let go of it, and brings I²C1 to its state after a
/// reset.
fn free() {
    let lines = Lines {
        port: pac::GPIOB,
        clock: 8,
        data: 9,
    };
    lines.free();
    free_bus::reset_i2c1();
}
