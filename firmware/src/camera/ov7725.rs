//! OmniVision OV7725: 320 × 240, RGB565 or YUV422, over SCCB (I²C with a stop between address and
//! read).

use super::Sccb;
use super::ov7725_registers::{
    AUTOMATIC, COM7, COM7_RESET, COM8, EXPOSURE, Format, LOCKED, PID, TABLE, VER,
};
use crate::board::XCLK_HZ;
use crate::shared::EXPOSURE_MIDDLE_US;
use core::fmt;
use core::sync::atomic::Ordering;
use embassy_stm32::gpio::Output;
use embassy_stm32::i2c;
use embassy_time::{Duration, Instant, Timer};
use hivtac_terms::geometry::Preset;

/// Name in the device's hello.
pub const NAME: &str = "ov7725";
/// Its lens and pixels.
pub const PRESET: Preset = Preset::Ov7725;
/// Columns of a frame, px.
pub const WIDTH: u16 = 320;
/// Rows of a frame, px.
pub const HEIGHT: u16 = 240;

/// 156, 78 or 39: which frame rate the firmware was built for (`HIVTAC_FRAME_RATE`, `build.rs`).
pub const FRAMES_PER_SECOND: u32 = match u32::from_str_radix(env!("HIVTAC_FRAME_RATE"), 10) {
    Ok(rate) => rate,
    Err(_) => panic!("HIVTAC_FRAME_RATE must be 156, 78 or 39"),
};
/// Lines from frame to frame, blank ones included.
pub const LINES: u16 = 278;
/// Clocks from frame to frame: lines of 576 pixels of two bytes, one byte per PCLK.
const FRAME_CLOCKS: u64 = LINES as u64 * 576 * 2;
/// From the VSYNC edge that begins a frame to the middle row: 22 blank lines and half of the rows.
/// A row's exposure ends when it is read, which is when it is sent.
const LINES_TO_MIDDLE_ROW: u32 = 22 + HEIGHT as u32 / 2;
/// PCLK at 156 frames a second: XCLK times the sensor's loop. Lower rates divide it.
const FULL_PCLK_HZ: u64 = 4 * XCLK_HZ as u64;
/// Time from frame to frame.
pub const FRAME_TIME: Duration = Duration::from_micros(
    FRAME_CLOCKS * (156 / FRAMES_PER_SECOND as u64) * 1_000_000 / FULL_PCLK_HZ,
);

/// PCLK edge on which data is stable.
pub const SAMPLE_ON_RISING_EDGE: bool = true;
/// Level of VSYNC while it says "no data": its pulse is high.
pub const VSYNC_BLANKING_IS_HIGH: bool = true;
/// Level of HREF while it says "no data": it is high with the data.
pub const HREF_BLANKING_IS_HIGH: bool = false;

/// The register file is busy for 1 ms after a reset and 10 ms after power-down; doubled.
const SETTLE: Duration = Duration::from_millis(20);
/// Frames after a change of registers that the data sheet asks not to use.
const FRAMES_TO_SETTLE: u32 = 10;
/// Frames in a row with the same exposure and gain are steady.
const STEADY_FRAMES: u32 = 3;
/// Exposure and gain are taken as they are after this time: the data sheet's ten frames at its
/// slowest rate.
const PATIENCE: Duration = Duration::from_millis(300);
/// Between two register writes: lets tasks of lower priority run.
const PAUSE: Duration = Duration::from_micros(100);

/// From the VSYNC edge that begins a frame to the middle of its middle row's exposure, µs.
pub fn exposure_middle_us() -> u32 {
    EXPOSURE_MIDDLE_US.load(Ordering::Relaxed)
}

/// Why a camera cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// It does not acknowledge, or the bus does not work.
    Bus(i2c::Error),
    /// Another part answers.
    WrongId {
        /// Register `PID` and `VER` as read.
        found: [u8; 2],
    },
    /// A register does not hold what was written.
    Register {
        /// Its address.
        address: u8,
        /// What it holds.
        found: u8,
    },
}

