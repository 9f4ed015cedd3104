//! onsemi (Aptina) MT9V034, mono, with a global shutter: 160 × 152 pixels of 2 × 2 binned ones,
//! over I²C with registers of 16 bits.

use super::identity::{self, Identity};
use super::mt9v034_registers::{
    AEC_AGC_ENABLE, ANALOG_GAIN, AUTOMATIC, BLANK_ROWS, FOUND, Format, LOCKED, LONGEST_EXPOSURE,
    RESET, ROW_CLOCKS, SHUTTER_WIDTH, TABLE,
};
use super::registers::Registers;
use super::{Bus, Error, Setting};
use crate::board::{CameraLines, XCLK_HZ};
use crate::shared::EXPOSURE_MIDDLE_US;
use core::sync::atomic::Ordering;
use embassy_time::{Duration, Instant, Timer};
use hivtac_sensing::motion::Motion;
use hivtac_terms::geometry::Preset;

/// What it says it is.
pub const IDENTITY: Identity = identity::MT9V034;
/// Name in the device's hello.
pub const NAME: &str = "mt9v034";
/// Its lens and pixels.
pub const PRESET: Preset = Preset::Mt9v034;
/// What it sends.
pub const USUAL_FORMAT: Format = Format::Mono;
/// Columns of a frame, px. Wider than the markers need: rows take the same time down to 80.
pub const WIDTH: u16 = 160;
/// Rows of a frame, px: what the markers reach in the calibrated range.
pub const HEIGHT: u16 = 152;

/// 244, 122 or 61: which frame rate the firmware was built for (`HIVTAC_FRAME_RATE`, `build.rs`).
pub const FRAMES_PER_SECOND: u32 = match u32::from_str_radix(env!("HIVTAC_FRAME_RATE"), 10) {
    Ok(rate) => rate,
    Err(_) => panic!("HIVTAC_FRAME_RATE must be 244, 122 or 61 with this camera"),
};
/// When its rows are exposed: all at once.
pub const MOTION: Motion = Motion::GLOBAL;
/// Clocks from frame to frame: rows with data and blank ones.
const FRAME_CLOCKS: u64 = (HEIGHT + BLANK_ROWS) as u64 * ROW_CLOCKS as u64;
/// Time from frame to frame.
pub const FRAME_TIME: Duration = Duration::from_micros(FRAME_CLOCKS * 1_000_000 / XCLK_HZ as u64);

/// PIXCLK edge on which data is stable.
pub const SAMPLE_ON_RISING_EDGE: bool = true;
/// Level of VSYNC (FRAME_VALID) while it says "no data": it is high with the rows.
pub const VSYNC_BLANKING_IS_HIGH: bool = false;
/// Level of HSYNC (LINE_VALID) while it says "no data": it is high with the data.
pub const HREF_BLANKING_IS_HIGH: bool = false;

/// After a reset, until registers are written.
const SETTLE: Duration = Duration::from_millis(20);
/// Frames in a row with the same exposure and gain are steady. The control looks at every third
/// frame.
const STEADY_FRAMES: u32 = 9;
/// Exposure and gain are taken as they are after this time.
const PATIENCE: Duration = Duration::from_millis(300);
/// The camera's control side.
pub struct Camera {
    registers: Registers,
    lines: CameraLines,
    /// What gain and exposure are kept at.
    locked: [(u8, u16); 3],
}

impl Camera {
    /// The bus at 100 kHz or up to 400 kHz. XCLK must already run.
    pub fn new(bus: Bus, lines: CameraLines) -> Self {
        Self {
            registers: Registers(bus),
            lines,
            locked: [
                (ANALOG_GAIN, 0),
                (SHUTTER_WIDTH, 0),
                (AEC_AGC_ENABLE, LOCKED),
            ],
        }
    }

    /// Has the camera run, checks that it is the right one, and resets its registers.
    pub async fn reset(&mut self) -> Result<(), Error> {
        self.lines.wake().await;
        Timer::after(SETTLE).await;
        identity::check(&mut self.registers.0)?;
        self.registers.write(RESET, 1_u16)
    }

    /// Writes the register table after a reset; returns when the camera sends well exposed frames
    /// so.
    pub async fn configure(&mut self, _format: Format) -> Result<(), Error> {
        Timer::after(SETTLE).await;
        self.registers.set(TABLE).await?;
        self.lock_exposure().await
    }

    /// There is but one format.
    pub async fn set_format(&mut self, _format: Format) -> Result<(), Error> {
        Ok(())
    }

    /// Lets exposure and gain find what the light needs, and keeps that: markers do not change
    /// their brightness with what presses the film.
    pub async fn lock_exposure(&mut self) -> Result<(), Error> {
        self.registers.write(AEC_AGC_ENABLE, AUTOMATIC)?;
        let begun = Instant::now();
        let (mut found, mut steady) = (self.exposure()?, 1);
        while steady < STEADY_FRAMES && begun.elapsed() < PATIENCE {
            Timer::after(FRAME_TIME).await;
            let now = self.exposure()?;
            steady = if now == found { steady + 1 } else { 1 };
            found = now;
        }
        let [gain, rows] = found;
        let rows = rows.clamp(1, LONGEST_EXPOSURE);
        let [(_, kept_gain), (_, kept_rows), _] = &mut self.locked;
        (*kept_gain, *kept_rows) = (gain, rows);
        self.registers.set(&self.locked).await?;
        // What was set is in force from the next frame on.
        Timer::after(2 * FRAME_TIME).await;
        // All rows' exposure ends before the first one is read.
        EXPOSURE_MIDDLE_US.store(-(rows_us(rows) as i32) / 2, Ordering::Relaxed);
        Ok(())
    }

    /// What it is set to, while frames are captured.
    pub async fn setting(&mut self, _format: Format) -> Result<Setting, Error> {
        let [(_, gain), (_, rows), _] = self.locked;
        Ok(Setting {
            id: identity::id(&mut self.registers.0)?,
            comparison: self.registers.compare(&[TABLE, &self.locked]).await?,
            exposure_us: rows_us(rows),
            longest_exposure_us: rows_us(LONGEST_EXPOSURE),
            gain_sixteenths: gain,
        })
    }

    /// What [`FOUND`]'s registers hold.
    fn exposure(&mut self) -> Result<[u16; 2], Error> {
        let [gain, rows] = FOUND;
        Ok([self.registers.read(gain)?, self.registers.read(rows)?])
    }
}

/// So many rows' time, µs.
fn rows_us(rows: u16) -> u32 {
    (u64::from(rows) * u64::from(ROW_CLOCKS) * 1_000_000 / u64::from(XCLK_HZ)) as u32
}
