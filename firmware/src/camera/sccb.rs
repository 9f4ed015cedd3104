//! The camera's control bus, SCCB: I²C1 with a stop between address and read.
//!
//! # Design
//! A transfer that fails is tried again on a freed bus. Two things are known to go wrong. A
//! microcontroller that was reset amid a byte leaves the camera waiting for the rest of it, holding
//! SDA low; the camera's own reset line does not hear of it. And I²C1 may report a bus error where
//! there was none (errata ES0396, "spurious bus error detection in master mode"), upon which the
//! HAL gives the transfer up in its middle.

use crate::board::{self, SCCB_CLOCK};
use embassy_embedded_hal::SetConfig;
use embassy_stm32::i2c::{self, I2c, Master};
use embassy_stm32::mode::Blocking;

const ADDRESS: u8 = 0x21;
/// Times that a transfer is tried.
const ATTEMPTS: u32 = 3;

/// The bus.
pub struct Sccb(I2c<'static, Blocking, Master>);

impl Sccb {
    /// At [`SCCB_CLOCK`].
    pub fn new(bus: I2c<'static, Blocking, Master>) -> Self {
        Self(bus)
    }

    /// Writes a register.
    ///
    /// # Errors
    /// When the camera does not answer, or the bus does not work, at every attempt.
    pub fn write(&mut self, register: u8, value: u8) -> Result<(), i2c::Error> {
        self.persist(|bus| bus.blocking_write(ADDRESS, &[register, value]))
    }

    /// Reads a register.
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn read(&mut self, register: u8) -> Result<u8, i2c::Error> {
        self.persist(|bus| {
            let mut value = [0];
            bus.blocking_write(ADDRESS, &[register])?;
            bus.blocking_read(ADDRESS, &mut value)?;
            Ok(value[0])
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
            board::free_sccb();
            // Never fails: the clock is the one it was made with.
            let _ = self.0.set_config(&SCCB_CLOCK);
            if attempt == ATTEMPTS {
                return Err(error);
            }
            attempt += 1;
        }
    }
}
