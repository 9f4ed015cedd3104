//! OmniVision OV7725: 320 × 240, RGB565 or YUV422, over SCCB (I²C with a stop between address and
//! read).

use super::identity::{self, Identity};
use super::ov7725_registers::{AUTOMATIC, COM7, COM7_RESET, COM8, EXPOSURE, Format, LOCKED, TABLE};
use super::registers::Registers;
use super::{Bus, Error, Setting};
use crate::board::{CameraLines, XCLK_HZ};
use crate::shared::EXPOSURE_MIDDLE_US;
use core::sync::atomic::Ordering;
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

/// [`FRAME_TIME`], µs.
const FRAME_US: u32 = FRAME_TIME.as_micros() as u32;

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
/// The camera's control side.
pub struct Camera {
    registers: Registers,
    lines: CameraLines,
    /// What exposure and gain are kept at.
    locked: [(u8, u8); 4],
}

impl Camera {
    /// The bus at 100 kHz or up to 400 kHz. XCLK must already run.
    pub fn new(bus: Bus, lines: CameraLines) -> Self {
        let [gain, low, high] = EXPOSURE;
        Self {
            registers: Registers(bus),
            lines,
            locked: [(COM8, LOCKED), (gain, 0), (low, 0), (high, 0)],
        }
    }

    /// Has the camera run, checks that it is the right one, and resets its registers: nothing else
    /// does.
    pub async fn reset(&mut self) -> Result<(), Error> {
        self.lines.wake().await;
        Timer::after(SETTLE).await;
        identity::check(&mut self.registers.0)?;
        self.registers.write(COM7, COM7_RESET)
    }

    /// Writes the register table after a reset; returns when the camera sends well exposed frames
    /// so.
    pub async fn configure(&mut self, format: Format) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        for table in [format.registers(), TABLE] {
            self.registers.set(table).await?;
        }
        self.lock_exposure().await
    }

    /// Changes the pixel format of a configured camera; returns when it sends frames so. Exposure
    /// and gain stay.
    pub async fn set_format(&mut self, format: Format) -> Result<(), Error> {
        self.registers.set(format.registers()).await?;
        Timer::after(FRAME_TIME * FRAMES_TO_SETTLE).await;
        Ok(())
    }

    /// Lets exposure and gain find what the light needs, and keeps that: markers do not change
    /// their brightness with what presses the film.
    pub async fn lock_exposure(&mut self) -> Result<(), Error> {
        self.registers.write(COM8, AUTOMATIC)?;
        let begun = Instant::now();
        let (mut found, mut steady) = (self.exposure()?, 1);
        while steady < STEADY_FRAMES && begun.elapsed() < PATIENCE {
            Timer::after(FRAME_TIME).await;
            let now = self.exposure()?;
            steady = if now == found { steady + 1 } else { 1 };
            found = now;
        }
        for ((_, value), found) in self.locked.iter_mut().skip(1).zip(found) {
            *value = found;
        }
        self.registers.set(&self.locked).await?;
        let half_lines = 2 * LINES_TO_MIDDLE_ROW - self.lines();
        let middle_us = half_lines * FRAME_US / (2 * u32::from(LINES));
        EXPOSURE_MIDDLE_US.store(middle_us as i32, Ordering::Relaxed);
        Ok(())
    }

    /// What it is set to, while frames of `format` are captured.
    pub async fn setting(&mut self, format: Format) -> Result<Setting, Error> {
        let [_, (_, gain), ..] = self.locked;
        Ok(Setting {
            id: identity::id(&mut self.registers.0)?,
            comparison: self
                .registers
                .compare(&[format.registers(), TABLE, &self.locked])
                .await?,
            exposure_us: self.lines() * FRAME_US / u32::from(LINES),
            longest_exposure_us: FRAME_US,
            gain_sixteenths: gain_sixteenths(gain),
        })
    }

    /// Lines that a row is exposed, as it was kept.
    fn lines(&self) -> u32 {
        let [_, _, (_, low), (_, high)] = self.locked;
        u32::from(u16::from_le_bytes([low, high])).min(u32::from(LINES))
    }

    /// What [`EXPOSURE`]'s registers hold.
    fn exposure(&mut self) -> Result<[u8; 3], Error> {
        let [gain, low, high] = EXPOSURE;
        let registers = &mut self.registers;
        Ok([
            registers.read(gain)?,
            registers.read(low)?,
            registers.read(high)?,
        ])
    }
}

/// The gain register's: each of the upper four bits doubles, the lower ones are sixteenths more.
fn gain_sixteenths(register: u8) -> u16 {
    (16 + u16::from(register & 0x0F)) << (register >> 4).count_ones()
}