impl From<i2c::Error> for Error {
    fn from(error: i2c::Error) -> Self {
        Error::Bus(error)
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Error::Bus(error) => write!(f, "no OV7725 on I2C1 ({error}); check its cable"),
            Error::WrongId { found: [p, v] } => {
                write!(
                    f,
                    "ID {p:02X} {v:02X}, an OV7725 has 77 21; fit that camera"
                )
            }
            Error::Register { address, found } => {
                write!(f, "register {address:02X} reads {found:02X} after a write")
            }
        }
    }
}

/// The camera's control side.
pub struct Camera {
    sccb: Sccb,
    standby: Output<'static>,
}

impl Camera {
    /// `sccb` at 100 kHz or up to 400 kHz; `standby` high stops the camera, whose registers stay.
    /// XCLK must already run.
    pub fn new(sccb: Sccb, standby: Output<'static>) -> Self {
        Self { sccb, standby }
    }

    /// Has the camera run, checks that it is the right one, and resets its registers: nothing else
    /// does.
    pub async fn reset(&mut self) -> Result<(), Error> {
        self.standby.set_low();
        Timer::after(SETTLE).await;
        let found = [self.sccb.read(PID.0)?, self.sccb.read(VER.0)?];
        if found != [PID.1, VER.1] {
            return Err(Error::WrongId { found });
        }
        Ok(self.sccb.write(COM7, COM7_RESET)?)
    }

    /// Writes the register table after a reset; returns when the camera sends well exposed frames
    /// so.
    pub async fn configure(&mut self, format: Format) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        for table in [format.registers(), TABLE] {
            self.write_all(table).await?;
            self.check(table).await?;
        }
        self.lock_exposure().await
    }

    /// Changes the pixel format of a configured camera; returns when it sends frames so. Exposure
    /// and gain stay.
    pub async fn set_format(&mut self, format: Format) -> Result<(), Error> {
        self.write_all(format.registers()).await?;
        Timer::after(FRAME_TIME * FRAMES_TO_SETTLE).await;
        Ok(())
    }

    /// Lets exposure and gain find what the light needs, and keeps that: markers do not change
    /// their brightness with what presses the film.
    pub async fn lock_exposure(&mut self) -> Result<(), Error> {
        self.sccb.write(COM8, AUTOMATIC)?;
        let begun = Instant::now();
        let (mut found, mut steady) = (self.exposure()?, 1);
        while steady < STEADY_FRAMES && begun.elapsed() < PATIENCE {
            Timer::after(FRAME_TIME).await;
            let now = self.exposure()?;
            steady = if now == found { steady + 1 } else { 1 };
            found = now;
        }
        self.sccb.write(COM8, LOCKED)?;
        for (register, value) in EXPOSURE.into_iter().zip(found) {
            self.sccb.write(register, value)?;
        }
        let [_, low, high] = found;
        let lines = u32::from(u16::from_le_bytes([low, high])).min(u32::from(LINES));
        let half_lines = 2 * LINES_TO_MIDDLE_ROW - lines;
        let middle_us = half_lines * FRAME_TIME.as_micros() as u32 / (2 * u32::from(LINES));
        EXPOSURE_MIDDLE_US.store(middle_us, Ordering::Relaxed);
        Ok(())
    }

    /// What [`EXPOSURE`]'s registers hold.
    fn exposure(&mut self) -> Result<[u8; 3], Error> {
        let [gain, low, high] = EXPOSURE;
        Ok([
            self.sccb.read(gain)?,
            self.sccb.read(low)?,
            self.sccb.read(high)?,
        ])
    }

    async fn write_all(&mut self, table: &[(u8, u8)]) -> Result<(), Error> {
        for (register, value) in table {
            self.sccb.write(*register, *value)?;
            Timer::after(PAUSE).await;
        }
        Ok(())
    }

    /// Reads a table back.
    async fn check(&mut self, table: &[(u8, u8)]) -> Result<(), Error> {
        for (address, value) in table {
            let (address, found) = (*address, self.sccb.read(*address)?);
            if found != *value {
                return Err(Error::Register { address, found });
            }
            Timer::after(PAUSE).await;
        }
        Ok(())
    }
}
