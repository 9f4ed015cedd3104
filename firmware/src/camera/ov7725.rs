//! OmniVision OV7725: 320 × 240, RGB565 or YUV422, over SCCB (I²C with a stop between address and
//! read).

use super::identity::{self, Identity};
use super::ov7725_registers::{AUTOMATIC, COM7, COM7_RESET, COM8, EXPOSURE, Format, LOCKED, TABLE};
use super::{Bus, Error};
use crate::board::{CameraLines, XCLK_HZ};
use crate::shared::EXPOSURE_MIDDLE_US;
use core::sync::atomic::Ordering;
use embassy_stm32::i2c;
use embassy_time::{Duration, Instant, Timer};
use hivtac_sensing::motion::Motion;
use hivtac_terms::geometry::Preset;

/// What it says it is.
pub const IDENTITY: Identity = identity::OV7725;
/// Name in the device's hello.
pub const NAME: &str = "ov7725";
/// Its lens and pixels.
pub const PRESET: Preset = Preset::Ov7725;
/// What it sends unless it is told otherwise.
pub const USUAL_FORMAT: Format = Format::Rgb565;
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
const LINES: u16 = 278;
/// When its rows are exposed: one after the other.
pub const MOTION: Motion = Motion::rolling(LINES);
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

/// The camera's control side.
pub struct Camera {
    bus: Bus,
    lines: CameraLines,
}

impl Camera {
    /// The bus at 100 kHz or up to 400 kHz. XCLK must already run.
    pub fn new(bus: Bus, lines: CameraLines) -> Self {
        Self { bus, lines }
    }

    /// Has the camera run, checks that it is the right one, and resets its registers: nothing else
    /// does.
    pub async fn reset(&mut self) -> Result<(), Error> {
        self.lines.wake().await;
        Timer::after(SETTLE).await;
        identity::check(&mut self.bus)?;
        Ok(self.write(COM7, COM7_RESET)?)
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
        self.write(COM8, AUTOMATIC)?;
        let begun = Instant::now();
        let (mut found, mut steady) = (self.exposure()?, 1);
        while steady < STEADY_FRAMES && begun.elapsed() < PATIENCE {
            Timer::after(FRAME_TIME).await;
            let now = self.exposure()?;
            steady = if now == found { steady + 1 } else { 1 };
            found = now;
        }
        self.write(COM8, LOCKED)?;
        for (register, value) in EXPOSURE.into_iter().zip(found) {
            self.write(register, value)?;
        }
        let [_, low, high] = found;
        let lines = u32::from(u16::from_le_bytes([low, high])).min(u32::from(LINES));
        let half_lines = 2 * LINES_TO_MIDDLE_ROW - lines;
        let middle_us = half_lines * FRAME_TIME.as_micros() as u32 / (2 * u32::from(LINES));
        EXPOSURE_MIDDLE_US.store(middle_us as i32, Ordering::Relaxed);
        Ok(())
    }

    /// What [`EXPOSURE`]'s registers hold.
    fn exposure(&mut self) -> Result<[u8; 3], Error> {
        let [gain, low, high] = EXPOSURE;
        Ok([self.read(gain)?, self.read(low)?, self.read(high)?])
    }

    fn write(&mut self, register: u8, value: u8) -> Result<(), i2c::Error> {
        self.bus.write(IDENTITY.address, &[register, value])
    }

    fn read(&mut self, register: u8) -> Result<u8, i2c::Error> {
        self.bus.read_byte(IDENTITY.address, register)
    }

    async fn write_all(&mut self, table: &[(u8, u8)]) -> Result<(), Error> {
        for (register, value) in table {
            self.write(*register, *value)?;
            Timer::after(PAUSE).await;
        }
        Ok(())
    }

    /// Reads a table back.
    async fn check(&mut self, table: &[(u8, u8)]) -> Result<(), Error> {
        for (address, value) in table {
            let (address, found) = (*address, self.read(*address)?);
            if found != *value {
                let found = found.into();
                return Err(Error::Register { address, found });
            }
            Timer::after(PAUSE).await;
        }
        Ok(())
    }
}
