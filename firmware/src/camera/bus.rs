//! Drives the camera's control bus, I²C1.
//!
//! # Design
//! A failed transfer is repeated on a freed bus. Two causes are known. First, after a
//! microcontroller reset in the middle of a byte the camera waits for the rest of it, and holds SDA
//! low. The camera's own reset, if it has one, comes later. Second, I²C1 may report a bus error
//! that did not happen (errata ES0396, "spurious bus error detection in master mode"). The HAL then
//! aborts the transfer.

use super::free_bus::{self, Lines};
use super::registers::few;
use embassy_embedded_hal::SetConfig;
use embassy_stm32::i2c::{self, I2c, Master};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac;
use embassy_stm32::time::Hertz;
use heapless::Vec;

/// Clock of the camera's control bus. The pins' own pull-ups support those on the board.
pub const BUS_CLOCK: Hertz = Hertz::khz(100);
/// Number of attempts for a transfer.
const ATTEMPTS: u32 = 3;

/// A device on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Device {
    /// Its address, 7 bits.
    pub address: u8,
    /// Its registers' addresses have two bytes, the high one first.
    pub is_wide: bool,
}

/// The bytes of a transfer: a register's address, and its value.
type Bytes = Vec<u8, 4>;

impl Device {
    /// A register's address and value, as they are sent.
    fn bytes(self, register: u16, value: &[u8]) -> Bytes {
        let address = register.to_be_bytes();
        let address = if self.is_wide {
            &address
        } else {
            &address[1..]
        };
        few(address.iter().chain(value).copied())
    }
}

/// The bus. A transfer fails if the device does not answer, or the bus does not work, at every
/// attempt.
pub struct Bus(I2c<'static, Blocking, Master>);

impl Bus {
    /// The bus, whose clock must be [`BUS_CLOCK`].
    pub fn new(bus: I2c<'static, Blocking, Master>) -> Self {
        Self(bus)
    }

    /// Writes a device's register of one byte.
    pub fn write_byte(
        &mut self,
        device: Device,
        register: u16,
        value: u8,
    ) -> Result<(), i2c::Error> {
        let bytes = device.bytes(register, &[value]);
        self.persist(|bus| bus.blocking_write(device.address, &bytes))
    }

    /// Writes a device's register of two bytes, the high one first.
    pub fn write_word(
        &mut self,
        device: Device,
        register: u16,
        value: u16,
    ) -> Result<(), i2c::Error> {
        let bytes = device.bytes(register, &value.to_be_bytes());
        self.persist(|bus| bus.blocking_write(device.address, &bytes))
    }

    /// Reads a register of one byte by SCCB: with a stop between address and value.
    pub fn read_byte(&mut self, device: Device, register: u16) -> Result<u8, i2c::Error> {
        let address = device.bytes(register, &[]);
        self.persist(|bus| {
            let mut value = [0];
            bus.blocking_write(device.address, &address)?;
            bus.blocking_read(device.address, &mut value)?;
            Ok(value[0])
        })
    }

    /// Reads a register of two bytes, the high one first, with a repeated start before the value.
    pub fn read_word(&mut self, device: Device, register: u16) -> Result<u16, i2c::Error> {
        let address = device.bytes(register, &[]);
        self.persist(|bus| {
            let mut value = [0; 2];
            bus.blocking_write_read(device.address, &address, &mut value)?;
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
            // Never fails: the bus was created with the same clock.
            let _ = self.0.set_config(&BUS_CLOCK);
            if attempt == ATTEMPTS {
                return Err(error);
            }
            attempt += 1;
        }
    }
}

/// Makes a camera that holds the control bus release it, and resets I²C1.
fn free() {
    let lines = Lines {
        port: pac::GPIOB,
        clock: 8,
        data: 9,
    };
    lines.free();
    free_bus::reset_i2c1();
}
